#include "shading/lobe_toon.h"

#include <gtest/gtest.h>

#include "shading/bsdf_statistics.h"

namespace cistern::test {
namespace {

const Frame kFrame(kTestNormal);
const double kThreshold = shared_rate(20);  // cases, which share kFalseAlarmRate

template <class Model>
double p_value(const Model& lobe, Vec3 wo, uint64_t seed, float planted_scale = 1.0f) {
  const auto sampler = [&](Rng& rng) { return sample_lobe(lobe, wo, 0.0f, rng.next_vec2()); };
  return sampler_p_value(
      kFrame, sampler, [&](Vec3 wi) { return planted_scale * evaluate_lobe(lobe, wo, wi).pdf; }, seed);
}

TEST(ToonLobe, SamplersFollowTheirDensity) {
  uint64_t seed = 1;
  for (const float cosine : {0.3f, 0.9f})
    for (const float size : {0.25f, 0.875f})  // hard edges between bins: quadrature within would not find them
      for (const float smooth : {0.0f, 0.4f}) {
        const Vec3 wo = at_angle(kFrame, cosine);
        const ToonCone cone = make_toon_cone(size, smooth);
        EXPECT_GT(p_value(ToonDiffuseLobe{kTestNormal, cone}, wo, ++seed), kThreshold) << size << " " << smooth;
        EXPECT_GT(p_value(ToonGlossyLobe{kTestNormal, cone}, wo, ++seed), kThreshold) << size << " " << smooth;
      }
  // Planted bug: the density of a cone 5 % larger.
  const Vec3 wo = at_angle(kFrame, 0.9f);
  EXPECT_LT(p_value(ToonDiffuseLobe{kTestNormal, make_toon_cone(0.25f, 0.0f)}, wo, 2, 0.95f), kThreshold);
}

/// Of the sphere; for `smooth` 0 all light but what the horizon takes is reflected.
TEST(ToonLobe, ReflectsNoMoreThanAll) {
  for (const float size : {0.2f, 0.6f, 1.0f})
    for (const float smooth : {0.0f, 0.3f, 1.0f})
      for (const float cosine : {0.2f, 1.0f}) {
        const Vec3 wo = at_angle(kFrame, cosine);
        const ToonDiffuseLobe diffuse{kTestNormal, make_toon_cone(size, smooth)};
        const ToonGlossyLobe glossy{kTestNormal, make_toon_cone(size, smooth)};
        const auto albedo = [&](const auto& lobe) {
          return integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_lobe(lobe, wo, wi).f_cos.g; });
        };
        EXPECT_LT(albedo(diffuse), 1.005);
        EXPECT_LT(albedo(glossy), 1.005);
        if (smooth == 0.0f || size == 1.0f) {  // beyond a right angle nothing fades
          EXPECT_GT(albedo(diffuse), 0.995);
        } else {
          EXPECT_LT(albedo(diffuse), 0.995);
        }
      }
}

TEST(ToonLobe, FadesEvenly) {
  const ToonDiffuseLobe lobe{kTestNormal, make_toon_cone(0.4f, 0.2f)};
  const auto brightness = [&](double share_of_right_angle) {
    const LobeEvaluation e =
        evaluate_lobe(lobe, kTestNormal, direction_at(kFrame, share_of_right_angle * M_PI / 2.0, 1.0));
    return e.pdf > 0.0f ? e.f_cos.g / e.pdf : 0.0f;
  };
  EXPECT_FLOAT_EQ(brightness(0.39), 1.0f);
  EXPECT_NEAR(brightness(0.5), 0.5f, 1e-4f);
  EXPECT_EQ(brightness(0.61), 0.0f);
}

/// Cosines are no measure of such angles: in floats, the next below 1 is that of 70 times this one.
TEST(ToonLobe, TheSmallestConeIsWhole) {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const ToonGlossyLobe lobe{kTestNormal, make_toon_cone(0.0f, 0.0f)};
  const double angle = 1e-5 * M_PI / 2.0, density = 1.0 / (M_PI * angle * angle);
  Rng rng(3, 0, 0, 0);
  int inside = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::optional<Vec3> wi = sample_lobe(lobe, wo, 0.0f, rng.next_vec2());
    ASSERT_TRUE(wi);
    const float pdf = evaluate_lobe(lobe, wo, *wi).pdf;
    inside += pdf > 0.0f;
    if (pdf > 0.0f) EXPECT_NEAR(static_cast<double>(pdf) / density, 1.0, 1e-3);
  }
  EXPECT_GT(inside, 980);  // but for roundings at the edge
  const Vec3 twice_as_far = normalize(reflect(wo, kTestNormal) + static_cast<float>(3.0 * angle) * kFrame.t);
  EXPECT_EQ(evaluate_lobe(lobe, wo, twice_as_far).pdf, 0.0f);
}

TEST(ToonLobe, CountsAsWhatItIs) {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  Bsdf bsdf = make_bsdf(wo);
  add_lobe(bsdf, ToonDiffuseLobe{kTestNormal, make_toon_cone(0.5f, 0.0f)}, Rgb(0.5f), 0.5f);
  EXPECT_EQ(scattered_kinds(bsdf), kVisibleToDiffuse);
  add_lobe(bsdf, ToonGlossyLobe{kTestNormal, make_toon_cone(0.04f, 0.0f)}, Rgb(0.25f), 0.25f);
  EXPECT_EQ(scattered_kinds(bsdf), kVisibleToDiffuse | kVisibleToGlossy);
  EXPECT_FALSE(is_narrow(bsdf.lobes[0]));
  EXPECT_TRUE(is_smooth(bsdf.lobes[1]) && is_narrow(bsdf.lobes[1]));
  const KindColors colors = albedo_by_kind(bsdf);
  EXPECT_EQ(colors[static_cast<size_t>(ScatterKind::DIFFUSE)], Rgb(0.5f));
  EXPECT_EQ(colors[static_cast<size_t>(ScatterKind::GLOSSY)], Rgb(0.25f));
  const BsdfEvaluation f = evaluate_bsdf(bsdf, reflect(wo, kTestNormal));
  EXPECT_FALSE(is_black(f.smooth_cos));
}

}  // namespace
}  // namespace cistern::test
