#include <gtest/gtest.h>

#include <numeric>

#include "shading/bsdf_statistics.h"
#include "shading/lobe_microfacet.h"

namespace cistern::test {
namespace {

const Frame kFrame(kTestNormal);

MicrofacetLobe glass(float roughness) {
  MicrofacetLobe lobe;
  lobe.n = kTestNormal;
  lobe.alpha_x = lobe.alpha_y = sqr(roughness);
  lobe.ior = 1.5f;
  lobe.transmits = true;
  lobe.fresnel = FresnelModel::DIELECTRIC;
  return lobe;
}
MicrofacetLobe mirror(Vec3 n) {
  MicrofacetLobe lobe;
  lobe.n = n;
  return lobe;
}

Bsdf mixture(Vec3 wo) {
  Bsdf bsdf = make_bsdf(wo);
  add_lobe(bsdf, LambertLobe{kTestNormal}, Rgb(0.4f, 0.2f, 0.1f), 0.3f);
  add_lobe(bsdf, TranslucentLobe{kTestNormal}, Rgb(0.1f), 0.1f);
  add_lobe(bsdf, glass(0.4f), Rgb(0.5f), 0.6f);
  return bsdf;
}

std::optional<BsdfSample> draw(const Bsdf& bsdf, Rng& rng) {
  const float u = rng.next_float();
  return sample_bsdf(bsdf, u, rng.next_vec2());
}

TEST(Bsdf, SamplesFollowTheMixtureDensity) {
  const Bsdf bsdf = mixture(at_angle(kFrame, 0.6f));
  const auto sampler = [&](Rng& rng) -> std::optional<Vec3> {
    const std::optional<BsdfSample> sample = draw(bsdf, rng);
    return sample ? std::optional<Vec3>(sample->wi) : std::nullopt;
  };
  const auto density = [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).pdf; };
  EXPECT_GT(sampler_p_value(kFrame, sampler, density, 1), kFalseAlarmRate);
  // Planted bug: the choice among lobes left out of the density.
  Bsdf equal = bsdf;
  for (size_t i = 0; i < 3; ++i) equal.lobes[i].sample_weight = 1.0f / 3.0f;
  const auto wrong = [&](Vec3 wi) { return evaluate_bsdf(equal, wi).pdf; };
  EXPECT_LT(sampler_p_value(kFrame, sampler, wrong, 1), kFalseAlarmRate);
}

TEST(Bsdf, WeightsAgreeWithEvaluationAndWithQuadrature) {
  const Bsdf bsdf = mixture(at_angle(kFrame, 0.2f));
  Moments red, uncounted;
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 40000; ++i) {
    const std::optional<BsdfSample> sample = draw(bsdf, rng);
    red.add(sample ? sample->total_weight().r : 0.0);
    if (!sample) continue;
    uncounted.add(sample->total_weight().r);
    const BsdfEvaluation evaluation = evaluate_bsdf(bsdf, sample->wi);
    ASSERT_EQ(sample->pdf, evaluation.pdf);
    ASSERT_NEAR(sample->rough_weight.g * sample->pdf, evaluation.rough_cos.g, 1e-4f * evaluation.pdf);
  }
  const double integral = integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).total_cos().r; });
  EXPECT_GT(mean_p_value(red, integral), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(uncounted, integral), kFalseAlarmRate);  // planted bug: absorbed samples not counted as zero
}

/// The mixture with a smooth lobe, which keeps its own density.
Bsdf sampled_by(RoughSampling sampling, Vec3 wo) {
  Bsdf bsdf = mixture(wo);
  add_lobe(bsdf, glass(0.15f), Rgb(0.3f), 0.4f);
  bsdf.rough_sampling = sampling;
  return bsdf;
}

TEST(Bsdf, RoughLobesMayBeSampledEvenly) {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  const auto rough = [&](Vec3 wi) { return evaluate_bsdf(sampled_by(RoughSampling::BSDF, wo), wi).rough_cos.r; };
  const double integral = integrate_sphere(kFrame, rough);
  for (const RoughSampling sampling : {RoughSampling::COSINE, RoughSampling::UNIFORM}) {
    const Bsdf bsdf = sampled_by(sampling, wo);
    const auto sampler = [&](Rng& rng) -> std::optional<Vec3> {
      const std::optional<BsdfSample> sample = draw(bsdf, rng);
      return sample ? std::optional<Vec3>(sample->wi) : std::nullopt;
    };
    const auto density = [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).pdf; };
    EXPECT_GT(sampler_p_value(kFrame, sampler, density, 5), kFalseAlarmRate);
    const auto others = [&](Vec3 wi) { return evaluate_bsdf(sampled_by(RoughSampling::BSDF, wo), wi).pdf; };
    EXPECT_LT(sampler_p_value(kFrame, sampler, others, 5), kFalseAlarmRate) << "planted: the lobes' own densities";
    Moments mean;
    Rng rng(6, 0, 0, 0);
    for (int i = 0; i < 40000; ++i) {
      const std::optional<BsdfSample> sample = draw(bsdf, rng);
      mean.add(sample ? sample->rough_weight.r : 0.0f);
      if (!sample) continue;
      EXPECT_FLOAT_EQ(sample->pdf, evaluate_bsdf(bsdf, sample->wi).pdf);
    }
    EXPECT_GT(mean_p_value(mean, integral), kFalseAlarmRate);
  }
}

