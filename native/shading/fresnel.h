#pragma once

#include "base/rgb.h"

namespace cistern {

// Fresnel reflectances. `eta` is the refractive index of the far side relative to the near one; cosines are against the
// microfacet normal, on the near side, in [0, 1].

/// Reflectance of a smooth surface seen head-on.
inline constexpr float f0_from_ior(float ior) { return sqr((ior - 1.0f) / (ior + 1.0f)); }
/// The index >= 1 with that reflectance; 0.99 is the largest that is told apart from a mirror.
inline float ior_from_f0(float f0) {
  const float root = std::sqrt(std::clamp(f0, 0.0f, 0.99f));
  return (1.0f + root) / (1.0f - root);
}

/// Unpolarised reflectance of a dielectric; 1 under total internal reflection. `cos_t` (if asked for) receives the
/// cosine of the refracted ray, positive, or 0 under total internal reflection.
inline float fresnel_dielectric(float cos_i, float eta, float* cos_t = nullptr) {
  const float scaled_cos_t_squared = eta * eta - 1.0f + cos_i * cos_i;
  if (scaled_cos_t_squared <= 0.0f) {
    if (cos_t) *cos_t = 0.0f;
    return 1.0f;
  }
  const float g = std::sqrt(scaled_cos_t_squared);  // eta cos_t
  if (cos_t) *cos_t = g / eta;
  const float s = (cos_i - g) / (cos_i + g);
  const float p = (eta * eta * cos_i - g) / (eta * eta * cos_i + g);
  return 0.5f * (s * s + p * p);
}

/// Where a reflectance of the dielectric of that index stands between its value head-on (0) and 1, (F - F0) / (1 - F0):
/// used to stretch the curve over F0 ... F90.
inline float fresnel_fraction(float reflectance, float ior) {
  return clamp01((reflectance * sqr(ior + 1.0f) - sqr(ior - 1.0f)) / (4.0f * ior));
}

/// Integral of 2 cos F(cos) over [0, 1] for a dielectric. [Kulla and Conty 2017, Revisiting Physically Based Shading at
/// Imageworks: fit, error below 0.007]
inline constexpr float fresnel_dielectric_average(float eta) {
  return eta < 1.0f ? 0.997118f + eta * (0.1014f - eta * (0.965241f + eta * 0.130607f))
                    : (eta - 1.0f) / (4.08567f + 1.00071f * eta);
}

// Metals: Schlick's curve less b cos (1 - cos)^6. [Hoffman 2019, Fresnel Equations Considered Harmful; Kutz et al.
// 2021, Novel Aspects of the Adobe Standard Material, §2.3]

/// b for a tint that multiplies Schlick's value at cos = 1/7, where the correction peaks.
inline Rgb f82_coefficient(Rgb f0, Rgb tint) {
  constexpr float k = 6.0f / 7.0f;
  constexpr float k5 = k * k * k * k * k;
  return lerp(f0, Rgb(1.0f), k5) * (7.0f / (k5 * k)) * (Rgb(1.0f) - tint);
}

/// b for that value at cos = 1/7.
inline constexpr float kF82Cosine = 1.0f / 7.0f;
inline Rgb f82_coefficient_through(Rgb f0, Rgb value) {
  constexpr float k = 1.0f - kF82Cosine;
  constexpr float k5 = k * k * k * k * k;
  return (lerp(f0, Rgb(1.0f), k5) - value) / (kF82Cosine * k5 * k);
}

inline Rgb fresnel_f82(float cos_i, Rgb f0, Rgb b) {
  const float m = clamp01(1.0f - cos_i);
  const float m5 = sqr(sqr(m)) * m;
  return max(Rgb(0.0f), min(Rgb(1.0f), lerp(f0, Rgb(1.0f), m5) - b * (cos_i * m5 * m)));
}

/// Integral of 2 cos F(cos) over [0, 1].
inline Rgb fresnel_f82_average(Rgb f0, Rgb b) { return lerp(f0, Rgb(1.0f), 1.0f / 21.0f) - b * (1.0f / 126.0f); }

}  // namespace cistern
