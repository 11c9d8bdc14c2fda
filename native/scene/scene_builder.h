#pragma once

#include <map>
#include <optional>
#include <span>
#include <unordered_map>

#include "scene/diced_mesh.h"
#include "scene/displaced_mesh.h"
#include "scene/known_tangents.h"
#include "scene/scene.h"
#include "scene/surface_sheet.h"

namespace cistern {

/// See SubdivisionCage; every span is read during the call only.
struct SubdivisionInput {
  SubdivisionScheme scheme = SubdivisionScheme::CATMULL_CLARK;
  UvSmoothing uv_smoothing = UvSmoothing::BOUNDARIES;
  bool keeps_corners = false;
  int uv_maps = 0;
  std::vector<std::string> encoded_colors;  // names of attributes
  float pixels = 1.0f;
  float length = 0.0f;
  std::span<const int32_t> creases;  // two points to an edge
  std::span<const float> crease_sharpness;
  std::span<const int32_t> sharp_vertices;
  std::span<const float> vertex_sharpness;
};

/// Polygons as Blender keeps them; every span is read during the call only.
struct MeshInput {
  std::string name;
  std::span<const Vec3> positions;
  std::span<const int32_t> corner_vertices;  // per corner: index into positions
  /// polygon_count + 1 offsets into the corners. Empty: every polygon is a triangle.
  std::span<const int32_t> polygon_offsets;
  /// Triangulation made elsewhere: 3 corner indices and one polygon index per triangle. Needed only when a polygon
  /// has more than 4 corners; empty otherwise.
  std::span<const int32_t> triangle_corners;
  std::span<const int32_t> triangle_polygons;
  std::span<const int32_t> material_indices;  // per polygon; empty = 0
  Domain normals_domain = Domain::FACE;       // FACE: `normals` is empty
  std::span<const Vec3> normals;              // per point or per corner, any length > 0
  std::span<const uint8_t> sharp_faces;       // per polygon, 1 = flat although normals exist at points; may be empty
  std::vector<MeshAttribute> attributes;
  std::optional<Bounds3> texture_space;  // see Mesh
  /// How the mesh is subdivided for each picture; not set: it is as it is.
  std::optional<SubdivisionInput> subdivision;
};

/// Strands of hair; every span is read during the call only.
struct StrandInput {
  std::string name;
  std::span<const Vec3> positions;            // of all keys, strand after strand
  std::span<const float> radii;               // beside positions; below 0 means 0
  std::span<const int32_t> strand_offsets;    // strand_count + 1 offsets into the keys
  std::span<const int32_t> material_indices;  // per strand; empty = 0
  StrandShape shape = StrandShape::SPLINES;
  std::vector<MeshAttribute> attributes;  // POINT: at keys, FACE: at strands; a UV map first
};

/// Gaussian splats; every span is read during the call only, and has an element for each.
struct SplatInput {
  std::string name;
  std::span<const Vec3> positions;
  std::span<const Vec3> scales;                     // standard deviations along their axes; signs do not matter
  std::span<const std::array<float, 4>> rotations;  // quaternions w, x, y, z of any length
  std::span<const std::array<float, 4>> radiance;   // SplatColors::base and opacity
  std::span<const std::array<std::array<uint8_t, 3>, SplatColors::kHarmonics>> harmonics;  // empty: none
  std::optional<std::array<float, 9>> to_working_space;  // from linear Rec. 709, row by row
  std::vector<MeshAttribute> attributes;                 // POINT
};

/// A volume object: the box [0, size] of `object_to_box`, whose unit is about a voxel, and what is inside.
struct VolumeInput {
  std::string name;
  Transform object_to_box;
  std::array<int, 3> size{};
  std::vector<VoxelGrid> grids;
  bool scales_with_object = false;
  float drift_opening = 0.0f;            // VoxelDrift::opening; the way is the grid called kDriftGrid
  std::optional<Bounds3> texture_space;  // see Mesh: where the box is larger for what drifts
};

/// Collects a scene; keeps handles stable across edits. Not thread-safe; `snapshot` returns an immutable copy that
/// shares all meshes, images and programs. Bad input throws Error and leaves the builder as it was.
class SceneBuilder {
 public:
  SceneBuilder() = default;
  /// Goes on from a snapshot: its handles are valid here, and what is not replaced is shared with it. Meshes are as
  /// they were before displacement.
  explicit SceneBuilder(const Scene& earlier);

