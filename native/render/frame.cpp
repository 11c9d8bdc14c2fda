#include "render/frame.h"

#include "render/training_paths.h"
#include "transport/camera_ray.h"
#include "transport/sheet_ray.h"

namespace cistern {

uint32_t full_frame_pixel(const Settings& s, int x, int y) {
  const uint32_t row = static_cast<uint32_t>(s.region.y + y) * static_cast<uint32_t>(s.width);  // below 2^32
  return row + static_cast<uint32_t>(s.region.x + x);
}

Ray sample_camera_ray(const FrameContext& context, int x, int y, PathSampler& sampler, PathScratch& scratch) {
  return sample_camera_ray(context, context.paths.scene.camera, x, y, sampler, scratch);
}

Ray sample_camera_ray(const FrameContext& context, const Camera& camera, int x, int y, PathSampler& sampler,
                      PathScratch& scratch) {
  const Settings& s = context.settings;
  const Vec2 offset = context.filter.sample(sampler.filter());
  if (camera.type == CameraType::SHEET) {
    const std::optional<SheetRay> onto = sheet_ray(context.paths.scene, full_frame_pixel(s, x, y), offset);
    if (!onto) return kSeesNothing;
    scratch.known_hit = onto->hit;
    return onto->ray;
  }
  const Vec2 film_position{(static_cast<float>(s.region.x + x) + 0.5f + offset.x) / static_cast<float>(s.width),
                           (static_cast<float>(s.region.y + y) + 0.5f + offset.y) / static_cast<float>(s.height)};
  const Vec2 u_lens = camera.aperture_radius > 0.0f ? sampler.lens() : Vec2{};
  return camera_ray(camera, film_position, u_lens);
}

void begin_frames(const FrameContext& context, uint32_t frame, uint32_t number) {
  FrameSequences::Kind kind;
  auto end = static_cast<uint32_t>(context.settings.samples);
  if (const LearnedLightStage* learning = context.learning) {
    kind.lights_learned_at = learning->learned_at();
    if (!learning->has_learned()) end = std::min(end, frame + frames_to_next_update(frame));
  }
  uint32_t length = end - frame;
  if (const GuidingStage* guiding = context.guiding) {
    kind.guides_learned_at = guiding->guided_since();
    kind.is_decided = guiding->is_decided(frame);
    length = guiding->frames_of_kind(frame, end);
  }
  context.sequences.begin(number, kind, length);
}

PathRecord trace_pixel(const FrameContext& context, int x, int y, uint32_t frame, PathScratch& scratch,
                       PathCapture* capture) {
  const Settings& s = context.settings;
  const uint32_t pixel = full_frame_pixel(s, x, y);
  const SequencePoint point =
      context.sequences.point(static_cast<uint32_t>(s.region.x + x), static_cast<uint32_t>(s.region.y + y), frame);
  PathSampler sampler(s.seed, pixel, frame, s.sequence, point);
  const Ray ray = sample_camera_ray(context, x, y, sampler, scratch);
  scratch.trains_lights = context.learning && context.learning->trains(pixel, frame);
  scratch.trains_guide = context.guiding && context.guiding->trains(pixel, frame);
  return trace_path(context.paths, ray, sampler, scratch, capture);
}

void keep_seen(const FrameContext& context, int x, int y, const PathScratch& scratch) {
  if (!context.surfaces) return;
  const auto pixel = static_cast<uint32_t>(y * context.surfaces->width() + x);
  context.surfaces->add(pixel, context.paths.scene, scratch.seen_surfaces, &context.paths.accel);
}

void collect_records(const FrameContext& context, const PathScratch& scratch) {
  if (context.learning) context.learning->add(scratch.light_records);
  if (context.guiding) context.guiding->add(scratch.guide_records);
}

void add_to_film(const FrameContext& context, int x, int y, uint32_t frame, const PathRecord& record, Film& film,
                 const LightByKind* by_kind, std::span<const Rgb> by_group) {
  film.add(static_cast<uint32_t>(y * film.width() + x), record, by_kind, by_group);
  if (!context.guiding || !context.guiding->observes(frame)) return;
  context.guiding->observe(x, y, luminance(record.direct + record.indirect + record.emission + record.environment));
}

bool render_frames(const FrameContext& context, uint32_t first_frame, uint32_t count, Film& film,
                   const StopCondition& stop) {
  const bool splits_kinds = context.paths.splits_kinds;
  const auto render_pixel = [&](int x, int y, PathScratch& scratch) {
    if (film.is_finished(static_cast<uint32_t>(y * film.width() + x))) return;
    for (uint32_t frame = first_frame; frame < first_frame + count; ++frame) {
      const PathRecord record = trace_pixel(context, x, y, frame, scratch);
      add_to_film(context, x, y, frame, record, film, splits_kinds ? &scratch.light_by_kind : nullptr,
                  scratch.light_by_group);
      keep_seen(context, x, y, scratch);
    }
  };
  const auto finish_tile = [&](const PathScratch& scratch) { collect_records(context, scratch); };
  return for_each_pixel<PathScratch>(film.width(), film.height(), stop, render_pixel, finish_tile);
}

}  // namespace cistern
