#pragma once

#include <bit>

#include "base/vec.h"

namespace cistern {

/// Origin moved off the surface along the unit geometric normal to the side of `direction`, so that a ray from it does
/// not hit that surface again: by 256 units in the last place, near the origin by a fixed distance. [Wächter and Binder
/// 2019, A Fast and Robust Method for Avoiding Self-Intersection]
inline Vec3 offset_origin(Vec3 position, Vec3 geometric_normal, Vec3 direction) {
  constexpr float kUlpsPerUnitNormal = 256.0f, kNearOrigin = 1.0f / 32.0f, kOffsetNearOrigin = 1.0f / 65536.0f;
  const auto offset = [](float p, float n) {
    const int32_t ulps = static_cast<int32_t>(kUlpsPerUnitNormal * n);
    const float far = std::bit_cast<float>(std::bit_cast<int32_t>(p) + (p < 0.0f ? -ulps : ulps));
    return std::abs(p) < kNearOrigin ? p + kOffsetNearOrigin * n : far;
  };
  const Vec3 n = dot(geometric_normal, direction) < 0.0f ? -geometric_normal : geometric_normal;
  return {offset(position.x, n.x), offset(position.y, n.y), offset(position.z, n.z)};
}

}  // namespace cistern
