#include "render/render_world.h"

#include <algorithm>

#include "transport/camera_ray.h"

namespace cistern {
namespace {

bool records_surfaces(const std::vector<Pass>& passes) {
  return std::ranges::any_of(passes, [](Pass pass) { return pass >= Pass::DEPTH && pass < Pass::CELLS; });
}

/// With one or two emitters, there is little to choose between.
int light_samples(const Settings& settings, const LightSet& lights) {
  constexpr size_t kFew = 2;
  return settings.direct == DirectAnswer::NEE && lights.emitter_count() > kFew ? settings.light_samples : 1;
}

}  // namespace

RenderWorld::RenderWorld(Settings the_settings, std::shared_ptr<const Scene> the_scene,
                         std::shared_ptr<const Accel> the_accel, std::shared_ptr<const LightSet> the_lights)
    : settings(std::move(the_settings)),
      scene(std::move(the_scene)),
      accel(std::move(the_accel)),
      lights(std::move(the_lights)),
      filter(settings.pixel_filter, settings.filter_width),
      learning(LearnedLightStage::make(settings, *scene, *accel, *lights)),
      guiding(GuidingStage::make(settings, *scene, *accel)),
      paths{*scene,
            *accel,
            *lights,
            settings.limits,
            pixel_footprint(scene->camera, settings.width, settings.height),
            records_surfaces(settings.passes),
            scatter_kinds_matter(*scene, settings.limits),
            emitters_tell_kinds(*scene),
            light_samples(settings, *lights),
            learning ? learning->use() : nullptr,
            guiding ? guiding->use() : nullptr},
      context{settings, paths, filter, learning.get(), guiding.get()} {}

}  // namespace cistern
