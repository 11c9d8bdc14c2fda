#pragma once

#include "base/warp.h"
#include "shading/bsdf.h"

namespace cistern {

/// Value times |cos(theta_i)|, and density per solid angle, of one lobe. Zero density where it cannot be sampled.
struct LobeEvaluation {
  Rgb f_cos;
  float pdf = 0.0f;
  float even_cos = 0.0f;  // of a Lambert lobe in its place, where the lobe is diffuse
};

// Lambert: f = 1 / pi on the side of n. Density: cosine.
inline LobeEvaluation evaluate_lobe(const LambertLobe& lobe, Vec3, Vec3 wi) {
  const float value = std::max(dot(lobe.n, wi), 0.0f) * kInvPi;
  return {Rgb(value), value};
}
inline std::optional<Vec3> sample_lobe(const LambertLobe& lobe, Vec3, float, Vec2 u) {
  return Frame(lobe.n).to_world(square_to_cosine_hemisphere(u));
}

// Translucent: f = 1 / pi on the other side. Density: cosine.
inline LobeEvaluation evaluate_lobe(const TranslucentLobe& lobe, Vec3, Vec3 wi) {
  const float value = std::max(-dot(lobe.n, wi), 0.0f) * kInvPi;
  return {Rgb(value), value};
}
inline std::optional<Vec3> sample_lobe(const TranslucentLobe& lobe, Vec3, float, Vec2 u) {
  return Frame(-lobe.n).to_world(square_to_cosine_hemisphere(u));
}

/// Oren-Nayar in Fujii's form, with the light that bounces more than once between facets of that `color` added back.
/// [Fujii 2012, A tiny improvement of Oren-Nayar reflectance model], [OpenPBR 1.1, diffuse reflection]. `roughness` in
/// [0, 1]. The lobe's weight holds the colour of the first bounce. `is_dim`: further bounces are coloured once too
/// often, as in Cycles before 5.3. Density: cosine.
OrenNayarLobe make_oren_nayar(Vec3 n, Vec3 wo, float roughness, Rgb color, bool is_dim = false);
LobeEvaluation evaluate_lobe(const OrenNayarLobe& lobe, Vec3 wo, Vec3 wi);
inline std::optional<Vec3> sample_lobe(const OrenNayarLobe& lobe, Vec3, float, Vec2 u) {
  return Frame(lobe.n).to_world(square_to_cosine_hemisphere(u));
}

/// `v` on the other side of the surface.
inline Vec3 mirrored(Vec3 v, Vec3 n) { return v - 2.0f * dot(v, n) * n; }

// Rough translucent: f(wo, wi) of Oren and Nayar's for the mirrored wi. Density: cosine.
inline LobeEvaluation evaluate_lobe(const RoughTranslucentLobe& lobe, Vec3 wo, Vec3 wi) {
  return evaluate_lobe(static_cast<const OrenNayarLobe&>(lobe), wo, mirrored(wi, lobe.n));
}
inline std::optional<Vec3> sample_lobe(const RoughTranslucentLobe& lobe, Vec3, float, Vec2 u) {
  return Frame(-lobe.n).to_world(square_to_cosine_hemisphere(u));
}

}  // namespace cistern
