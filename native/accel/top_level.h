#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "accel/mesh_scene.h"
#include "scene/scene.h"

namespace cistern {

// Ray masks: the RayVisibility bits four times over, of all surfaces, of opaque ones, of those that may let light
// through, and of instances that are not only where media begin and end; and a bit for those with a medium inside. Of
// opaque instances that may be panes a bit of their own stands in for kVisibleToShadow; and one for all splats.
inline constexpr uint32_t any_surface_mask(uint8_t visibility) { return visibility; }
inline constexpr uint32_t opaque_mask(uint8_t visibility) { return uint32_t{visibility} << 8; }
inline constexpr uint32_t transparent_mask(uint8_t visibility) { return uint32_t{visibility} << 16; }
inline constexpr uint32_t surface_mask(uint8_t visibility) { return uint32_t{visibility} << 24; }
inline constexpr uint32_t kMediumMask = 1u << 7, kPaneMask = 1u << 15, kSplatMask = 1u << 23;
static_assert((kVisibleToAll & 1u << 7) == 0, "the masks overlap");

using MeshScenes = std::unordered_map<const Mesh*, std::shared_ptr<const MeshScene>>;

/// How one instance enters the top level; equal placements of all instances mean an equal top level.
struct Placement {
  std::shared_ptr<const Mesh> mesh;  // null: not there
  Transform object_to_world;
  uint32_t mask = 0;
  bool is_flattened = false;
  bool is_pane = false;           // see Accel::may_be_pane
  uint8_t shadow_set = 0;         // 0 unless the scene has_shadow_links
  bool is_shadow_linked = false;  // see Accel::intersect_shadow_linked

  bool has_medium() const { return (mask & kMediumMask) != 0; }
  friend bool operator==(const Placement&, const Placement&) = default;
};

/// Embree's scene of everything, with the instance's index as geometry id.
struct TopLevel {
  std::shared_ptr<const EmbreeDevice> device;
  std::vector<Placement> placements;
  std::vector<std::shared_ptr<const MeshScene>> mesh_scenes;  // kept alive
  EmbreeScene scene;
  /// Maps Embree's normal of an instance to the world when its transpose is applied: world to object, or for
  /// flattened ones the identity, negated where the transform mirrors (which turns the winding over).
  std::vector<Transform> normal_maps;
  Bounds3 bounds;
  bool has_transparent_surfaces = false;
  bool has_shadow_linked_surfaces = false;
  bool has_media = false;
  bool has_panes = false;
  bool has_splats = false;
  bool is_filtered = false;  // see new_scene
  size_t memory_bytes = 0;
};

/// Which instances are there, what sees them, and which are flattened: those whose mesh has no other instance, and that
/// no ray is to meet alone, unless `keep_instances`.
std::vector<Placement> place_instances(const Scene& scene, bool keep_instances);

/// Builds with the threads of the caller's arena; `mesh_scenes` has every mesh that is not flattened, `is_filtered` as
/// the top level. Null when stopped. Throws Error.
std::shared_ptr<const TopLevel> build_top_level(std::shared_ptr<const EmbreeDevice> device,
                                                std::vector<Placement> placements, const MeshScenes& mesh_scenes,
                                                bool is_filtered, const IsStopped& is_stopped);

}  // namespace cistern
