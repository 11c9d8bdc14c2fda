#pragma once

#include <memory>

#include "render/frame.h"

namespace cistern {

/// All that the frames of a render look at, immutable but for what is learned and kept alive together: also after the
/// render, for history that was found in it.
struct RenderWorld {
  RenderWorld(Settings the_settings, std::shared_ptr<const Scene> the_scene, std::shared_ptr<const Accel> the_accel,
              std::shared_ptr<const LightSet> the_lights, std::shared_ptr<SurfaceFilm> the_surfaces = {});
  RenderWorld(const RenderWorld&) = delete;
  RenderWorld& operator=(const RenderWorld&) = delete;

  const Settings settings;
  const std::shared_ptr<const Scene> scene;
  const std::shared_ptr<const Accel> accel;
  const std::shared_ptr<const LightSet> lights;
  const PixelFilter filter;
  const std::unique_ptr<LearnedLightStage> learning;  // null unless needed; changes between frames
  const std::unique_ptr<GuidingStage> guiding;        // the same
  const std::shared_ptr<SurfaceFilm> surfaces;        // null unless asked for
  const PathContext paths;
  const std::unique_ptr<FrameSequences> sequences;  // changes between frames
  const FrameContext context;                       // refers to the above
};

}  // namespace cistern
