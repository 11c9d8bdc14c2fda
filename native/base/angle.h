#pragma once

#include "base/vec.h"

// Angles and directions, inlined where samples and look-ups need them by the million: minimax polynomials, off by
// little more than rounding. Where single digits matter, take the C library's.

namespace cistern {

struct SineCosine {
  float sine, cosine;
};

/// Of an angle (radians) in [-pi/4, pi/4]; off by at most 1e-7.
inline SineCosine sine_cosine_near_zero(float angle) {
  const float x2 = angle * angle;
  return {angle * (1.0f + x2 * (-0.16666637f + x2 * (0.008331585f - x2 * 0.00019462116f))),
          1.0f + x2 * (-0.49999857f + x2 * (0.041655026f - x2 * 0.0013585908f))};
}

/// Of an angle in full turns, [-1, 1]; off by at most 2e-7.
inline SineCosine sine_cosine_of_turns(float turns) {
  const float quarters = 4.0f * turns, nearest = std::floor(quarters + 0.5f);
  const SineCosine rest = sine_cosine_near_zero((quarters - nearest) * (kPi / 2.0f));
  const int quadrant = static_cast<int>(nearest);
  const bool swaps = (quadrant & 1) != 0;
  const float sine = swaps ? rest.cosine : rest.sine, cosine = swaps ? rest.sine : rest.cosine;
  return {(quadrant & 2) != 0 ? -sine : sine, ((quadrant + 1) & 2) != 0 ? -cosine : cosine};
}

/// atan(y / x) in quarter turns, [0, 1], for x and y of at least 0; 0 where both are. Off by at most 3e-7.
inline float quarter_turns(float y, float x) {
  const float t = std::min(x, y) / std::max(std::max(x, y), 0x1p-126f), t2 = t * t;
  const float turns =
      t *
      (0.6366173f +
       t2 * (-0.21210495f +
             t2 * (0.12610047f + t2 * (-0.08424606f + t2 * (0.05068998f + t2 * (-0.02139309f + t2 * 0.004336515f))))));
  return y > x ? 1.0f - turns : turns;
}

/// atan2(y, x) in full turns, [-1/2, 1/2]; 0 or 1/2 where both are 0. Off by at most 2e-7.
inline float azimuth_turns(float y, float x) {
  const float quarters = quarter_turns(std::abs(y), std::abs(x));
  return std::copysign(0.25f * (x < 0.0f ? 2.0f - quarters : quarters), y);
}

/// asin(z) in half turns, [-1/2, 1/2], for z in [-1, 1]. Off by at most 2e-7, near the equator by less.
inline float elevation_half_turns(float z) {
  return std::copysign(0.5f * quarter_turns(std::abs(z), safe_sqrt((1.0f - std::abs(z)) * (1.0f + std::abs(z)))), z);
}

/// acos(z) in half turns, [0, 1], for z in [-1, 1]. Off by at most 2e-7, near the poles by less.
inline float inclination_half_turns(float z) {
  const float a = std::abs(z);
  const float angle =
      safe_sqrt(1.0f - a) *
      (1.5707961f +
       a * (-0.21458527f +
            a * (0.08875567f + a * (-0.048802614f + a * (0.026900101f + a * (-0.011146358f + a * 0.0022960133f))))));
  const float half_turns = angle * kInvPi;
  return z < 0.0f ? 1.0f - half_turns : half_turns;
}

}  // namespace cistern
