#include "scene/scene_change.h"

#include <algorithm>
#include <unordered_map>

namespace cistern {
namespace {

constexpr uint32_t kNone = SceneChange::kNone;

template <class T>
bool is_same_object(const std::shared_ptr<const T>& a, const std::shared_ptr<const T>& b) {
  return a == b || (a && b && *a == *b);
}

template <class T>
std::shared_ptr<const T> at(const std::vector<std::shared_ptr<const T>>& values, int handle) {
  return handle >= 0 ? values[static_cast<size_t>(handle)] : nullptr;
}

bool is_same_material(const Scene& a, const Scene& b, int handle) {
  const auto in_a = static_cast<size_t>(handle) < a.materials.size() ? at(a.materials, handle) : nullptr;
  const auto in_b = at(b.materials, handle);
  if (!is_same_object(in_a, in_b)) return false;
  return !in_b || std::ranges::all_of(in_b->images, [&](int image) {
    return static_cast<size_t>(image) < a.images.size() && is_same_object(at(a.images, image), at(b.images, image));
  });
}

/// Each later thing's earlier one by key, or by index for things without one; no earlier thing twice.
template <class T, class IsThere>
std::vector<uint32_t> match(const std::vector<T>& earlier, const std::vector<T>& later, const IsThere& is_there) {
  std::unordered_map<uint64_t, uint32_t> by_key;
  for (uint32_t i = 0; i < earlier.size(); ++i)
    if (earlier[i].key != 0 && is_there(earlier[i])) by_key.try_emplace(earlier[i].key, i);
  std::vector<uint32_t> matches(later.size(), kNone);
  for (uint32_t i = 0; i < later.size(); ++i) {
    if (!is_there(later[i])) continue;
    if (later[i].key == 0) {
      if (i < earlier.size() && earlier[i].key == 0 && is_there(earlier[i])) matches[i] = i;
    } else if (const auto found = by_key.find(later[i].key); found != by_key.end()) {
      matches[i] = found->second;
      by_key.erase(found);
    }
  }
  return matches;
}

bool is_there(const Instance& instance) { return instance.mesh >= 0; }
bool is_lit(const Light& light) { return !light.removed; }

bool has_same_links(const Instance& a, const Instance& b) {
  return a.light_set == b.light_set && a.shadow_set == b.shadow_set && a.links == b.links &&
         a.light_group == b.light_group;
}

/// Where it is, how it looks from there, who sees it and what light links and group it has; not what it is made of.
bool has_same_surface(const Scene& earlier, const Instance& a, const Scene& later, const Instance& b) {
  if (is_there(a) != is_there(b)) return false;
  if (!is_there(a)) return true;
  return a.object_to_world == b.object_to_world && a.visibility == b.visibility && a.is_holdout == b.is_holdout &&
         a.is_shadow_catcher == b.is_shadow_catcher && a.random == b.random && has_same_links(a, b) &&
         at(earlier.meshes, a.mesh) == at(later.meshes, b.mesh);
}

void compare_instances(const Scene& earlier, const Scene& later, SceneChange& change) {
  const auto is_same = [&](const Instance& a, const Instance& b) {
    return a.key == b.key && has_same_surface(earlier, a, later, b);
  };
  if (std::ranges::equal(earlier.instances, later.instances, is_same)) return;
  change.surfaces = true;
  change.earlier_instances = match(earlier.instances, later.instances, is_there);
  change.to_earlier.resize(later.instances.size());
  for (size_t i = 0; i < later.instances.size(); ++i) {
    uint32_t& match = change.earlier_instances[i];
    if (match == kNone) continue;
    const Instance &before = earlier.instances[match], &now = later.instances[i];
    if (at(earlier.meshes, before.mesh) != at(later.meshes, now.mesh)) {
      match = kNone;
    } else if (!(before.object_to_world == now.object_to_world)) {
      change.to_earlier[i] = before.object_to_world * inverse(now.object_to_world);
    }
  }
}

bool has_same_materials(const Scene& earlier, const Scene& later) {
  if (!is_same_object(earlier.instance_values, later.instance_values)) return false;
  std::vector<bool> is_checked(later.material_sets.size());
  for (size_t i = 0; i < later.instances.size(); ++i) {
    if (!is_there(later.instances[i])) continue;
    const auto set = static_cast<size_t>(later.instances[i].material_set);
    if (i >= earlier.instances.size() || earlier.instances[i].values != later.instances[i].values ||
        earlier.instances[i].material_set != later.instances[i].material_set || set >= earlier.material_sets.size() ||
        earlier.material_sets[set] != later.material_sets[set])
      return false;
    if (is_checked[set]) continue;
    is_checked[set] = true;
    for (const int material : later.material_sets[set])
      if (!is_same_material(earlier, later, material)) return false;
  }
  return true;
}

void compare_lamps(const Scene& earlier, const Scene& later, SceneChange& change) {
  const auto is_same = [&](const Light& a, const Light& b) {
    return (a.removed && b.removed) || (a == b && (b.material < 0 || is_same_material(earlier, later, b.material)));
  };
  if (std::ranges::equal(earlier.lights, later.lights, is_same)) return;
  change.lamps = true;
  change.earlier_lights = match(earlier.lights, later.lights, is_lit);
}

bool has_same_environment(const Scene& earlier, const Scene& later) {
  if (!(earlier.environment == later.environment)) return false;
  return later.environment.material < 0 || is_same_material(earlier, later, later.environment.material);
}

}  // namespace

SceneChange compare_scenes(const Scene& earlier, const Scene& later) {
  SceneChange change;
  compare_instances(earlier, later, change);
  change.materials = !has_same_materials(earlier, later);
  compare_lamps(earlier, later, change);
  change.environment = !has_same_environment(earlier, later);
  change.earlier_camera = earlier.camera;
  change.camera = !(earlier.camera == later.camera);
  change.camera_is_shaded =
      std::ranges::any_of(later.materials, [](const auto& program) { return program && program->reads_camera; });
  return change;
}

}  // namespace cistern
