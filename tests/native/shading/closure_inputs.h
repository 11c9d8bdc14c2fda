#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "shading/bsdf_statistics.h"
#include "shading/closures.h"

// Closures by the operands of their instructions, and what tests ask of the scattering they add up to.

namespace cistern::test {

inline const Frame kFrame(kTestNormal);

inline SurfacePoint make_point(float cosine) {
  SurfacePoint point;
  point.ng = point.ns = kTestNormal;
  point.wo = at_angle(kFrame, cosine);
  return point;
}

// Operands of CLOSURE_PRINCIPLED in the order of scene/op_table.cpp, with Blender's defaults.
enum PrincipledInput {
  WEIGHT,
  BASE,
  METALLIC,
  ROUGHNESS,
  IOR,
  ALPHA,
  NORMAL,
  DIFFUSE_ROUGHNESS,
  SUBSURFACE,
  LEVEL,
  TINT,
  ANISOTROPIC,
  ROTATION,
  TANGENT,
  TRANSMISSION,
  COAT,
  COAT_ROUGHNESS,
  COAT_IOR,
  COAT_TINT,
  COAT_NORMAL,
  SHEEN,
  SHEEN_ROUGHNESS,
  SHEEN_TINT,
  EMISSION,
  STRENGTH,
  SUBSURFACE_RADIUS,
  SUBSURFACE_SCALE,
  SUBSURFACE_IOR,
  SUBSURFACE_ANISOTROPY,
  FILM,
  FILM_IOR,
  INVERSE_ABBE,
  PRINCIPLED_INPUTS
};
using Inputs = std::vector<Vec3>;

inline Vec3 grey(float v) { return {v, v, v}; }

inline Inputs principled() {
  Inputs in(PRINCIPLED_INPUTS);
  in[WEIGHT] = in[ALPHA] = in[BASE] = in[TINT] = in[COAT_TINT] = in[SHEEN_TINT] = in[EMISSION] = grey(1.0f);
  in[ROUGHNESS] = in[LEVEL] = in[SHEEN_ROUGHNESS] = grey(0.5f);
  in[IOR] = in[COAT_IOR] = grey(1.5f);
  in[SUBSURFACE_RADIUS] = in[SUBSURFACE_SCALE] = grey(1.0f);
  in[SUBSURFACE_IOR] = grey(1.4f);
  in[FILM_IOR] = grey(1.33f);
  in[COAT_ROUGHNESS] = grey(0.03f);
  in[NORMAL] = in[COAT_NORMAL] = kTestNormal;
  in[TANGENT] = kFrame.s;
  return in;
}

inline Bsdf build(Op op, const Inputs& inputs, const SurfacePoint& point, int32_t parameter = 1,
                  const GlossLimits& gloss = {}) {
  Bsdf bsdf;
  bsdf.gloss = gloss;
  bsdf.ng = point.ng;
  bsdf.wo = point.wo;
  const int32_t parameters[4] = {parameter, 0, 1, 0};
  add_closure(bsdf, op, inputs, parameters, point);
  return bsdf;
}

/// Directional albedo of the whole BSDF through its sampler: what a white furnace sees.
inline double furnace(const Bsdf& bsdf, int samples = 20000) {
  Moments moments;
  Rng rng(7, 0, 0, 0);
  for (int i = 0; i < samples; ++i) {
    const float u = rng.next_float();
    const std::optional<BsdfSample> sample = sample_bsdf(bsdf, u, rng.next_vec2());
    moments.add(sample ? average(sample->total_weight()) : 0.0);
  }
  return moments.mean();
}

inline void expect_density_of_samples(const Bsdf& bsdf) {
  const auto sampler = [&](Rng& rng) -> std::optional<Vec3> {
    const float u = rng.next_float();
    const std::optional<BsdfSample> sample = sample_bsdf(bsdf, u, rng.next_vec2());
    return sample && !sample->subsurface ? std::optional<Vec3>(sample->wi) : std::nullopt;
  };
  EXPECT_GT(sampler_p_value(
                kFrame, sampler, [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).pdf; }, 3),
            kFalseAlarmRate);
}

}  // namespace cistern::test