TEST(Bsdf, DensitiesOfKindsAddUp) {
  const Bsdf bsdf = sampled_by(RoughSampling::BSDF, at_angle(kFrame, 0.6f));
  EXPECT_EQ(scattered_kinds(bsdf), kVisibleToScattered & ~kVisibleToVolume);
  Rng rng(7, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const std::optional<BsdfSample> sample = draw(bsdf, rng);
    if (!sample) continue;
    const BsdfEvaluation f = evaluate_bsdf(bsdf, sample->wi);
    EXPECT_FLOAT_EQ(std::accumulate(f.pdf_by_kind.begin(), f.pdf_by_kind.end(), 0.0f), f.pdf);
    EXPECT_EQ(sample->kind_pdf, f.pdf_by_kind[static_cast<size_t>(sample->kind)]);
    EXPECT_GT(sample->kind_pdf, 0.0f);
  }
}

TEST(Bsdf, LobesAreSplitByRoughness) {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  Bsdf bsdf = make_bsdf(wo);
  add_lobe(bsdf, LambertLobe{kTestNormal}, Rgb(0.5f), 0.5f);
  add_lobe(bsdf, glass(0.19f), Rgb(0.5f), 0.5f);
  const Vec3 mirrored = reflect(wo, kTestNormal);
  EXPECT_NEAR(evaluate_bsdf(bsdf, mirrored).rough_cos.g, 0.5f * 0.6f * kInvPi, 1e-5f);
  EXPECT_GT(evaluate_bsdf(bsdf, mirrored).smooth_cos.g, 0.0f);
  Bsdf rough = make_bsdf(wo);
  add_lobe(rough, glass(0.21f), Rgb(0.5f), 0.5f);
  EXPECT_TRUE(is_black(evaluate_bsdf(rough, mirrored).smooth_cos));
}

TEST(Bsdf, DeltaLobesAreSampledAndNeverEvaluated) {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  Bsdf bsdf = make_bsdf(wo);
  add_lobe(bsdf, LambertLobe{kTestNormal}, Rgb(0.5f), 1.0f);
  add_lobe(bsdf, mirror(kTestNormal), Rgb(0.8f), 3.0f);
  const Vec3 mirrored = reflect(wo, kTestNormal);
  EXPECT_TRUE(is_black(evaluate_bsdf(bsdf, mirrored).smooth_cos));
  EXPECT_NEAR(evaluate_bsdf(bsdf, mirrored).pdf, 0.25f * 0.6f * kInvPi, 1e-5f);  // the mirror counts in the choice
  const std::optional<BsdfSample> sample = sample_bsdf(bsdf, 0.9f, {0.1f, 0.2f});
  ASSERT_TRUE(sample && sample->is_delta);
  EXPECT_NEAR(length(sample->wi - mirrored), 0.0f, 1e-5f);
  EXPECT_NEAR(sample->smooth_weight.g, 0.8f / 0.75f, 1e-5f);
  EXPECT_EQ(sample->kind, ScatterKind::GLOSSY);
}

TEST(Bsdf, DeltaGlassSplitsByFresnelAndBends) {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  Bsdf bsdf = make_bsdf(wo);
  add_lobe(bsdf, glass(0.0f), Rgb(1.0f), 1.0f);
  const std::optional<BsdfSample> through = sample_bsdf(bsdf, 0.999f, {0.5f, 0.5f});
  ASSERT_TRUE(through);
  EXPECT_EQ(through->kind, ScatterKind::TRANSMISSION);
  EXPECT_NEAR(through->smooth_weight.g, 1.0f, 1e-5f);
  EXPECT_NEAR(std::sqrt(1.0f - sqr(dot(through->wi, kTestNormal))), 0.8f / 1.5f, 1e-5f);  // Snell
  const std::optional<BsdfSample> back = sample_bsdf(bsdf, 0.0f, {0.5f, 0.5f});
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->pdf + through->pdf, 1.0f, 1e-5f);
}

