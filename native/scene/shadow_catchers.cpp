#include "scene/shadow_catchers.h"

namespace cistern {

namespace {

/// Whether there is nothing but what is inside: no surface.
bool is_volume_alone(const Scene& scene, const Instance& instance) {
  if (instance.mesh < 0) return false;
  const std::vector<int>& materials = scene.material_sets[static_cast<size_t>(instance.material_set)];
  return std::ranges::all_of(materials, [&](int m) {
    return m >= 0 && scene.materials[static_cast<size_t>(m)] && scene.materials[static_cast<size_t>(m)]->is_boundary;
  });
}

}  // namespace

bool has_shadow_catchers(const Scene& scene) {
  return std::ranges::any_of(scene.instances, [](const Instance& i) { return i.mesh >= 0 && i.is_shadow_catcher; });
}

Scene shadow_catchers_alone(const Scene& scene) {
  Scene alone = scene;
  for (Instance& instance : alone.instances) {
    if (instance.is_shadow_catcher) continue;
    instance.visibility &= kVisibleToCamera;
    instance.is_holdout = true;
    if (instance.visibility == 0 || is_volume_alone(scene, instance)) instance.mesh = -1;
  }
  return alone;
}

Scene backdrop(const Scene& scene) {
  Scene empty = scene;
  for (Instance& instance : empty.instances)
    if (!instance.is_holdout) instance.mesh = -1;
  for (Light& light : empty.lights) light.removed = true;
  return empty;
}

}  // namespace cistern
