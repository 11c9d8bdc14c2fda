#include "transport/media.h"

#include <algorithm>
#include <map>

#include "base/rng.h"

namespace cistern {
namespace {

const MaterialProgram* program_with_volume(const Scene& scene, int material) {
  const MaterialProgram* program = material < 0 ? nullptr : scene.materials[static_cast<size_t>(material)].get();
  return program && program->has_volume ? program : nullptr;
}

/// Strands of hair have no inside.
const MaterialProgram* volume_of(const Scene& scene, const Instance& instance) {
  if (instance.mesh < 0 || !scene.meshes[static_cast<size_t>(instance.mesh)]) return nullptr;
  if (scene.meshes[static_cast<size_t>(instance.mesh)]->is_strands()) return nullptr;
  for (const int material : scene.material_sets[static_cast<size_t>(instance.material_set)])
    if (const MaterialProgram* program = program_with_volume(scene, material)) return program;
  return nullptr;
}

AliasTable receiver_free_choice(const LightSet& lights) {
  std::vector<float> pmf(lights.emitter_count());
  for (size_t i = 0; i < pmf.size(); ++i) pmf[i] = lights.receiver_free_pmf(static_cast<uint32_t>(i));
  return AliasTable(pmf);
}

}  // namespace

std::string Media::find_name(const Scene& scene) {
  if (const MaterialProgram* program = program_with_volume(scene, scene.environment.material)) return program->name;
  const bool is_any = std::ranges::any_of(scene.materials, [](const auto& m) { return m && m->has_volume; });
  if (!is_any) return {};
  for (const Instance& instance : scene.instances)
    if (const MaterialProgram* program = volume_of(scene, instance)) return program->name;
  return {};
}

std::shared_ptr<const Media> Media::make(const Scene& scene, const LightSet& lights) {
  if (find_name(scene).empty()) return nullptr;
  std::shared_ptr<Media> media(new Media(scene));
  media->fills_world_ = program_with_volume(scene, scene.environment.material) != nullptr;
  for (uint32_t i = 0; i < scene.instances.size(); ++i)
    if (volume_of(scene, scene.instances[i])) media->volumes_.emplace_back(i, world_bounds(scene, scene.instances[i]));
  media->find_bounds();
  if (media->fills_world_ && program_with_volume(scene, scene.environment.material)->volume_varies)
    media->world_bounds_ = find_world_extinction_bounds(scene);
  media->emitters_ = receiver_free_choice(lights);
  return media;
}

bool Media::has_medium(uint32_t instance, int material) const {
  return program_with_volume(scene_, material) &&
         !scene_.meshes[static_cast<size_t>(scene_.instances[instance].mesh)]->is_strands();
}

bool Media::is_boundary(const SurfacePoint& point, uint8_t ray_kind) const {
  if (!(scene_.instances[point.instance].visibility & ray_kind)) return true;
  return has_medium(point.instance, point.material) &&
         scene_.materials[static_cast<size_t>(point.material)]->is_boundary;
}

SegmentMedia Media::together(const MediaStack& stack, const PathState& path, Vec3 direction, bool is_endless) const {
  SegmentMedia segment;
  const auto add_uneven = [&](const MediaStack::Entry& entry) {
    segment.uneven.enter(entry);
    segment.may_shine |= scene_.materials[static_cast<size_t>(entry.material)]->volume_shines;
  };
  if (world_bounds_)
    add_uneven({MediaStack::kWorld, scene_.environment.material});
  else if (fills_world_)
    add_environment_medium(segment.even, scene_, path, direction, {});
  for (const MediaStack::Entry& entry : stack) {
    if (is_endless || !(scene_.instances[entry.instance].visibility & path.ray_kind)) continue;
    if (scene_.materials[static_cast<size_t>(entry.material)]->volume_varies) {
      add_uneven(entry);
    } else {
      add_medium(segment.even, scene_, entry.instance, entry.material, path, direction, {});
    }
  }
  segment.may_shine |= !is_black(segment.even.emission);
  return segment;
}

uint8_t Media::light_set(const MediaStack& stack) const {
  return fills_world_ || stack.is_empty() ? 0 : scene_.instances[stack.begin()->instance].light_set;
}

bool Media::shine_on(const MediaStack& stack, uint8_t receiver) const {
  return fills_world_ || stack.is_empty() || has_set(scene_.instances[stack.begin()->instance].links.lit, receiver);
}

LightGroup Media::light_group(const MediaStack& stack) const {
  return stack.is_empty() ? scene_.environment.light_group : scene_.instances[(stack.end() - 1)->instance].light_group;
}

void Media::add_entry(Medium& medium, const MediaStack::Entry& entry, const PathState& path, Vec3 direction,
                      Vec3 position) const {
  if (entry.instance == MediaStack::kWorld) return add_environment_medium(medium, scene_, path, direction, position);
  add_medium(medium, scene_, entry.instance, entry.material, path, direction, position);
}

Medium Media::world_at(const PathState& path, Vec3 direction, Vec3 position) const {
  Medium medium;
  add_environment_medium(medium, scene_, path, direction, position);
  return medium;
}

Medium Media::uneven_at(const SegmentMedia& segment, const PathState& path, Vec3 direction, Vec3 position) const {
  Medium medium;
  for (const MediaStack::Entry& entry : segment.uneven) add_entry(medium, entry, path, direction, position);
  return medium;
}

Medium Media::at(const SegmentMedia& segment, const PathState& path, Vec3 direction, Vec3 position) const {
  Medium medium = segment.even;
  for (const MediaStack::Entry& entry : segment.uneven) add_entry(medium, entry, path, direction, position);
  return medium;
}

BlockWalk Media::bounds_along(const MediaStack::Entry& entry, Vec3 origin, Vec3 direction) const {
  const Volume& volume = *std::ranges::lower_bound(volumes_, entry.instance, {}, &Volume::instance);
  return {*volume.extinction, volume.scale, volume.world_to_blocks.point(origin),
          volume.world_to_blocks.vector(direction)};
}

/// Instances of a mesh with the same materials share theirs: what it is exactly matters to no mean.
void Media::find_bounds() {
  struct Known {
    std::shared_ptr<const ExtinctionBounds> extinction;
    float density;
  };
  std::map<std::pair<int, int>, Known> known;
  for (Volume& volume : volumes_) {
    const Instance& instance = scene_.instances[volume.instance];
    const auto varies = [&](int material) {
      const MaterialProgram* program = program_with_volume(scene_, material);
      return program && program->volume_varies;
    };
    if (std::ranges::none_of(scene_.material_sets[static_cast<size_t>(instance.material_set)], varies)) continue;
    const float density = object_density(scene_, instance);
    const auto [place, is_new] = known.try_emplace({instance.mesh, instance.material_set});
    if (is_new) {
      const auto found = find_extinction_bounds(scene_, volume.instance);
      place->second = {std::make_shared<const ExtinctionBounds>(found), density};
    }
    volume.extinction = place->second.extinction;
    volume.scale = density / place->second.density;
    volume.world_to_blocks = volume.extinction->object_to_blocks * inverse(instance.object_to_world);
  }
}

}  // namespace cistern
