#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/splat_cloud.h"
#include "scene/subdivision_cage.h"
#include "scene/voxel_volume.h"

namespace cistern {

/// Where per-element data of a mesh lives; `CORNER` is a vertex of one polygon.
enum class Domain : uint8_t { POINT, FACE, CORNER };

/// 32 bits that stand for an attribute's name, never 0: shading compares these, not strings. [FNV-1a]
inline uint32_t attribute_name_hash(const std::string& name) {
  uint32_t hash = 2166136261u;
  for (const char c : name) hash = (hash ^ static_cast<uint8_t>(c)) * 16777619u;
  return hash != 0 ? hash : 1u;
}

/// Name of the attribute, three floats to a point, that holds Generated coordinates where these are not the mesh's
/// bounds mapped to [0, 1].
inline constexpr std::string_view kGeneratedAttribute = "INFO:generated";

/// Name of the attribute, three floats to a point, that tells how far points go in the second half of an exposure where
/// other moments of that do not tell; as far in the first half. In object space.
inline constexpr std::string_view kDriftAttribute = "INFO:drift";

/// A named per-corner or per-point attribute of 1 to 4 floats (UV maps have 2, colours 4).
struct MeshAttribute {
  std::string name;
  Domain domain = Domain::CORNER;
  int components = 2;
  std::shared_ptr<const float[]> values;  // components floats per element
  uint32_t name_hash = 0;                 // attribute_name_hash(name), set by SceneBuilder
};

struct Dicing;

using TriangleIndices = std::array<uint32_t, 3>;

/// What strands are between their keys: round splines [Catmull and Rom 1974], round lines, or nothing but a ball or a
/// Gaussian splat about each key.
enum class StrandShape : uint8_t { SPLINES, LINES, BALLS, SPLATS };

/// A triangle mesh in object space, immutable once built. See scene_builder.h for how polygons become triangles.
///
/// Or strands of hair, which have radii: then a "triangle" is a segment between two keys, {first, second, second}, a
/// "polygon" a strand, and the weight of vertex 1 says how far along the segment; see strand_curve.h for its shape.
struct Mesh {
  std::string name;
  std::vector<Vec3> positions;            // capacity for one more, so that Embree may read 16 bytes at the last
  std::vector<TriangleIndices> vertices;  // per triangle: indices into positions
  std::vector<TriangleIndices> corners;   // per triangle: indices into corner data; empty without such data
  std::vector<uint32_t> polygons;         // per triangle: its polygon; empty where every polygon is a triangle
  std::vector<uint16_t> material_slots;   // per triangle; empty = slot 0 everywhere
  Domain normals_domain = Domain::FACE;   // FACE: flat shading, no stored normals
  std::vector<uint32_t> normals;          // octahedral 2x16 bits per point or per corner
  std::vector<uint8_t> sharp_polygons;    // 1: flat triangle by triangle, though there are normals; empty = none
  std::vector<MeshAttribute> attributes;  // UV maps first, in Blender's order
  int generated_attribute = -1;           // index of kGeneratedAttribute; -1: none
  std::vector<float> radii;               // of strands: per position, in object space, at least 0; empty: triangles
  StrandShape strand_shape = StrandShape::SPLINES;
  uint32_t corner_count = 0;  // elements of corner data; of strands: how many there are
  Bounds3 bounds;             // of all finite positions, loose ones included
  /// What Generated coordinates inside of it, in media, map to [0, 1]; not set: generated_bounds.
  std::optional<Bounds3> texture_space;
  uint32_t dropped_triangles = 0;  // degenerate or with non-finite coordinates: left out, reported
  /// What displacement made this of, with the same triangles in the same order; null for what is as it was built.
  std::shared_ptr<const Mesh> undisplaced;
  /// Beside it where that is flat and the shading asks: octahedral normals at its points.
  std::vector<uint32_t> undisplaced_normals;
  /// Its polygons, where it is to be subdivided for each picture; null for others. See subdivision/dice_mesh.h.
  std::shared_ptr<const SubdivisionCage> cage;
  /// What this was diced from, and for whom (diced_mesh.h); null for others.
  std::shared_ptr<const Dicing> dicing;
  /// Inside of it, where it is the box of a volume object; null for others.
  std::shared_ptr<const VoxelVolume> volume;
  /// Of splats: what is about each key; null for others.
  std::shared_ptr<const SplatCloud> splats;

  bool is_strands() const { return !radii.empty(); }
  /// Itself unless displacement moved it.
  const Mesh& original() const { return undisplaced ? *undisplaced : *this; }
  /// What Generated coordinates map to [0, 1].
  const Bounds3& generated_bounds() const;
  size_t triangle_count() const { return vertices.size(); }
  /// Of its three vertices.
  std::array<Vec3, 3> triangle_positions(size_t triangle) const {
    const TriangleIndices& v = vertices[triangle];
    return {positions[v[0]], positions[v[1]], positions[v[2]]};
  }
  /// Whether a triangle is shaded by its own normal alone.
  bool is_flat(size_t triangle) const;
  /// Elements of `domain` that the three vertices of a triangle read.
  TriangleIndices elements(uint32_t triangle, Domain domain) const;
  /// Index of the attribute called `name`, or -1.
  int find_attribute(const std::string& name) const;
  /// The same by its attribute_name_hash.
  int find_attribute(uint32_t name_hash) const;
  /// Index of the first UV map, or -1.
  int first_uv_map() const;
};

/// Whether all of two meshes is equal, value by value.
bool is_same_mesh(const Mesh& a, const Mesh& b);

/// Bytes held by the mesh, attribute values included.
size_t memory_bytes(const Mesh& mesh);

/// Unit vector <-> 2 x 16 bit octahedral code. [Cigolle et al. 2014]
uint32_t encode_octahedral(Vec3 n);
Vec3 decode_octahedral(uint32_t code);

}  // namespace cistern
