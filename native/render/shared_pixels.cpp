#include "render/shared_pixels.h"

namespace cistern {

bool SharedPixels::render(const PixelBlocks& pixels, uint32_t frame, const StopCondition& stop, const Film* film) {
  struct Scratch {
    PathScratch path;
    PathCapture capture;
  };
  static const PathCapture kNothing;  // of a path that meets nothing
  const Region& all = context_.settings.region;
  const PixelBlocks::Pixel first = pixels.places.front();
  sharing_.set_region({all.x + first.x, all.y + first.y, pixels.width(), pixels.height()});
  records_.resize(pixels.size());
  kinds_.resize(context_.paths, pixels.size());
  groups_.resize(context_.paths, pixels.size());
  const auto trace = [&](int x, int y, Scratch& scratch) {
    const auto pixel = static_cast<uint32_t>(y * pixels.width() + x);
    const PixelBlocks::Pixel place = pixels.place(x, y);
    if (film && !is_sampled(place, *film)) {
      sharing_.start_pixel(kNothing, pixel);
      return;
    }
    sharing_.ask(scratch.capture, full_frame_pixel(context_.settings, place.x, place.y), frame);
    records_[pixel] = trace_pixel(context_, place.x, place.y, frame, scratch.path, &scratch.capture);
    keep_seen(context_, place.x, place.y, scratch.path);
    sharing_.start_pixel(scratch.capture, pixel);
    kinds_.start_pixel(pixel, scratch.path, scratch.capture);
    groups_.set(pixel, scratch.path.light_by_group);
  };
  const auto finish_tile = [&](const Scratch& scratch) { collect_records(context_, scratch.path); };
  return for_each_pixel<Scratch>(pixels.width(), pixels.height(), stop, trace, finish_tile) &&
         sharing_.share(frame, stop);
}

PathRecord SharedPixels::record(uint32_t pixel, PixelLight* by_kind, std::span<Rgb> by_group) const {
  PathRecord record = records_[pixel];
  const VisiblePoint& visible = sharing_.visible_point(pixel);
  if (visible.exists) sharing_.add_to(visible, pixel, context_.paths.limits.clamp_indirect, record, by_kind, by_group);
  return record;
}

PathRecord SharedPixels::record(uint32_t pixel, LightByKind& by_kind, LightByGroup& by_group) const {
  const std::span<const Rgb> groups = groups_.of(pixel);
  by_group.assign(groups.begin(), groups.end());
  if (!splits_kinds()) return record(pixel, nullptr, by_group);
  PixelLight light = *kinds_.of(pixel);
  const PathRecord result = record(pixel, &light, by_group);
  by_kind = light.light;
  return result;
}

uint32_t SharedPixels::reuse_count(uint32_t pixel) const {
  return sharing_.visible_point(pixel).exists ? sharing_.reuse_count(pixel) : 0;
}

size_t SharedPixels::memory_bytes() const {
  return sharing_.memory_bytes() + records_.capacity() * sizeof(PathRecord) + kinds_.memory_bytes() +
         groups_.memory_bytes();
}

}  // namespace cistern
