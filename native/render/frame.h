#pragma once

#include "film/surface_film.h"
#include "render/frame_sequences.h"
#include "render/guiding_stage.h"
#include "render/learned_light_stage.h"
#include "render/tiles.h"

namespace cistern {

/// Everything that stays the same over the frames of a render.
struct FrameContext {
  const Settings& settings;
  const PathContext& paths;
  const PixelFilter& filter;
  FrameSequences& sequences;
  LearnedLightStage* learning = nullptr;  // where paths leave records of light; null: nowhere
  GuidingStage* guiding = nullptr;        // where they leave records of directions; null: nowhere
  SurfaceFilm* surfaces = nullptr;        // what keeps the surfaces that camera rays meet; null: nothing does
};

/// A pixel of the region by its number in the full frame: pictures of a part equal that part of the whole.
uint32_t full_frame_pixel(const Settings& settings, int x, int y);

/// The camera ray of a pixel's sample in a frame; takes the filter and lens dimensions of its sampler. What it meets is
/// left in the scratch where that is known.
Ray sample_camera_ray(const FrameContext& context, int x, int y, PathSampler& sampler, PathScratch& scratch);
/// The same of another camera.
Ray sample_camera_ray(const FrameContext& context, const Camera& camera, int x, int y, PathSampler& sampler,
                      PathScratch& scratch);

/// Before frames that are alike: tells what their random numbers depend on. `frame` is the first one's place in the
/// render, `number` its own.
void begin_frames(const FrameContext& context, uint32_t frame, uint32_t number);
/// Traces the path of a pixel's sample in a frame, which leaves records in the scratch where something learns from it;
/// `capture` as trace_path has it.
PathRecord trace_pixel(const FrameContext& context, int x, int y, uint32_t frame, PathScratch& scratch,
                       PathCapture* capture = nullptr);
/// Keeps what the path of a pixel just traced has met, where anything does; from any thread.
void keep_seen(const FrameContext& context, int x, int y, const PathScratch& scratch);
/// Hands the records over, from any thread.
void collect_records(const FrameContext& context, const PathScratch& scratch);
/// A pixel's share of a frame, once that is known; from any thread. `by_kind` where paths split kinds, else null;
/// `by_group` where they split light groups, else empty.
void add_to_film(const FrameContext& context, int x, int y, uint32_t frame, const PathRecord& record, Film& film,
                 const LightByKind* by_kind = nullptr, std::span<const Rgb> by_group = {});

/// Adds frames [first_frame, first_frame + count) of paths that share nothing to the film, of which at most the choice
/// of lights and directions is learned: then all with the same tables; but none to finished pixels. The picture does
/// not depend on the number of threads. Pixels may have different sample counts after an early return, which the film
/// knows. True if all frames were finished.
bool render_frames(const FrameContext& context, uint32_t first_frame, uint32_t count, Film& film,
                   const StopCondition& stop);

}  // namespace cistern
