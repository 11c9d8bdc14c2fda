#pragma once

#include <array>
#include <cstdint>

#include "base/vec.h"

namespace cistern {

enum class FilterKind : uint8_t { BOX, GAUSSIAN, BLACKMAN_HARRIS };

/// Filter importance sampling [Ernst et al. 2006]: one camera ray per sample, its position in the pixel drawn with the
/// density of the reconstruction filter, all with equal weight. `width` is the filter's full width in pixels (a box of
/// width 1 is the pixel).
class PixelFilter {
 public:
  PixelFilter(FilterKind kind, float width);
  /// Offset from the pixel's centre, in pixels.
  Vec2 sample(Vec2 u) const { return {sample_axis(u.x), sample_axis(u.y)}; }

 private:
  float sample_axis(float u) const;

  static constexpr int kTableSize = 1024;
  /// Distance from the centre that is exceeded with probability s^2, at s = i / kTableSize: dense where the filter's
  /// thin tails are, which steps of equal probability would smear.
  std::array<float, kTableSize + 1> distance_{};
};

}  // namespace cistern
