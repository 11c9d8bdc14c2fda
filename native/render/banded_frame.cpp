#include "render/banded_frame.h"

#include "base/parallel.h"

namespace cistern {
namespace {

/// Of a band, about: enough for full groups in cells of any size, few enough for 190 MB.
constexpr int kBandPixels = 1 << 17;
constexpr uint32_t kBandStream = 0x62616e64;
/// Pixels beside each other that are left out together once they are finished, like blocks of PictureNoise.
constexpr int kRun = 8;

}  // namespace

BandedFrame::BandedFrame(const FrameContext& context, const Settings& settings)
    : settings_(settings),
      context_{settings_,        context.paths,   context.filter,  context.sequences,
               context.learning, context.guiding, context.surfaces},
      band_(context_) {
  const Region& region = settings.region;
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
  const int height = s.region.height;
  Rng rng(s.seed, 0, frame, kBandStream);
  const bool is_divided = rows_ < height;
  const int first_rows = is_divided ? 1 + static_cast<int>(rng.next_float() * static_cast<float>(rows_)) : rows_;
  for (int begin = 0, end = std::min(first_rows, rows_); begin < height;
       begin = end, end = std::min(end + rows_, height)) {
    const PixelBlocks pixels = unfinished(begin, end, film);
    if (pixels.places.empty()) continue;
    if (!band_.render(pixels, frame, stop, &film)) return false;
    add_band(pixels, frame, film);
  }
  return true;
}

/// A band, or where most of its pixels are finished short runs of the others, in the same order: finished ones take up
/// to a sixth of the time of others.
PixelBlocks BandedFrame::unfinished(int first_row, int end_row, const Film& film) const {
  const int width = film.width();
  PixelBlocks runs{kRun, 1, 1, {}};
  for (int y = first_row; y < end_row; ++y) {
    for (int x = 0; x < width; x += kRun) {
      const auto first = static_cast<uint32_t>(y * width + x), end = first + std::min(kRun, width - x);
      bool is_left = false;
      for (uint32_t pixel = first; pixel < end && !is_left; ++pixel) is_left = !film.is_finished(pixel);
      if (is_left) runs.places.push_back({x, y});
    }
  }
  const PixelBlocks band = PixelBlocks::band(width, first_row, end_row);
  return 2 * runs.size() < band.size() ? runs : band;
}

/// To the film, and to what trials observe.
void BandedFrame::add_band(const PixelBlocks& pixels, uint32_t frame, Film& film) {
  constexpr size_t kBlock = 4096;
  parallel_blocks(pixels.size(), kBlock, [&](size_t, size_t begin, size_t end) {
    LightByGroup by_group;
    for (size_t i = begin; i < end; ++i) {
      const auto pixel = static_cast<uint32_t>(i);
      const auto [x, y] = pixels.place(static_cast<int>(i) % pixels.width(), static_cast<int>(i) / pixels.width());
      if (!SharedPixels::is_sampled({x, y}, film)) continue;
      const auto film_pixel = static_cast<uint32_t>(y * film.width() + x);
      if (band_.splits()) {
        LightByKind by_kind;
        const PathRecord record = band_.record(pixel, by_kind, by_group);
        add_to_film(context_, x, y, frame, record, film, band_.splits_kinds() ? &by_kind : nullptr, by_group);
      } else {
        add_to_film(context_, x, y, frame, band_.record(pixel), film);
      }
      const Rgb others(static_cast<float>(band_.reuse_count(pixel)));
      film.show(Pass::REUSE_COUNT, film_pixel, others);
    }
  });
}

}  // namespace cistern
