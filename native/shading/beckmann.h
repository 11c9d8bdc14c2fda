#pragma once

#include <cmath>

#include "base/angle.h"
#include "base/warp.h"
#include "shading/ggx.h"

namespace cistern {

// The Beckmann distribution of microfacet normals, in the local frame of the macrosurface (z = normal): slopes are
// normally distributed, with none of GGX's long tail. [Walter et al. 2007; Heitz 2014] as in ggx.h

/// Of erf, for -1 < x < 1. [Giles 2012, Approximating the erfinv Function]
inline float inverse_erf(float x) {
  float w = -std::log((1.0f - x) * (1.0f + x));
  float sum;
  if (w < 5.0f) {
    w -= 2.5f;
    sum = 2.81022636e-08f;
    for (const float c : {3.43273939e-07f, -3.5233877e-06f, -4.39150654e-06f, 0.00021858087f, -0.00125372503f,
                          -0.00417768164f, 0.246640727f, 1.50140941f})
      sum = c + sum * w;
  } else {
    w = std::sqrt(w) - 3.0f;
    sum = -0.000200214257f;
    for (const float c : {0.000100950558f, 0.00134934322f, -0.00367342844f, 0.00573950773f, -0.0076224613f,
                          0.00943887047f, 1.00167406f, 2.83297682f})
      sum = c + sum * w;
  }
  return sum * x;
}

inline float beckmann_normal_density(GgxAlpha alpha, Vec3 h) {
  const float cos2 = h.z * h.z;
  if (!(cos2 > 1e-12f)) return 0.0f;  // it vanishes long before
  const float exponent = (sqr(h.x / alpha.x) + sqr(h.y / alpha.y)) / cos2;
  return std::exp(-exponent) * kInvPi / (alpha.x * alpha.y * cos2 * cos2);
}

inline float beckmann_lambda(GgxAlpha alpha, Vec3 w) {
  const float spread = std::sqrt(sqr(alpha.x * w.x) + sqr(alpha.y * w.y));
  if (spread <= 0.0f) return 0.0f;
  const float a = std::abs(w.z) / spread;
  constexpr float kInvSqrtPi = 0.564189584f;
  return std::max(0.5f * (std::erf(a) - 1.0f + std::exp(-a * a) * kInvSqrtPi / a), 0.0f);
}

/// Slope along w's azimuth of a facet that w sees, of a surface of roughness 1; `cot`: of the angle to the normal. The
/// distribution is (1 + erf(x) + e^(-x^2) tan / sqrt(pi)), over its value at x = cot, and is inverted in erf(x) by
/// Newton's steps, each within what is left of a bracket.
/// [Jakob 2014, An Improved Visible Normal Sampling Routine for the Beckmann Distribution]
inline float sample_beckmann_visible_slope(float cot, float u) {
  constexpr float kInvSqrtPi = 0.564189584f, kAccuracy = 1e-6f;
  constexpr int kMostSteps = 24;
  const float tan = 1.0f / cot, last = std::erf(cot);
  const float scale = 1.0f / (1.0f + last + kInvSqrtPi * tan * std::exp(-cot * cot));
  float low = -1.0f, high = last, e = std::lerp(low, high, u);
  float slope = 0.0f;
  for (int i = 0; i < kMostSteps; ++i) {
    if (!(e > low && e < high)) e = 0.5f * (low + high);
    slope = inverse_erf(std::clamp(e, -0.9999999f, 0.9999999f));
    const float apart = scale * (1.0f + e + kInvSqrtPi * tan * std::exp(-slope * slope)) - u;
    if (std::abs(apart) < kAccuracy) break;
    (apart > 0.0f ? high : low) = e;
    e -= apart / (scale * (1.0f - slope * tan));
  }
  return slope;
}

/// A normal visible from `w` (w.z > 0), density D(h) max(0, w.h) / (w.z (1 + Lambda(w))) per solid angle of h.
inline Vec3 sample_beckmann_visible_normal(GgxAlpha alpha, Vec3 w, Vec2 u) {
  const Vec3 stretched{alpha.x * w.x, alpha.y * w.y, w.z};
  const float across = std::sqrt(sqr(stretched.x) + sqr(stretched.y));
  float x, y, cosine = 1.0f, sine = 0.0f;
  if (across < 1e-4f * w.z) {  // head-on: no direction to lean to
    const float r = std::sqrt(-std::log1p(-std::min(u.x, kOneMinusEpsilon)));
    const SineCosine azimuth = sine_cosine_of_turns(u.y);
    x = r * azimuth.cosine, y = r * azimuth.sine;
  } else {
    x = sample_beckmann_visible_slope(w.z / across, std::clamp(u.x, 1e-6f, 1.0f - 1e-6f));
    y = inverse_erf(std::clamp(2.0f * u.y - 1.0f, -0.9999999f, 0.9999999f));
    cosine = stretched.x / across, sine = stretched.y / across;
  }
  return normalize({-alpha.x * (cosine * x - sine * y), -alpha.y * (sine * x + cosine * y), 1.0f});
}

}  // namespace cistern