  /// Splits polygons into triangles (a concave quad along the diagonal from its reflex corner), drops triangles that
  /// are degenerate or not finite (counted in Mesh::dropped_triangles), checks every index. A mesh without
  /// polygons is allowed. Handles count up from 0; passing `replace` keeps a handle, and the old mesh itself if the new
  /// one is equal. The same goes for images and materials.
  int add_mesh(const MeshInput& input, std::optional<int> replace = {});
  /// Strands as a mesh. Those with fewer than two keys are left out, and those that are not finite, whose segments
  /// Mesh::dropped_triangles counts.
  int add_strands(const StrandInput& input, std::optional<int> replace = {});
  /// Splats as a mesh. Those with opacities up to kLeastSplatOpacity are left out, and those without a shape, which
  /// Mesh::dropped_triangles counts: scales or rotations of 0, or what is not finite.
  int add_splats(const SplatInput& input, std::optional<int> replace = {});
  /// The mesh of a volume object, its box. Values of grids that are not finite are the caller's to avoid.
  int add_volume(VolumeInput input, std::optional<int> replace = {});
  /// Shares a mesh of another scene.
  int add_mesh(std::shared_ptr<const Mesh> mesh);
  int add_image(Image image, std::optional<int> replace = {});
  /// Runs `finish_program`.
  int add_material(MaterialProgram program, std::optional<int> replace = {});
  /// A set may be empty: then slot 0 is `default_material`, made on demand (grey diffuse, 0.8). Equal sets, and equal
  /// names of objects with equal labels, have one handle.
  int add_material_set(std::vector<int> materials, const std::string& owner_name);
  int add_object_name(std::string name, const ObjectLabel& label = {});
  /// Throws Error naming the object for a matrix with non-finite entries. A singular matrix (flat object) is not an
  /// error: returns the handle of an instance that is left out of the picture and counted in `singular_instances`.
  int add_instance(const Instance& instance, std::optional<int> replace = {});
  /// Of all instances, before and after this call; rows without a number for each name throw.
  void set_instance_values(const std::vector<std::string>& names, std::vector<float> rows);
  int add_light(Light light, std::optional<int> replace = {});
  void set_environment(const Environment& environment);
  void set_camera(const Camera& camera, const std::string& name);
  /// Meshes with a cage are subdivided for the camera that is set now, whatever is set later, in place of
  /// `view.camera`; without a view they are shown as they are. Throws Error naming `owner`.
  void set_dicing(std::optional<DicingView> view, const std::string& owner);
  /// Makes the camera that is set look at a sheet instead, for pictures of its size: from right above, or from where it
  /// is; another one takes its place. Instances and meshes of the sheet must not change any more.
  void set_sheet(const SheetInput& input, bool sees_from_eye, const std::string& name);
  /// Of the frame before (0) or after (1): the camera as it is set now, matrices by instance, and points of meshes that
  /// have another shape then, which rest where they are not finite. Throws Error for other numbers of them.
  void set_motion_step(int step, std::vector<Transform> object_to_world,
                       std::unordered_map<int, std::vector<Vec3>> positions = {});
  /// Of what is there now, normals of meshes with a single instance are transformed before they are interpolated, where
  /// that makes a difference: it is stretched or sheared. As Cycles in final renders, but for what it leaves in object
  /// space: meshes that are displaced, diced, or have subsurface scattering. [Cycles,
  /// ObjectManager::apply_static_transforms]
  void blend_normals_in_world();
  void remove_mesh(int handle);
  void remove_instance(int handle);
  void remove_light(int handle);
  void clear_instances();
  void clear_lights();

  /// The scene as it stands; valid until the next change.
  const Scene& scene() const { return scene_; }
  int singular_instances() const { return singular_instances_; }
  std::shared_ptr<const Scene> snapshot() const;
  /// What was displaced for earlier snapshots, kept here for later ones by those who displace.
  std::vector<DisplacedMesh>& displaced_meshes() { return displaced_meshes_; }
  /// The same of what was diced.
  std::vector<DicedMesh>& diced_meshes() { return diced_meshes_; }
  /// The same of tangents.
  KnownTangents& known_tangents() const { return known_tangents_; }

 private:
  Scene scene_;
  std::vector<DisplacedMesh> displaced_meshes_;
  std::vector<DicedMesh> diced_meshes_;
  mutable KnownTangents known_tangents_;
  int default_material_ = -1;
  std::map<std::vector<int>, int> material_set_handles_;
  std::unordered_multimap<std::string, int> object_handles_;  // by name
  int singular_instances_ = 0;
};

}  // namespace cistern