TEST(Bsdf, NothingReflectsBehindTheSmoothSurfaceNorIsSampledBehindTheFlatOne) {
  const Vec3 bent = normalize(kTestNormal + 0.8f * kFrame.s);
  const Vec3 wo = at_angle(kFrame, 0.5f);
  Bsdf bsdf = make_bsdf(wo);
  bsdf.ns = normalize(kTestNormal + 0.4f * kFrame.s + 0.2f * kFrame.t);
  MicrofacetLobe lobe = glass(0.5f);
  lobe.n = bent;
  add_lobe(bsdf, lobe, Rgb(1.0f), 1.0f);
  add_lobe(bsdf, LambertLobe{bent}, Rgb(1.0f), 1.0f);
  Rng rng(4, 0, 0, 0);
  int left_to_light_samples = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 wi = square_to_sphere(rng.next_vec2());
    const BsdfEvaluation evaluation = evaluate_bsdf(bsdf, wi);
    if (dot(wi, bent) * dot(wi, bsdf.ns) < 0.0f) {
      EXPECT_TRUE(is_black(evaluation.total_cos()));
    }
    if (dot(wi, bsdf.ng) * dot(wi, bsdf.ns) < 0.0f) {
      EXPECT_EQ(evaluation.pdf, 0.0f);
      left_to_light_samples += !is_black(evaluation.total_cos());
    }
    const std::optional<BsdfSample> sample = draw(bsdf, rng);
    if (sample) {
      EXPECT_EQ(sample->kind == ScatterKind::TRANSMISSION, dot(sample->wi, kTestNormal) < 0.0f);
    }
  }
  EXPECT_GT(left_to_light_samples, 100);
  const auto sampler = [&](Rng& r) -> std::optional<Vec3> {
    const std::optional<BsdfSample> sample = draw(bsdf, r);
    return sample ? std::optional<Vec3>(sample->wi) : std::nullopt;
  };
  EXPECT_GT(sampler_p_value(
                kFrame, sampler, [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).pdf; }, 5),
            kFalseAlarmRate);
}

TEST(Bsdf, LightsCanBeHiddenFromAKindOfScattering) {
  const Bsdf bsdf = mixture(at_angle(kFrame, 0.6f));
  const Vec3 wi = at_angle(kFrame, 0.5f);
  const float cosine = dot(wi, kTestNormal);
  const BsdfEvaluation all = evaluate_bsdf(bsdf, wi), diffuse = evaluate_bsdf(bsdf, wi, kVisibleToDiffuse);
  EXPECT_NEAR(diffuse.total_cos().r, 0.4f * cosine * kInvPi, 1e-6f);
  EXPECT_GT(all.total_cos().r, diffuse.total_cos().r);
  EXPECT_EQ(all.pdf, diffuse.pdf);
}

TEST(Bsdf, KindsOfPassesAddUpAndAreThoseOfLobes) {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  Bsdf bsdf = mixture(wo);
  add_lobe(bsdf, glass(0.1f), Rgb(0.2f), 0.2f);
  for (const Vec3 wi : {reflect(wo, kTestNormal), -wo}) {
    const float cosine = dot(wi, kTestNormal);
    const BsdfKinds kinds = evaluate_kinds(bsdf, wi);
    const BsdfEvaluation f = evaluate_bsdf(bsdf, wi);
    EXPECT_FLOAT_EQ((kinds.rough[0] + kinds.rough[1] + kinds.rough[2]).g, f.rough_cos.g);
    EXPECT_FLOAT_EQ((kinds.smooth[0] + kinds.smooth[1] + kinds.smooth[2]).g, f.smooth_cos.g);
    const bool is_above = cosine > 0.0f;
    const Rgb diffuse = is_above ? Rgb(0.4f, 0.2f, 0.1f) : Rgb(0.1f);  // translucent light is diffuse
    EXPECT_NEAR(kinds.rough[0].r, diffuse.r * std::abs(cosine) * kInvPi, 1e-6f);
    EXPECT_EQ(is_black(kinds.rough[1]), !is_above);
    EXPECT_EQ(is_black(kinds.rough[2]), is_above);
    const KindColors shares = shares_of(kinds.rough);
    EXPECT_NEAR((shares[0] + shares[1] + shares[2]).b, 1.0f, 1e-6f);
  }
}

