#include "render/render_world.h"

#include <algorithm>

#include "shading/dispersion.h"
#include "transport/camera_ray.h"

namespace cistern {
namespace {

bool records_surfaces(const Settings& settings) {
  const auto shows_surfaces = [](Pass pass) { return pass >= Pass::DEPTH && pass < Pass::CELLS; };
  return settings.surface_passes.any() || std::ranges::any_of(settings.passes, shows_surfaces);
}

bool wants_kinds(const Settings& settings) {
  return std::ranges::any_of(settings.passes, [](Pass pass) { return splits_kinds(pass); });
}

/// With one or two emitters, there is little to choose between.
int light_samples(const Settings& settings, const LightSet& lights) {
  constexpr size_t kFew = 2;
  return settings.direct == DirectAnswer::NEE && lights.emitter_count() > kFew ? settings.light_samples : 1;
}

}  // namespace

RenderWorld::RenderWorld(const Settings& the_settings, std::shared_ptr<const Scene> the_scene,
                         std::shared_ptr<const Accel> the_accel, std::shared_ptr<const LightSet> the_lights,
                         std::shared_ptr<const CausticGuide> the_caustics, std::shared_ptr<SurfaceFilm> the_surfaces)
    : RenderWorld(the_settings, the_scene, the_accel, the_lights, std::move(the_surfaces),
                  LearnedLightStage::make(the_settings, *the_scene, *the_accel, *the_lights),
                  GuidingStage::make(the_settings, *the_scene, *the_accel), std::move(the_caustics),
                  std::make_shared<FrameSequences>(the_settings)) {}

RenderWorld::RenderWorld(const RenderWorld& earlier, std::shared_ptr<const Scene> the_scene,
                         std::shared_ptr<const Accel> the_accel, std::shared_ptr<const LightSet> the_lights)
    : RenderWorld(earlier.settings, the_scene, the_accel, the_lights, earlier.surfaces,
                  the_lights == earlier.lights ? earlier.learning : nullptr, earlier.guiding, earlier.caustics,
                  earlier.sequences) {}

RenderWorld::RenderWorld(Settings the_settings, std::shared_ptr<const Scene> the_scene,
                         std::shared_ptr<const Accel> the_accel, std::shared_ptr<const LightSet> the_lights,
                         std::shared_ptr<SurfaceFilm> the_surfaces, std::shared_ptr<LearnedLightStage> the_learning,
                         std::shared_ptr<GuidingStage> the_guiding, std::shared_ptr<const CausticGuide> the_caustics,
                         std::shared_ptr<FrameSequences> the_sequences)
    : settings(std::move(the_settings)),
      scene(std::move(the_scene)),
      accel(std::move(the_accel)),
      lights(std::move(the_lights)),
      filter(settings.pixel_filter, settings.filter_width),
      learning(std::move(the_learning)),
      guiding(std::move(the_guiding)),
      caustics(std::move(the_caustics)),
      surfaces(std::move(the_surfaces)),
      media(Media::make(*scene, *lights)),
      paths{*scene,
            *accel,
            *lights,
            settings.limits,
            pixel_footprint(scene->camera, settings.width, settings.height),
            records_surfaces(settings),
            scatter_kinds_matter(*scene, settings.limits),
            emitters_tell_kinds(*scene),
            light_samples(settings, *lights),
            learning ? learning->use() : nullptr,
            guiding ? guiding->use() : nullptr,
            media ? nullptr : caustics.get(),  // walks in media have no guides
            surfaces != nullptr,
            media.get(),
            !find_dispersive_material(*scene).empty(),
            scene->has_shadow_links(),
            wants_kinds(settings),
            static_cast<size_t>(settings.light_groups),
            settings.groups_behind_film,
            accel->has_panes() && settings.passes_panes(*scene)},
      sequences(std::move(the_sequences)),
      context{settings, paths, filter, *sequences, learning.get(), guiding.get(), surfaces.get()} {}

}  // namespace cistern
