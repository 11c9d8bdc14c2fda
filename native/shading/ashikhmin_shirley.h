#pragma once

#include <cmath>

#include "base/angle.h"
#include "base/warp.h"
#include "shading/ggx.h"

namespace cistern {

// Half vectors around the normal as powers of their cosine, in the local frame of the macrosurface (z = normal).
// [Ashikhmin and Shirley 2000, An Anisotropic Phong BRDF Model, eqs. 4, 6 and 9]

/// The exponent of a Blinn-Phong lobe about as wide. [Walter et al. 2007, sec. 5.2]
inline float phong_exponent(float alpha) { return std::max(2.0f / sqr(alpha) - 2.0f, 0.0f); }

/// Per solid angle of h; not one of microfacets, which would integrate to 1 over their projected area.
inline float ashikhmin_shirley_density(GgxAlpha alpha, Vec3 h) {
  const float x = phong_exponent(alpha.x), y = phong_exponent(alpha.y);
  const float sin2 = std::min(sqr(h.x) + sqr(h.y), 1.0f);
  const float exponent = sin2 > 0.0f ? (x * sqr(h.x) + y * sqr(h.y)) / sin2 : 0.0f;
  // By the sine: next to 1, single precision has no cosines for sharp lobes.
  return 0.5f * kInvPi * std::sqrt((x + 1.0f) * (y + 1.0f)) * std::exp(0.5f * exponent * std::log1p(-sin2));
}

inline Vec3 sample_ashikhmin_shirley(GgxAlpha alpha, Vec2 u) {
  const float x = phong_exponent(alpha.x), y = phong_exponent(alpha.y);
  const SineCosine turn = sine_cosine_of_turns(u.x);
  const Vec2 azimuth{turn.cosine * std::sqrt(y + 1.0f), turn.sine * std::sqrt(x + 1.0f)};
  const float scale = 1.0f / std::sqrt(sqr(azimuth.x) + sqr(azimuth.y));
  const float cosine = azimuth.x * scale, sine = azimuth.y * scale;
  const float log_z = std::log1p(-u.y) / (x * sqr(cosine) + y * sqr(sine) + 1.0f);
  const float r = std::sqrt(-std::expm1(2.0f * log_z));
  return {r * cosine, r * sine, std::exp(log_z)};
}

}  // namespace cistern
