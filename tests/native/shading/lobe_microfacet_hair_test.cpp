#include "shading/lobe_microfacet_hair.h"

#include <gtest/gtest.h>

#include "shading/bsdf_statistics.h"
#include "shading/fresnel.h"

namespace cistern::test {
namespace {

using Way = MicrofacetHairLobe::Way;

const Frame kFrame(kTestNormal);
const Vec3 kAlong = kFrame.s;  // the strand

MicrofacetHair glass(float alpha, float aspect_ratio = 1.0f) {
  MicrofacetHair hair;
  hair.alpha = alpha;
  hair.aspect_ratio = aspect_ratio;
  hair.major_axis = kFrame.t;
  return hair;
}

/// At that inclination to the plane across, turned about the strand.
Vec3 direction(float inclination, float turn) {
  return std::sin(inclination) * kAlong +
         std::cos(inclination) * (std::sin(turn) * kFrame.t + std::cos(turn) * kFrame.n);
}

/// The normal of the round hull that far from the middle of the strand as it is seen.
Vec3 normal_at(float h, Vec3 wo) {
  const Vec3 across = normalize(cross(kAlong, wo));
  return std::sqrt(1.0f - h * h) * cross(across, kAlong) - h * across;
}

MicrofacetHairWays ways_of(const MicrofacetHair& hair, float h, Vec3 wo, uint32_t seed) {
  return make_microfacet_hair(hair, kAlong, normal_at(h, wo), wo, seed, 1);
}

std::vector<MicrofacetHairWays::Way> lobes_of(const MicrofacetHairWays& ways) {
  return {ways.ways.begin(), ways.ways.begin() + static_cast<std::ptrdiff_t>(ways.count)};
}

/// One with light in all ways.
MicrofacetHairWays full(const MicrofacetHair& hair, float h, Vec3 wo) {
  MicrofacetHairWays ways;
  for (uint32_t seed = 1; ways.count < 4 && seed < 100; ++seed) ways = ways_of(hair, h, wo, seed);
  return ways;
}

double p_value(const MicrofacetHairLobe& lobe, Vec3 wo, uint64_t seed, float planted = 1.0f) {
  MicrofacetHairLobe evaluated = lobe;
  evaluated.alpha *= planted;
  const auto sampler = [&](Rng& rng) -> std::optional<Vec3> {
    const float u = rng.next_float();
    const std::optional<Vec3> wi = sample_lobe(lobe, wo, u, rng.next_vec2());
    return wi && evaluate_lobe(lobe, wo, *wi).pdf > 0.0f ? wi : std::nullopt;
  };
  const Frame frame(lobe.way == Way::SPREAD ? kTestNormal : lobe.facing);  // along whose horizon the density ends
  return sampler_p_value(
      frame, sampler, [&](Vec3 wi) { return evaluate_lobe(evaluated, wo, wi).pdf; }, seed);
}

TEST(MicrofacetHair, SamplersFollowTheirDensity) {
  constexpr int kCases = 32;
  const double threshold = shared_rate(kCases);
  uint64_t seed = 100;
  for (const float aspect_ratio : {1.0f, 0.6f})
    for (const float inclination : {0.1f, 0.8f})
      for (const float h : {-0.3f, 0.4f}) {
        const Vec3 wo = direction(inclination, 0.7f);
        const MicrofacetHairWays ways = full(glass(0.4f, aspect_ratio), h, wo);
        ASSERT_EQ(ways.count, 4u);
        for (const auto& [lobe, weight] : lobes_of(ways))
          EXPECT_GT(p_value(lobe, wo, ++seed), threshold)
              << static_cast<int>(lobe.way) << " " << aspect_ratio << " " << inclination << " " << h;
      }
  // Planted bug: facets of another width.
  const Vec3 wo = direction(0.1f, 0.7f);
  for (const auto& [lobe, weight] : lobes_of(full(glass(0.1f), 0.4f, wo)))
    EXPECT_LT(p_value(lobe, wo, 100, 1.5f), threshold);
}

/// Where scales are tilted, what samples reach is what the density integrates to.
TEST(MicrofacetHair, TiltedSamplersReachWhatTheirDensitySaysTheyDo) {
  constexpr int kSamples = 40000;
  const Vec3 wo = direction(0.8f, 0.7f);
  MicrofacetHair hair = glass(0.4f, 0.6f);
  hair.tilt = 0.15f;
  const auto p_value_of = [&](const MicrofacetHairLobe& lobe, float planted_lean) {
    MicrofacetHairLobe evaluated = lobe;
    evaluated.facing = normalize(lobe.facing + planted_lean * kAlong);
    Moments difference;
    Rng rng(21, 0, 0, 0);
    for (int i = 0; i < kSamples; ++i) {
      const float u = rng.next_float();
      const auto wi = sample_lobe(lobe, wo, u, rng.next_vec2());
      const bool arrives = wi && evaluate_lobe(lobe, wo, *wi).pdf > 0.0f;
      difference.add((arrives ? 1.0 : 0.0) -
                     4.0 * M_PI * evaluate_lobe(evaluated, wo, square_to_sphere(rng.next_vec2())).pdf);
    }
    return mean_p_value(difference, 0.0);
  };
  const MicrofacetHairWays ways = full(hair, 0.2f, wo);
  ASSERT_EQ(ways.count, 4u);
  for (const auto& [lobe, weight] : lobes_of(ways)) EXPECT_GT(p_value_of(lobe, 0.0f), shared_rate(4));
  // Planted bug: the density ends elsewhere.
  EXPECT_LT(p_value_of(ways.ways[0].lobe, -0.6f), shared_rate(4));
}

/// Of light from everywhere, by its samplers, mean over what points hide.
Moments furnace(const MicrofacetHair& hair, float h, Vec3 wo, uint32_t points = 20000) {
  Moments moments;
  Rng rng(11, 0, 0, 0);
  for (uint32_t seed = 0; seed < points; ++seed) {
    const MicrofacetHairWays ways = ways_of(hair, h, wo, seed);
    double sum = 0.0;
    for (const auto& [lobe, weight] : lobes_of(ways)) {
      const float u = rng.next_float();
      const auto wi = sample_lobe(lobe, wo, u, rng.next_vec2());
      if (!wi) continue;
      const LobeEvaluation f = evaluate_lobe(lobe, wo, *wi);
      if (f.pdf > 0.0f) sum += weight.g * f.f_cos.g / f.pdf;
    }
    moments.add(sum);
  }
  return moments;
}

// Nothing is absorbed: all that comes in goes out, but for what sharp facets hide at the rim and where the last ways
// are guessed.
TEST(MicrofacetHair, KeepsAWhiteFurnaceNearlyWhite) {
  for (const float aspect_ratio : {1.0f, 0.5f})
    for (const float h : {0.0f, 0.35f}) {
      const Vec3 wo = direction(0.2f, 0.0f);
      EXPECT_NEAR(furnace(glass(0.05f, aspect_ratio), h, wo).mean(), 1.0, 0.01) << aspect_ratio << " " << h;
      EXPECT_NEAR(furnace(glass(0.3f, aspect_ratio), h, wo).mean(), 1.0, 0.06) << aspect_ratio << " " << h;
    }
  // Planted bug: it absorbs a little.
  MicrofacetHair grey = glass(0.05f);
  grey.absorption = Rgb(0.02f);
  EXPECT_LT(furnace(grey, 0.0f, direction(0.2f, 0.0f)).mean(), 0.98);
}

/// From the laws of reflection and refraction at a round rod without roughness, seen from across.
TEST(MicrofacetHair, SmoothRodsFollowTheLawsOfOptics) {
  constexpr float kTurnTolerance = 0.03f;
  MicrofacetHair hair = glass(1e-3f);
  hair.absorption = Rgb(0.3f);
  const Vec3 wo = direction(0.0f, 0.0f);
  for (const float h : {-0.6f, 0.2f, 0.5f}) {
    const float outside = std::asin(h), inside = std::asin(h / hair.ior);
    const float f = fresnel_dielectric(std::cos(outside), hair.ior);
    const float passed = std::exp(-2.0f * hair.absorption.g * std::cos(inside));
    const float turns[] = {2.0f * outside, kPi + 2.0f * (outside - inside), 2.0f * (outside - 2.0f * inside)};
    const float parts[] = {1.0f, (1.0f - f) * passed, (1.0f - f) * passed * f * passed};  // before the last facet
    const MicrofacetHairWays ways = full(hair, h, wo);
    ASSERT_EQ(ways.count, 4u) << h;
    for (size_t way = 0; way < 3; ++way) {
      const auto& [lobe, weight] = ways.ways[way];
      EXPECT_NEAR(weight.g, parts[way], 0.02f * parts[way]) << h << " " << way;
      const auto wi = sample_lobe(lobe, wo, 0.5f, {0.5f, 0.5f});
      ASSERT_TRUE(wi) << h << " " << way;
      EXPECT_NEAR(dot(*wi, kAlong), 0.0f, kTurnTolerance);
      EXPECT_NEAR(dot(*wi, direction(0.0f, turns[way])), 1.0f, kTurnTolerance * kTurnTolerance) << h << " " << way;
    }
  }
}

TEST(MicrofacetHair, TiltedScalesTurnReflectionAndWhatPassesToOppositeEnds) {
  MicrofacetHair hair = glass(0.01f);
  hair.tilt = 0.1f;  // towards the root, which is where the tangent comes from
  const Vec3 wo = direction(0.0f, 0.0f);
  const MicrofacetHairWays ways = full(hair, 0.0f, wo);
  ASSERT_EQ(ways.count, 4u);
  const auto leans = [&](size_t way) { return dot(*sample_lobe(ways.ways[way].lobe, wo, 0.5f, {0.5f, 0.5f}), kAlong); };
  EXPECT_NEAR(leans(0), -std::sin(0.2f), 0.03f);
  EXPECT_GT(leans(1), 0.05f);
}

TEST(MicrofacetHair, EllipsesAreAsWideAsTheyAreSeen) {
  const MicrofacetHair hair = glass(0.3f, 0.5f), switched = glass(0.3f, 2.0f);
  const float quarter = 0.5f * kPi;
  struct Case {
    float turn, half_width;  // from the minor axis
  };
  for (const auto& [turn, half_width] :
       {Case{0.0f, 1.0f}, {quarter, 0.5f}, {0.5f * quarter, std::sqrt(0.5f * 1.25f)}}) {
    const Vec3 wo = direction(0.4f, turn);
    for (const float sign : {-1.0f, 1.0f}) {
      const float inner = sign * std::min(half_width - 0.01f, 0.999f), outer = sign * (half_width + 0.01f);
      EXPECT_FALSE(passes_beside(hair, kAlong, normal_at(inner, wo), wo)) << turn;
      if (half_width < 1.0f) {
        EXPECT_TRUE(passes_beside(hair, kAlong, normal_at(outer, wo), wo)) << turn;
        EXPECT_TRUE(passes_beside(switched, kAlong, normal_at(outer, wo), wo)) << turn;
        EXPECT_FALSE(passes_beside(glass(0.3f), kAlong, normal_at(outer, wo), wo)) << turn;
      }
    }
  }
}

TEST(MicrofacetHair, WalksShareWhatEnters) {
  const Vec3 wo = direction(0.1f, 0.2f);
  const auto sum = [&](uint32_t seed, int walks) {
    const MicrofacetHairWays ways = make_microfacet_hair(glass(0.3f), kAlong, normal_at(0.3f, wo), wo, seed, walks);
    float weights = 0.0f;
    for (const auto& [lobe, weight] : lobes_of(ways)) weights += weight.g;
    return weights;
  };
  const auto p_value_of = [&](float planted) {
    Moments difference;
    for (uint32_t seed = 0; seed < 4000; ++seed)
      difference.add(planted * sum(seed, MicrofacetHairWays::kWalks) - sum(seed + 1'000'000, 1));
    return mean_p_value(difference, 0.0);
  };
  EXPECT_GT(p_value_of(1.0f), shared_rate(1));
  EXPECT_LT(p_value_of(1.05f), shared_rate(1));  // planted bug: they share more
}

TEST(MicrofacetHair, PlacesDiffer) {
  const Vec3 wo = direction(0.3f, 0.2f), wi = direction(-0.2f, 2.8f);
  const auto value = [&](uint32_t seed) {
    const MicrofacetHairWays ways = ways_of(glass(0.3f), 0.2f, wo, seed);
    return ways.count > 1 ? evaluate_lobe(ways.ways[1].lobe, wo, wi).f_cos.g : 0.0f;
  };
  EXPECT_NE(value(5), value(6));
}

TEST(MicrofacetHair, StaysFinite) {
  Rng rng(3, 0, 0, 0);
  for (const float alpha : {0.0f, 1.0f, 7.0f})
    for (const float aspect_ratio : {0.0f, 0.3f, 1e9f})
      for (const float ior : {1.0f + 1e-5f, 1.55f, 1000.0f})
        for (const Vec3 wo : {kAlong, -kAlong, normalize(kAlong + 1e-6f * kFrame.t), kFrame.n, direction(1.5f, 0.3f)}) {
          MicrofacetHair hair = glass(alpha, aspect_ratio);
          hair.ior = ior;
          hair.tilt = 0.5f;
          hair.absorption = {0.0f, 1e3f, 1e30f};
          hair.major_axis = alpha > 0.5f ? kAlong : Vec3{};
          const MicrofacetHairWays ways = make_microfacet_hair(hair, kAlong, kFrame.n, wo, 7);
          for (const auto& [lobe, weight] : lobes_of(ways)) {
            EXPECT_TRUE(is_finite(weight) && std::isfinite(microfacet_hair_albedo(lobe, wo)));
            for (int i = 0; i < 20; ++i) {
              const auto wi = sample_lobe(lobe, wo, rng.next_float(), rng.next_vec2());
              if (!wi) continue;
              const LobeEvaluation f = evaluate_lobe(lobe, wo, *wi);
              EXPECT_TRUE(is_finite(*wi) && std::isfinite(f.pdf) && is_finite(f.f_cos)) << alpha << " " << ior;
            }
          }
        }
}

}  // namespace
}  // namespace cistern::test
