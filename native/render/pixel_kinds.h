#pragma once

#include "base/lazy_vector.h"
#include "transport/path_tracer.h"

namespace cistern {

/// Light of a pixel by kinds of scattering, while stages add to it what the path left to them.
struct PixelLight {
  LightByKind light;
  KindColors seen_shares;  // see PathCapture
};

/// Of all pixels; no memory, and null for each, where paths do not split kinds.
class PixelKinds {
 public:
  void resize(const PathContext& context, size_t pixels) {
    if (context.splits_kinds) pixels_.resize(pixels);
  }
  void start_pixel(uint32_t pixel, const PathScratch& scratch, const PathCapture& capture) {
    if (!pixels_.empty()) pixels_[pixel] = {scratch.light_by_kind, capture.seen_shares};
  }
  PixelLight* of(uint32_t pixel) { return pixels_.empty() ? nullptr : &pixels_[pixel]; }
  const PixelLight* of(uint32_t pixel) const { return pixels_.empty() ? nullptr : &pixels_[pixel]; }
  size_t memory_bytes() const { return pixels_.capacity() * sizeof(PixelLight); }

 private:
  LazyVector<PixelLight> pixels_;
};

}  // namespace cistern
