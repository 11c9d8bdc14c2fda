#pragma once

#include "render/cell_shared_stage.h"
#include "render/pixel_blocks.h"

namespace cistern {

/// Some pixels of a frame of CELL_SHARED without history: their paths, and the sharing between them.
class SharedPixels {
 public:
  explicit SharedPixels(const FrameContext& context) : context_(context), sharing_(context) {}

  /// Whether `film` has this pixel, and has not finished it.
  static bool is_sampled(PixelBlocks::Pixel place, const Film& film) {
    return place.x < film.width() && !film.is_finished(static_cast<uint32_t>(place.y * film.width() + place.x));
  }

  /// Makes a sample of each, but of those that `film`, if there is one, has finished or not got. False if stopped.
  bool render(const PixelBlocks& pixels, uint32_t frame, const StopCondition& stop, const Film* film = nullptr);

  /// Of the sample of a pixel, by its number in the small picture: what it found and was handed, and by how many
  /// others.
  PathRecord record(uint32_t pixel) const { return record(pixel, nullptr, {}); }
  /// The same with what it is by kinds of scattering and by light groups; for contexts that split it.
  PathRecord record(uint32_t pixel, LightByKind& by_kind, LightByGroup& by_group) const;
  bool splits() const { return context_.paths.splits(); }
  bool splits_kinds() const { return context_.paths.splits_kinds; }
  uint32_t reuse_count(uint32_t pixel) const;

  size_t memory_bytes() const;

 private:
  PathRecord record(uint32_t pixel, PixelLight* by_kind, std::span<Rgb> by_group) const;

  const FrameContext& context_;
  CellSharedStage sharing_;
  LazyVector<PathRecord> records_;  // by pixel
  PixelKinds kinds_;
  GroupTable groups_;
};

}  // namespace cistern
