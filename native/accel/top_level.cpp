#include "accel/top_level.h"

#include <algorithm>
#include <map>

#include "accel/pane_shape.h"

namespace cistern {
namespace {

/// What its materials say of an instance. Told once for each set: a set may have thousands, and a million instances.
struct SetTraits {
  bool may_be_transparent = false, may_be_pane = false, has_volume = false, may_emit = false;  // one of them
  bool is_traced_alone = false;                                                                // the same
  bool is_boundary = false;                                                                    // all of them
};

SetTraits traits_of(const Scene& scene, const std::vector<int>& materials) {
  SetTraits traits;
  traits.is_boundary = !materials.empty();
  for (const int material : materials) {
    const MaterialProgram* const program = material < 0 ? nullptr : scene.materials[material].get();
    traits.is_boundary &= program && program->is_boundary;
    if (!program) continue;
    traits.may_be_transparent |= program->may_be_transparent;
    traits.may_be_pane |= program->may_be_pane;
    traits.has_volume |= program->has_volume;
    traits.may_emit |= program->may_emit;
    traits.is_traced_alone |= program->has_subsurface || program->looks_at_own_object;
  }
  return traits;
}

std::vector<SetTraits> traits_of_sets(const Scene& scene) {
  std::vector<SetTraits> traits(scene.material_sets.size());
  std::ranges::transform(scene.material_sets, traits.begin(),
                         [&](const std::vector<int>& materials) { return traits_of(scene, materials); });
  return traits;
}

uint32_t opaque_instance_mask(bool is_pane, uint8_t visibility) {
  return is_pane && (visibility & kVisibleToShadow) != 0 ? opaque_mask(visibility & ~kVisibleToShadow) | kPaneMask
                                                         : opaque_mask(visibility);
}

/// Strands of hair have no inside.
uint32_t mask_of(const SetTraits& traits, const Instance& instance, const Mesh& mesh, bool is_pane) {
  const uint8_t visibility = instance.visibility & kVisibleToAll;
  uint32_t mask = any_surface_mask(visibility);
  mask |= traits.may_be_transparent ? transparent_mask(visibility) : opaque_instance_mask(is_pane, visibility);
  if (!traits.is_boundary) mask |= surface_mask(visibility);
  if (visibility != 0 && !mesh.is_strands() && traits.has_volume) mask |= kMediumMask;
  if (visibility != 0 && mesh.splats) mask |= kSplatMask;
  return mask;
}

/// Which meshes have the shape of panes with which materials. Told once for each: there may be a million instances.
class PaneShapes {
 public:
  bool has(const Scene& scene, const Instance& instance) {
    const auto [known, is_new] = shapes_.try_emplace({instance.mesh, instance.material_set});
    if (is_new) known->second = has_pane_shape(scene, instance);
    return known->second;
  }

 private:
  std::map<std::pair<int, int>, bool> shapes_;
};

/// Whether rays, taken to the space of an object this small, may lie beyond what Embree allows (1.8e18), which ends the
/// process where it was built with assertions.
bool enlarges_rays(const Transform& object_to_world) {
  constexpr float kLargest = 1e12f;
  const Transform to_object = inverse(object_to_world);
  const auto is_large = [](Vec3 v) { return !(std::abs(v.x) + std::abs(v.y) + std::abs(v.z) < kLargest); };
  return is_large(to_object.row_x) || is_large(to_object.row_y) || is_large(to_object.row_z);
}

Transform normal_map(const Placement& placement) {
  if (!placement.is_flattened) return inverse(placement.object_to_world);
  const float side = placement.object_to_world.determinant() < 0.0f ? -1.0f : 1.0f;
  return {{side, 0.0f, 0.0f}, {0.0f, side, 0.0f}, {0.0f, 0.0f, side}, {}};
}

EmbreeGeometry instance_geometry(const EmbreeDevice& device, const MeshScene& mesh_scene, const Transform& m) {
  EmbreeGeometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE));
  device.check("making an instance");
  rtcSetGeometryInstancedScene(geometry.get(), mesh_scene.scene.get());
  rtcSetGeometryTimeStepCount(geometry.get(), 1);
  const float rows[12] = {m.row_x.x, m.row_x.y,       m.row_x.z, m.translation.x, m.row_y.x, m.row_y.y,
                          m.row_y.z, m.translation.y, m.row_z.x, m.row_z.y,       m.row_z.z, m.translation.z};
  rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows);
  return geometry;
}

