#pragma once

#include <algorithm>
#include <cstdint>

#include "base/vec.h"

namespace cistern {

/// Number along the Z curve through the box, in 1024 steps along each axis; what is outside counts to its faces.
/// [Morton 1966, A Computer Oriented Geodetic Data Base]
inline uint32_t morton_code(Vec3 place, const Bounds3& box) {
  constexpr int kBits = 10;
  const auto spread = [](uint32_t v) {
    v = (v | v << 16) & 0x030000ffu;
    v = (v | v << 8) & 0x0300f00fu;
    v = (v | v << 4) & 0x030c30c3u;
    return (v | v << 2) & 0x09249249u;
  };
  uint32_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float extent = box.upper[axis] - box.lower[axis];
    const float along = extent > 0.0f ? std::clamp((place[axis] - box.lower[axis]) / extent, 0.0f, 1.0f) : 0.0f;
    const float cell = std::min(along * (1 << kBits), static_cast<float>((1 << kBits) - 1));
    code |= spread(static_cast<uint32_t>(cell)) << axis;
  }
  return code;
}

}  // namespace cistern