TEST(Bsdf, AlbedoOfKindsIsThatOfAll) {
  const Bsdf bsdf = mixture(at_angle(kFrame, 0.6f));
  const KindColors albedo = albedo_by_kind(bsdf);
  EXPECT_FLOAT_EQ((albedo[0] + albedo[1] + albedo[2]).r, bsdf_albedo(bsdf).r);
  EXPECT_FLOAT_EQ(albedo[0].r, 0.5f);
  EXPECT_GT(albedo[1].r, 0.01f);
  EXPECT_GT(albedo[2].r, albedo[1].r);
}

TEST(Bsdf, BumpShadowingFadesTowardsTheHorizon) {
  const Vec3 bent = normalize(kTestNormal + 0.6f * kFrame.s);
  const auto ratio = [&](float cosine) {  // to the unshadowed cosine
    Bsdf bsdf = make_bsdf(kTestNormal);
    add_lobe(bsdf, LambertLobe{bent}, Rgb(1.0f), 1.0f);
    const Vec3 wi = normalize(cosine * kTestNormal + std::sqrt(1.0f - sqr(cosine)) * kFrame.s);
    return evaluate_bsdf(bsdf, wi).rough_cos.g / (dot(bent, wi) * kInvPi);
  };
  EXPECT_NEAR(ratio(0.999f), 1.0f, 1e-3f);
  EXPECT_LT(ratio(0.3f), ratio(0.6f));
  EXPECT_LT(ratio(0.02f), 0.35f);
}

TEST(Bsdf, UncorrectedBumpsOnlyKeepLightOffWhereNormalsDisagree) {
  const Vec3 bent = normalize(kTestNormal + 0.6f * kFrame.s);
  Bsdf bsdf = make_bsdf(kTestNormal);
  bsdf.corrects_bumps = false;
  add_lobe(bsdf, LambertLobe{bent}, Rgb(1.0f), 1.0f);
  for (const float cosine : {-0.02f, 0.02f, 0.3f, 0.999f}) {
    const Vec3 wi = normalize(cosine * kTestNormal + std::sqrt(1.0f - sqr(cosine)) * kFrame.s);
    ASSERT_GT(dot(bent, wi), 0.0f);
    EXPECT_FLOAT_EQ(evaluate_bsdf(bsdf, wi).rough_cos.g, cosine > 0.0f ? dot(bent, wi) * kInvPi : 0.0f);
  }
}

TEST(Bsdf, BumpShadowingIsMeasuredFromTheDisplacedNormal) {
  const Vec3 bent = normalize(kTestNormal + 0.6f * kFrame.s), wi = at_angle(kFrame, 0.3f);
  const auto reflected = [&](Vec3 displaced, Vec3 n) {
    Bsdf bsdf = make_bsdf(kTestNormal);
    bsdf.bump_ns = displaced;
    add_lobe(bsdf, LambertLobe{n}, Rgb(1.0f), 1.0f);
    return evaluate_bsdf(bsdf, wi).rough_cos.g / (dot(n, wi) * kInvPi);
  };
  EXPECT_NEAR(reflected(bent, bent), 1.0f, 1e-6f);
  EXPECT_LT(reflected({}, bent), 0.999f);
  EXPECT_LT(reflected(bent, kTestNormal), 0.999f);
  EXPECT_NEAR(reflected({}, kTestNormal), 1.0f, 1e-6f);
}

TEST(Bsdf, SamplesKnowOfBumpShadowing) {
  Bsdf bsdf = make_bsdf(kTestNormal);
  bsdf.bump_ns = normalize(kTestNormal + 0.6f * kFrame.s);
  add_lobe(bsdf, LambertLobe{kTestNormal}, Rgb(1.0f), 1.0f);
  Rng rng(9, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const std::optional<BsdfSample> sample = draw(bsdf, rng);
    if (!sample) continue;
    ASSERT_NEAR(sample->rough_weight.g * sample->pdf, evaluate_bsdf(bsdf, sample->wi).rough_cos.g, 1e-6f);
  }
}

TEST(Bsdf, DiffuseLobesBentAwayAreBlackAndLeftOut) {
  const Vec3 above = at_angle(kFrame, 0.03f), below = at_angle(kFrame, -0.03f);
  Bsdf bsdf = make_bsdf(kTestNormal);
  EXPECT_FALSE(add_lobe(bsdf, LambertLobe{below}, Rgb(1.0f), 1.0f));
  EXPECT_FALSE(add_lobe(bsdf, TranslucentLobe{below}, Rgb(1.0f), 1.0f));
  EXPECT_FALSE(bsdf.scatters());
  EXPECT_TRUE(add_lobe(bsdf, LambertLobe{above}, Rgb(1.0f), 1.0f));
  EXPECT_TRUE(add_lobe(bsdf, mirror(below), Rgb(1.0f), 1.0f));  // no bump shadowing
}

