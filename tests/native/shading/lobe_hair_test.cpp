#include "shading/lobe_hair.h"

#include <gtest/gtest.h>

#include "shading/bsdf_statistics.h"

namespace cistern::test {
namespace {

const Frame kFrame(kTestNormal);
const Vec3 kAlong = kFrame.s;  // the strand

HairAppearance appearance(float roughness, float radial, float absorption = 0.0f) {
  HairAppearance hair;
  hair.absorption = Rgb(absorption, 2.0f * absorption, 0.5f * absorption);
  hair.roughness = roughness;
  hair.radial_roughness = radial;
  return hair;
}

/// Seen so far from the middle of the strand, and at that inclination.
HairLobe strand(const HairAppearance& hair, float h, Vec3 wo) {
  const Vec3 across = normalize(cross(kAlong, wo)), towards = cross(kAlong, across);
  // towards looks away from the eye; the normal turns with h about the strand.
  const Vec3 ng = -std::sqrt(1.0f - h * h) * towards + h * across;
  return make_hair(hair, kAlong, ng, wo);
}

Vec3 view(float inclination) {
  return normalize(std::sin(inclination) * kAlong + std::cos(inclination) * (0.6f * kFrame.t + 0.8f * kFrame.n));
}

constexpr int kCases = 24;
const double kThreshold = shared_rate(kCases);

double p_value(const HairLobe& lobe, Vec3 wo, uint64_t seed, float planted_tilt = 0.0f) {
  HairLobe evaluated = lobe;
  evaluated.tilt += planted_tilt;
  const auto sampler = [&](Rng& rng) {
    const float u = rng.next_float();
    return sample_lobe(lobe, wo, u, rng.next_vec2());
  };
  return sampler_p_value(
      kFrame, sampler, [&](Vec3 wi) { return evaluate_lobe(evaluated, wo, wi).pdf; }, seed);
}

TEST(HairLobe, SamplerFollowsItsDensity) {
  uint64_t seed = 100;
  for (const float roughness : {0.35f, 0.8f})
    for (const float inclination : {0.0f, 0.9f})
      for (const float h : {-0.8f, 0.1f, 0.6f}) {
        HairAppearance hair = appearance(roughness, 0.5f, 0.3f);
        hair.coat = h > 0.5f ? 0.5f : 0.0f;
        hair.tilt = inclination > 0.0f ? 0.0f : 0.1f;
        const Vec3 wo = view(inclination);
        EXPECT_GT(p_value(strand(hair, h, wo), wo, ++seed), kThreshold) << roughness << " " << inclination << " " << h;
      }
  // Planted bug: scales tilted otherwise.
  EXPECT_LT(p_value(strand(appearance(0.35f, 0.5f), 0.1f, view(0.3f)), view(0.3f), 100, 0.1f), kThreshold);
}

/// Of light from everywhere, by its sampler.
Moments furnace(const HairLobe& lobe, Vec3 wo, int samples = 40000) {
  Moments moments;
  Rng rng(11, 0, 0, 0);
  for (int i = 0; i < samples; ++i) {
    const float u = rng.next_float();
    const auto wi = sample_lobe(lobe, wo, u, rng.next_vec2());
    const LobeEvaluation f = evaluate_lobe(lobe, wo, *wi);
    moments.add(f.f_cos.g / f.pdf);
  }
  return moments;
}

// Without absorption a strand sends on all that meets it: the sum of the ways is 1, and so is each density's integral,
// which the test above has shown for the sum. Uniform directions see the same.
TEST(HairLobe, KeepsAWhiteFurnaceWhite) {
  for (const float inclination : {0.0f, 1.2f})
    for (const float h : {-0.99f, 0.0f, 0.5f}) {
      const Vec3 wo = view(inclination);
      const HairLobe lobe = strand(appearance(0.6f, 0.6f), h, wo);
      EXPECT_NEAR(furnace(lobe, wo).mean(), 1.0, 1e-4);
      Moments uniform;
      Rng rng(12, 0, 0, 0);
      for (int i = 0; i < 100000; ++i)
        uniform.add(4.0f * kPi * evaluate_lobe(lobe, wo, square_to_sphere(rng.next_vec2())).f_cos.g);
      EXPECT_GT(mean_p_value(uniform, 1.0), shared_rate(6)) << inclination << " " << h << " " << uniform.mean();
      // Planted bug: a strand that absorbs a little.
      const HairLobe grey = strand(appearance(0.6f, 0.6f, 0.1f), h, wo);
      EXPECT_LT(furnace(grey, wo).mean(), 1.0 - 1e-3);
    }
}

TEST(HairLobe, AlbedoIsWhatLeaves) {
  for (const float absorption : {0.05f, 0.5f, 3.0f}) {
    const Vec3 wo = view(0.4f);
    const HairLobe lobe = strand(appearance(0.4f, 0.5f, absorption), 0.3f, wo);
    EXPECT_GT(mean_p_value(furnace(lobe, wo), hair_albedo(lobe, wo).g), shared_rate(3)) << absorption;
  }
}

TEST(HairLobe, WhatASmoothStrandReflectsObeysTheLawOfReflection) {
  // Seen in its middle, a strand without tilt sends the light that it reflects at once back across, and on along.
  const Vec3 wo = view(0.5f);
  HairAppearance hair = appearance(0.05f, 0.05f, 100.0f);  // nothing passes
  const HairLobe lobe = strand(hair, 0.0f, wo);
  Moments along;
  Rng rng(13, 0, 0, 0);
  for (int i = 0; i < 1000; ++i)
    along.add(dot(*sample_lobe(lobe, wo, 0.5f * rng.next_float(), rng.next_vec2()), kAlong));
  EXPECT_NEAR(along.mean(), -std::sin(0.5f), 0.01);
  const Vec3 mirrored = wo - 2.0f * dot(wo, kAlong) * kAlong;
  EXPECT_GT(evaluate_lobe(lobe, wo, mirrored).pdf, 20.0f);
}

TEST(HairLobe, AbsorptionFollowsColour) {
  EXPECT_EQ(hair_absorption(Rgb(1.0f), 0.3f), Rgb(0.0f));
  EXPECT_GT(hair_absorption(Rgb(0.1f), 0.3f).g, hair_absorption(Rgb(0.5f), 0.3f).g);
  EXPECT_TRUE(is_finite(hair_absorption(Rgb(0.0f), 0.3f)));
  EXPECT_EQ(melanin_absorption(0.0f, 0.5f), Rgb(0.0f));
  EXPECT_TRUE(is_finite(melanin_absorption(2.0f, 0.5f)));
  const Rgb black = melanin_absorption(0.9f, 0.0f), red = melanin_absorption(0.9f, 1.0f);
  EXPECT_GT(red.b / red.r, black.b / black.r);
}

TEST(HairLobe, StaysFiniteWhereTheViewIsAlongTheStrand) {
  for (const Vec3 wo : {kAlong, -kAlong, normalize(kAlong + 1e-6f * kFrame.t)}) {
    const HairLobe lobe = make_hair(appearance(0.3f, 0.3f, 0.5f), kAlong, kFrame.n, wo);
    const auto wi = sample_lobe(lobe, wo, 0.3f, {0.2f, 0.8f});
    ASSERT_TRUE(wi);
    const LobeEvaluation f = evaluate_lobe(lobe, wo, *wi);
    EXPECT_TRUE(std::isfinite(f.pdf) && is_finite(f.f_cos));
  }
}

}  // namespace
}  // namespace cistern::test
