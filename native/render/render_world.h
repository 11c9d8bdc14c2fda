#pragma once

#include <memory>

#include "render/frame.h"
#include "transport/media.h"

namespace cistern {

/// All that the frames of a render look at, immutable but for what is learned and kept alive together: also after the
/// render, for history that was found in it.
struct RenderWorld {
  RenderWorld(const Settings& the_settings, std::shared_ptr<const Scene> the_scene,
              std::shared_ptr<const Accel> the_accel, std::shared_ptr<const LightSet> the_lights,
              std::shared_ptr<const CausticGuide> the_caustics, std::shared_ptr<SurfaceFilm> the_surfaces = {});
  /// Of another moment, with the same settings. What was learned is kept; of lights, where they are the same, else
  /// nothing is learned from then on.
  RenderWorld(const RenderWorld& earlier, std::shared_ptr<const Scene> the_scene,
              std::shared_ptr<const Accel> the_accel, std::shared_ptr<const LightSet> the_lights);
  RenderWorld(const RenderWorld&) = delete;
  RenderWorld& operator=(const RenderWorld&) = delete;

  const Settings settings;
  const std::shared_ptr<const Scene> scene;
  const std::shared_ptr<const Accel> accel;
  const std::shared_ptr<const LightSet> lights;
  const PixelFilter filter;
  const std::shared_ptr<LearnedLightStage> learning;   // null unless needed; changes between frames
  const std::shared_ptr<GuidingStage> guiding;         // the same
  const std::shared_ptr<const CausticGuide> caustics;  // null unless needed
  const std::shared_ptr<SurfaceFilm> surfaces;         // null unless asked for
  const std::shared_ptr<const Media> media;            // null where there are none
  const PathContext paths;
  const std::shared_ptr<FrameSequences> sequences;  // changes between frames
  const FrameContext context;                       // refers to the above

 private:
  RenderWorld(Settings the_settings, std::shared_ptr<const Scene> the_scene, std::shared_ptr<const Accel> the_accel,
              std::shared_ptr<const LightSet> the_lights, std::shared_ptr<SurfaceFilm> the_surfaces,
              std::shared_ptr<LearnedLightStage> the_learning, std::shared_ptr<GuidingStage> the_guiding,
              std::shared_ptr<const CausticGuide> the_caustics, std::shared_ptr<FrameSequences> the_sequences);
};

}  // namespace cistern