void attach(TopLevel& top, size_t index, const MeshScenes& mesh_scenes) {
  const Placement& placement = top.placements[index];
  EmbreeGeometry geometry;
  if (placement.is_flattened) {
    geometry = flattened_geometry(*top.device, *placement.mesh, placement.object_to_world);
  } else {
    geometry = instance_geometry(*top.device, *mesh_scenes.at(placement.mesh.get()), placement.object_to_world);
  }
  rtcSetGeometryMask(geometry.get(), placement.mask);
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometryByID(top.scene.get(), geometry.get(), static_cast<unsigned>(index));
  top.normal_maps[index] = normal_map(placement);
}

Bounds3 scene_bounds(RTCScene scene) {
  RTCBounds b;
  rtcGetSceneBounds(scene, &b);
  return {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
}

}  // namespace

std::vector<Placement> place_instances(const Scene& scene, bool keep_instances) {
  std::vector<uint32_t> uses(scene.meshes.size(), 0);
  for (const Instance& instance : scene.instances) {
    if (instance.mesh >= 0) ++uses[instance.mesh];
  }
  const bool has_shadow_links = scene.has_shadow_links();
  const std::vector<SetTraits> traits_by_set = traits_of_sets(scene);
  std::vector<Placement> placements(scene.instances.size());
  PaneShapes panes;
  for (size_t i = 0; i < placements.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.mesh < 0) continue;
    const std::shared_ptr<const Mesh>& mesh = scene.meshes[instance.mesh];
    if (!mesh || mesh->triangle_count() == 0) continue;
    const SetTraits& traits = traits_by_set[static_cast<size_t>(instance.material_set)];
    const bool is_pane = traits.may_be_pane && panes.has(scene, instance);
    const uint32_t mask = mask_of(traits, instance, *mesh, is_pane);
    if (mask == 0) continue;
    const bool is_flattened =
        !keep_instances && uses[instance.mesh] == 1 && !mesh->is_strands() && !traits.is_traced_alone;
    if (!is_flattened && enlarges_rays(instance.object_to_world)) continue;
    placements[i] = {mesh, instance.object_to_world, mask, is_flattened, is_pane};
    if (!has_shadow_links) continue;
    placements[i].shadow_set = instance.shadow_set;
    placements[i].is_shadow_linked = instance.links.blockers != kAllSets && traits.may_emit;
  }
  return placements;
}

std::shared_ptr<const TopLevel> build_top_level(std::shared_ptr<const EmbreeDevice> device,
                                                std::vector<Placement> placements, const MeshScenes& mesh_scenes,
                                                bool is_filtered, const IsStopped& is_stopped) {
  constexpr size_t kInstancesBetweenLooks = 1 << 12;
  const auto top = std::make_shared<TopLevel>();
  const size_t bytes_before = device->memory_bytes();
  top->scene = new_scene(*device, is_filtered);
  top->is_filtered = is_filtered;
  top->device = std::move(device);
  top->placements = std::move(placements);
  top->normal_maps.resize(top->placements.size());
  for (const auto& [mesh, mesh_scene] : mesh_scenes) top->mesh_scenes.push_back(mesh_scene);
  for (size_t i = 0; i < top->placements.size(); ++i) {
    if (i % kInstancesBetweenLooks == 0 && is_stopped && is_stopped()) return nullptr;
    if (!top->placements[i].mesh) continue;
    attach(*top, i, mesh_scenes);
    top->has_shadow_linked_surfaces |= top->placements[i].is_shadow_linked;
    top->has_panes |= top->placements[i].is_pane;
    top->has_splats |= (top->placements[i].mask & kSplatMask) != 0;
    top->has_media |= top->placements[i].has_medium();
    top->has_transparent_surfaces |= (top->placements[i].mask & transparent_mask(kVisibleToAll)) != 0;
  }
  if (!commit_scene(*top->device, top->scene.get(), is_stopped, "building the scene")) return nullptr;
  top->bounds = scene_bounds(top->scene.get());
  top->memory_bytes = top->device->memory_bytes_since(bytes_before);
  return top;
}

}  // namespace cistern
