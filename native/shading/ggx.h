#pragma once

#include "base/angle.h"
#include "base/warp.h"

namespace cistern {

// The GGX distribution of microfacet normals, in the local frame of the macrosurface (z = normal).
// [Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces]
// [Heitz 2014, Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs]

struct GgxAlpha {
  float x, y;
};

/// Density of normals per solid angle times 1 / cos: integrates to 1 against cos. Written with the squared sine of h so
/// that it stays exact for nearly smooth surfaces, where 1 - cos^2 cancels.
inline float ggx_normal_density(GgxAlpha alpha, Vec3 h) {
  const float tx = h.x / alpha.x, ty = h.y / alpha.y;
  const float e = tx * tx + ty * ty + h.z * h.z;
  return kInvPi / (alpha.x * alpha.y * e * e);
}

/// Smith's Lambda; (1 + Lambda(a))^-1 is the masking of one direction, (1 + Lambda(a) + Lambda(b))^-1 of two with
/// height-correlated shadowing.
inline float ggx_lambda(GgxAlpha alpha, Vec3 w) {
  const float tan_squared = (sqr(alpha.x * w.x) + sqr(alpha.y * w.y)) / (w.z * w.z);
  return 0.5f * (std::sqrt(1.0f + tan_squared) - 1.0f);
}

/// A normal visible from `w` (w.z > 0), density D(h) max(0, w.h) / (w.z (1 + Lambda(w))) per solid angle of h.
/// [Dupuy and Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps]
inline Vec3 sample_ggx_visible_normal(GgxAlpha alpha, Vec3 w, Vec2 u) {
  const Vec3 stretched = normalize({alpha.x * w.x, alpha.y * w.y, w.z});
  const SineCosine azimuth = sine_cosine_of_turns(u.x);
  const float z = 1.0f - u.y * (1.0f + stretched.z);
  const float radius = safe_sqrt(1.0f - z * z);
  const Vec3 h = Vec3{radius * azimuth.cosine, radius * azimuth.sine, z} + stretched;
  return normalize({alpha.x * h.x, alpha.y * h.y, std::max(h.z, 0.0f)});
}

}  // namespace cistern
