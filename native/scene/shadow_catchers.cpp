#include "scene/shadow_catchers.h"

namespace cistern {

bool has_shadow_catchers(const Scene& scene) {
  return std::ranges::any_of(scene.instances, [](const Instance& i) { return i.mesh >= 0 && i.is_shadow_catcher; });
}

Scene shadow_catchers_alone(const Scene& scene) {
  Scene alone = scene;
  for (Instance& instance : alone.instances) {
    if (instance.is_shadow_catcher) continue;
    instance.visibility &= kVisibleToCamera;
    instance.is_holdout = true;
    if (instance.visibility == 0) instance.mesh = -1;
  }
  return alone;
}

Scene backdrop(const Scene& scene) {
  Scene empty = scene;
  for (Instance& instance : empty.instances) instance.mesh = -1;
  for (Light& light : empty.lights) light.removed = true;
  return empty;
}

}  // namespace cistern
