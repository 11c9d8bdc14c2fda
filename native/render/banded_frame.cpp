#include "render/banded_frame.h"

#include "base/parallel.h"

namespace cistern {
namespace {

/// Of a band, about: enough for full groups in cells of any size, few enough for 190 MB.
constexpr int kBandPixels = 1 << 17;
constexpr uint32_t kBandStream = 0x62616e64;

}  // namespace

BandedFrame::BandedFrame(const FrameContext& context) : context_(context), sharing_(context), trial_(context.settings) {
  const Region& region = context.settings.region;
  const int most_rows = std::max(kBandPixels / region.width, 1);
  const int bands = (region.height + most_rows - 1) / most_rows;
  rows_ = (region.height + bands - 1) / bands;
}

bool BandedFrame::is_for(const Settings& s) {
  return s.indirect == IndirectAnswer::CELL_SHARED && !s.path_sharing.temporal_reuse && !uses_reservoirs(s.direct) &&
         !uses_reservoirs(s.secondary);
}

bool BandedFrame::render(uint32_t frame, Film& film, const StopCondition& stop) {
  const Settings& s = context_.settings;
  const Region& all = s.region;
  Rng rng(s.seed, 0, frame, kBandStream);
  const bool is_divided = rows_ < all.height;
  const int first_rows = is_divided ? 1 + static_cast<int>(rng.next_float() * static_cast<float>(rows_)) : rows_;
  for (int begin = 0, end = std::min(first_rows, rows_); begin < all.height;
       begin = end, end = std::min(end + rows_, all.height)) {
    if (!render_band({all.x, all.y + begin, all.width, end - begin}, frame, film, stop)) return false;
  }
  trial_.finish_frame(frame);
  return true;
}

bool BandedFrame::render_band(const Region& band, uint32_t frame, Film& film, const StopCondition& stop) {
  sharing_.set_region(band);
  const size_t pixels = static_cast<size_t>(band.width) * static_cast<size_t>(band.height);
  records_.resize(pixels);
  visible_points_.resize(pixels);
  if (!trace_paths(band, frame, stop)) return false;
  if (trial_.shares(frame) && !sharing_.share(frame, stop)) return false;
  finish(band, frame, film);
  return true;
}

bool BandedFrame::trace_paths(const Region& band, uint32_t frame, const StopCondition& stop) {
  struct Scratch {
    PathScratch path;
    PathCapture capture;
  };
  const int first_row = band.y - context_.settings.region.y;
  const bool shares = trial_.shares(frame), is_decided = trial_.is_decided(frame);
  const auto trace = [&](int x, int y, Scratch& scratch) {
    const auto pixel = static_cast<uint32_t>(y * band.width + x);
    if (!shares) {
      records_[pixel] = trace_pixel(context_, x, first_row + y, frame, scratch.path, nullptr, is_decided);
      visible_points_[pixel].exists = false;
      return;
    }
    sharing_.ask(scratch.capture, full_frame_pixel(context_.settings, x, first_row + y), frame);
    records_[pixel] = trace_pixel(context_, x, first_row + y, frame, scratch.path, &scratch.capture, is_decided);
    visible_points_[pixel] = scratch.capture.visible;
    sharing_.start_pixel(scratch.capture, pixel);
  };
  return for_each_pixel<Scratch>(band.width, band.height, stop, trace,
                                 [&](const Scratch& scratch) { collect_records(context_, scratch.path); });
}

/// Adds to the film, and to what trials observe.
void BandedFrame::finish(const Region& band, uint32_t frame, Film& film) {
  constexpr size_t kBlock = 4096;
  const float limit = context_.paths.limits.clamp_indirect;
  const int first_row = band.y - context_.settings.region.y;
  parallel_blocks(records_.size(), kBlock, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto pixel = static_cast<uint32_t>(i);
      const int x = static_cast<int>(i) % band.width, y = first_row + static_cast<int>(i) / band.width;
      PathRecord& r = records_[i];
      if (visible_points_[i].exists) sharing_.add_to(visible_points_[i], pixel, limit, r);
      add_to_film(context_, x, y, frame, r, film);
      const uint32_t others = visible_points_[i].exists ? sharing_.reuse_count(pixel) : 0;
      film.show(Pass::REUSE_COUNT, static_cast<uint32_t>(y * band.width + x), Rgb(static_cast<float>(others)));
      if (trial_.is_running(frame)) trial_.add(x, y, luminance(r.direct + r.indirect + r.emission + r.environment));
    }
  });
}

size_t BandedFrame::memory_bytes() const {
  return sharing_.memory_bytes() + records_.capacity() * sizeof(PathRecord) +
         visible_points_.capacity() * sizeof(VisiblePoint);
}

}  // namespace cistern
