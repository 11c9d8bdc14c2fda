#pragma once

#include "film/film.h"
#include "render/shared_pixels.h"

namespace cistern {

/// Frames of CELL_SHARED where each is independent of all others and nothing else looks beyond a pixel. They are made a
/// band of rows at a time, so that what pixels hand each other takes as much memory for a large picture as for a small
/// one. Borders between bands move from frame to frame.
class BandedFrame {
 public:
  /// `settings` stand for those of `context`, and may share at other vertices.
  BandedFrame(const FrameContext& context, const Settings& settings);

  /// Whether these settings want such frames.
  static bool is_for(const Settings& settings);

  /// Adds a frame to what the film has not finished; bands that are not reached when stopped early miss it. True if it
  /// was finished.
  bool render(uint32_t frame, Film& film, const StopCondition& stop);
  size_t memory_bytes() const { return band_.memory_bytes(); }

 private:
  PixelBlocks unfinished(int first_row, int end_row, const Film& film) const;
  void add_band(const PixelBlocks& pixels, uint32_t frame, Film& film);

  const Settings settings_;
  const FrameContext context_;
  int rows_;  // of a band
  SharedPixels band_;
};

}  // namespace cistern
