#include <bit>

#include "accel/accel.h"

namespace cistern {
namespace {

// The paper's constants: 256 units in the last place, or near the origin a fixed distance per unit of normal.
constexpr float kUlpsPerUnitNormal = 256.0f;
constexpr float kNearOrigin = 1.0f / 32.0f;
constexpr float kOffsetNearOrigin = 1.0f / 65536.0f;

float offset_component(float p, float n) {
  if (std::abs(p) < kNearOrigin) return p + kOffsetNearOrigin * n;
  const int32_t ulps = static_cast<int32_t>(kUlpsPerUnitNormal * n);
  return std::bit_cast<float>(std::bit_cast<int32_t>(p) + (p < 0.0f ? -ulps : ulps));
}

}  // namespace

Vec3 offset_origin(Vec3 position, Vec3 geometric_normal, Vec3 direction) {
  const Vec3 n = dot(geometric_normal, direction) < 0.0f ? -geometric_normal : geometric_normal;
  return {offset_component(position.x, n.x), offset_component(position.y, n.y), offset_component(position.z, n.z)};
}

}  // namespace cistern