TEST(Bsdf, LobesOfStrandsGoByTheirOwnNormals) {
  const Vec3 along = normalize(kFrame.s), behind = normalize(kFrame.t - 0.5f * kTestNormal);
  for (const RoughSampling sampling : {RoughSampling::BSDF, RoughSampling::COSINE, RoughSampling::UNIFORM}) {
    Bsdf bsdf = make_bsdf(kTestNormal);
    bsdf.is_strand = true;
    bsdf.rough_sampling = sampling;
    add_lobe(bsdf, LambertLobe{along}, Rgb(0.5f), 0.5f);
    add_lobe(bsdf, TranslucentLobe{behind}, Rgb(0.2f), 0.3f);
    add_lobe(bsdf, LambertLobe{kTestNormal}, Rgb(0.3f), 0.2f);
    EXPECT_TRUE(turns_away(bsdf));
    const auto sampler = [&](Rng& rng) -> std::optional<Vec3> {
      const std::optional<BsdfSample> sample = draw(bsdf, rng);
      return sample ? std::optional<Vec3>(sample->wi) : std::nullopt;
    };
    EXPECT_GT(sampler_p_value(
                  kFrame, sampler, [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).pdf; }, 21),
              kFalseAlarmRate);
    const auto scattered = [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).total_cos().r; };
    EXPECT_NEAR(integrate_sphere(kFrame, scattered), 1.0, 1e-3);
    Bsdf surface = bsdf;  // planted
    surface.is_strand = false;
    EXPECT_LT(sampler_p_value(
                  kFrame, sampler, [&](Vec3 wi) { return evaluate_bsdf(surface, wi).pdf; }, 21),
              kFalseAlarmRate);
    EXPECT_LT(integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_bsdf(surface, wi).total_cos().r; }), 0.9);
  }
}

TEST(Bsdf, LobesThatDifferInWeightsAloneAreOne) {
  const Vec3 bent = at_angle(kFrame, 0.8f);
  Bsdf merged = make_bsdf(kTestNormal), once = make_bsdf(kTestNormal);
  for (int i = 0; i < 3; ++i)
    for (const Vec3& n : {kTestNormal, bent}) {
      EXPECT_TRUE(add_lobe(merged, LambertLobe{n}, Rgb(0.1f, 0.2f, 0.3f), 0.2f, Rgb(0.1f)));
      EXPECT_TRUE(add_lobe(merged, TranslucentLobe{n}, Rgb(0.1f), 0.1f));
    }
  for (const Vec3& n : {kTestNormal, bent}) {
    add_lobe(once, LambertLobe{n}, Rgb(0.3f, 0.6f, 0.9f), 0.6f, Rgb(0.3f));
    add_lobe(once, TranslucentLobe{n}, Rgb(0.3f), 0.3f);
  }
  EXPECT_EQ(merged.count, 4);
  for (const float cosine : {-0.5f, 0.5f}) {
    const Vec3 wi = at_angle(kFrame, cosine);
    const BsdfEvaluation a = evaluate_bsdf(merged, wi), b = evaluate_bsdf(once, wi);
    EXPECT_NEAR(a.pdf, b.pdf, 1e-6f);
    EXPECT_NEAR(a.rough_cos.b, b.rough_cos.b, 1e-6f);
    EXPECT_NEAR(a.even_cos.g, b.even_cos.g, 1e-6f);
  }
}

TEST(Bsdf, CopiesOnlyItsLobesAndRefusesMoreThanItHolds) {
  Bsdf bsdf = make_bsdf(kTestNormal);
  const OrenNayarLobe lobe{kTestNormal};
  for (int i = 0; i < Bsdf::kMaxLobes; ++i) EXPECT_TRUE(add_lobe(bsdf, lobe, Rgb(0.01f), 0.1f));
  EXPECT_FALSE(add_lobe(bsdf, lobe, Rgb(0.1f), 0.1f));
  const Bsdf copy = bsdf;
  const Vec3 wi = at_angle(kFrame, 0.7f);
  EXPECT_EQ(evaluate_bsdf(copy, wi).pdf, evaluate_bsdf(bsdf, wi).pdf);
  EXPECT_NEAR(bsdf_albedo(copy).g, 0.01f * Bsdf::kMaxLobes, 1e-5f);
  EXPECT_NEAR(length(bsdf_normal(copy) - kTestNormal), 0.0f, 1e-6f);
  EXPECT_FALSE(add_lobe(bsdf, lobe, Rgb(0.1f), NAN));
}

}  // namespace
}  // namespace cistern::test
