#include <gtest/gtest.h>

#include "base/sphere_map.h"
#include "shading/bsdf_statistics.h"
#include "shading/lobe_microfacet.h"

// False-alarm rate of all comparisons in this file together: kFalseAlarmRate for each, about 30 of them.
namespace cistern::test {
namespace {

const Frame kFrame(kTestNormal);

/// Light from a part of the sphere about `towards`, and a little from everywhere, below the surface too.
DirectionHistogram histogram(Vec3 towards) {
  std::array<double, DirectionHistogram::kBins> weights;
  for (int i = 0; i < DirectionHistogram::kBins; ++i) {
    constexpr int kSide = DirectionHistogram::kSide;
    const Vec2 p{(static_cast<float>(i % kSide) + 0.5f) / kSide, (static_cast<float>(i / kSide) + 0.5f) / kSide};
    weights[static_cast<size_t>(i)] = dot(equal_area_direction(p), towards) > 0.8f ? 1.0 : 0.02;
  }
  return DirectionHistogram(weights);
}
const DirectionHistogram kGuide = histogram(at_angle(kFrame, 0.4f));

/// One lobe above the surface, one half below.
DirectionLobes caustic_lobes() {
  DirectionLobes lobes;
  lobes.add({.axis = at_angle(kFrame, 0.7f), .square_radius = 0.02f, .share = 1.0f});
  lobes.add({.axis = at_angle(kFrame, 0.1f), .square_radius = 0.1f, .share = 0.5f});
  return lobes;
}
const DirectionLobes kCaustics = caustic_lobes();

/// As they are seen from `kElsewhere`: about what is so near that it is in quite another direction there.
DirectionLobes turning_lobes() {
  DirectionLobes lobes;
  lobes.add(
      {.axis = at_angle(kFrame, 0.7f), .square_radius = 0.02f, .share = 1.0f, .from = {0, 0, 0}, .nearness = 0.5f});
  lobes.add(
      {.axis = at_angle(kFrame, 0.1f), .square_radius = 0.1f, .share = 0.5f, .from = {1, 0, 0}, .nearness = 0.2f});
  lobes.set_worth(0.4f);
  return lobes;
}
const DirectionLobes kTurning = turning_lobes();
const Vec3 kElsewhere{0.6f, -0.5f, 0.4f};

MicrofacetLobe microfacet(float roughness, bool transmits) {
  MicrofacetLobe lobe;
  lobe.n = kTestNormal;
  lobe.alpha_x = lobe.alpha_y = sqr(roughness);
  lobe.ior = 1.5f;
  lobe.transmits = transmits;
  lobe.fresnel = FresnelModel::DIELECTRIC;
  return lobe;
}

struct Case {
  const char* name;
  Bsdf bsdf;
};

std::vector<Case> cases() {
  const Vec3 wo = at_angle(kFrame, 0.6f);
  std::vector<Case> result;
  const auto add = [&](const char* name) -> Bsdf& { return result.emplace_back(Case{name, make_bsdf(wo)}).bsdf; };
  result.reserve(7);
  add_lobe(add("diffuse"), LambertLobe{kTestNormal}, Rgb(0.4f, 0.2f, 0.1f), 0.3f);
  Bsdf& rough = add("rough lobes of all kinds");
  add_lobe(rough, LambertLobe{kTestNormal}, Rgb(0.4f), 0.3f);
  add_lobe(rough, TranslucentLobe{kTestNormal}, Rgb(0.1f), 0.1f);
  add_lobe(rough, microfacet(0.7f, true), Rgb(0.5f), 0.6f);
  Bsdf& coated = add("a narrow lobe beside a diffuse one");
  add_lobe(coated, LambertLobe{kTestNormal}, Rgb(0.4f), 0.3f);
  add_lobe(coated, microfacet(0.35f, false), Rgb(0.5f), 0.4f);
  Bsdf& uniform = add("sampled evenly");
  add_lobe(uniform, LambertLobe{kTestNormal}, Rgb(0.4f), 0.3f);
  uniform.rough_sampling = RoughSampling::UNIFORM;
  for (Case& c : result) c.bsdf.guide = {&kGuide, nullptr, {}};
  Bsdf& caustics = add("towards caustics");
  add_lobe(caustics, LambertLobe{kTestNormal}, Rgb(0.4f), 0.3f);
  add_lobe(caustics, microfacet(0.35f, false), Rgb(0.5f), 0.4f);
  caustics.guide = {nullptr, &kCaustics, {}};
  Bsdf& both = add("towards both");
  add_lobe(both, LambertLobe{kTestNormal}, Rgb(0.4f), 0.3f);
  both.guide = {&kGuide, &kCaustics, {}};
  Bsdf& elsewhere = add("towards caustics that turn, and both");
  add_lobe(elsewhere, LambertLobe{kTestNormal}, Rgb(0.4f), 0.3f);
  elsewhere.guide = {&kGuide, &kTurning, kElsewhere};
  return result;
}

std::optional<BsdfSample> draw(const Bsdf& bsdf, Rng& rng) {
  const float u = rng.next_float();
  return sample_bsdf(bsdf, u, rng.next_vec2());
}

DirectionSampler sampler(const Bsdf& bsdf) {
  return [&bsdf](Rng& rng) -> std::optional<Vec3> {
    const std::optional<BsdfSample> sample = draw(bsdf, rng);
    return sample ? std::optional<Vec3>(sample->wi) : std::nullopt;
  };
}

DirectionDensity density(const Bsdf& bsdf) {
  return [&bsdf](Vec3 wi) { return evaluate_bsdf(bsdf, wi).pdf; };
}

TEST(GuidedBsdf, SamplesFollowTheMixtureDensity) {
  for (const auto& [name, bsdf] : cases())
    EXPECT_GT(sampler_p_value(kFrame, sampler(bsdf), density(bsdf), 1), kFalseAlarmRate) << name;
}

TEST(GuidedBsdf, PlantedBugsInTheDensityAreSeen) {
  const Bsdf bsdf = cases()[0].bsdf;
  const auto is_above = [](Vec3 wi) { return dot(kTestNormal, wi) > 0.0f; };
  const DirectionDensity guide_alone = [&](Vec3 wi) { return is_above(wi) ? kGuide.pdf(wi) : 0.0f; };
  const DirectionDensity without_jacobian = [&](Vec3 wi) {
    const float own = evaluate_bsdf(bsdf, wi).unguided_pdf;
    return is_above(wi) ? 0.5f * own + 0.5f * kGuide.pmf(DirectionHistogram::bin(wi)) : 0.0f;
  };
  const DirectionDensity without_guide = [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).unguided_pdf; };
  for (const DirectionDensity& wrong : {guide_alone, without_jacobian, without_guide})
    EXPECT_LT(sampler_p_value(kFrame, sampler(bsdf), wrong, 1), kFalseAlarmRate);
  const Bsdf turning = cases()[6].bsdf;
  Bsdf not_turned = turning, of_other_worth = turning;
  not_turned.guide.position = {};
  DirectionLobes other = kTurning;
  other.set_worth(0.3f);
  of_other_worth.guide.caustics = &other;
  for (const Bsdf& wrong : {not_turned, of_other_worth})
    EXPECT_LT(sampler_p_value(kFrame, sampler(turning), density(wrong), 1), kFalseAlarmRate);
}

TEST(GuidedBsdf, WeightsAddUpToTheAlbedo) {
  for (const auto& guided : cases()) {
    const Bsdf& bsdf = guided.bsdf;
    Moments red;
    Rng rng(2, 0, 0, 0);
    for (int i = 0; i < 40000; ++i) {
      const std::optional<BsdfSample> sample = draw(bsdf, rng);
      red.add(sample ? sample->total_weight().r : 0.0);
      if (!sample) continue;
      const BsdfEvaluation evaluation = evaluate_bsdf(bsdf, sample->wi);
      ASSERT_EQ(sample->pdf, evaluation.pdf);
      ASSERT_NEAR(sample->guide_gain * evaluation.unguided_pdf, evaluation.pdf, 1e-5f * evaluation.pdf);
    }
    const double integral = integrate_sphere(kFrame, [&](Vec3 wi) { return evaluate_bsdf(bsdf, wi).total_cos().r; });
    EXPECT_GT(mean_p_value(red, integral), kFalseAlarmRate) << guided.name;
  }
}

/// Light of a cone of the sky, by light samples and guided directions together, weighted by the power heuristic;
/// the functions say what the weights of either hold for the density of directions.
template <class OfLightSample, class OfDirection>
Moments light_of_cone(const Bsdf& bsdf, OfLightSample of_light_sample, OfDirection of_direction) {
  constexpr float kOneMinusCos = 0.1f, kPdf = 1.0f / (2.0f * kPi * kOneMinusCos);
  const Frame cone(at_angle(kFrame, 0.5f));
  Moments moments;
  Rng rng(6, 0, 0, 0);
  for (int i = 0; i < 200000; ++i) {
    const Vec3 wi = cone.to_world(square_to_cone(rng.next_vec2(), kOneMinusCos));
    const BsdfEvaluation f = evaluate_bsdf(bsdf, wi);
    double sum = f.total_cos().r / kPdf * power_heuristic(kPdf, of_light_sample(f));
    const std::optional<BsdfSample> sample = draw(bsdf, rng);
    if (sample && dot(cone.n, sample->wi) > 1.0f - kOneMinusCos)
      sum += sample->total_weight().r * power_heuristic(of_direction(*sample), kPdf);
    moments.add(sum);
  }
  return moments;
}

TEST(GuidedBsdf, LightSamplesAndDirectionsShareTheLight) {
  for (const size_t guided : {0, 5, 6}) {
    const Bsdf bsdf = cases()[guided].bsdf;
    Bsdf plain = bsdf;
    plain.guide = {};
    const auto of_evaluation = [](const BsdfEvaluation& f) { return f.pdf; };
    const auto of_sample = [](const BsdfSample& sample) { return sample.pdf; };
    const Moments truth = light_of_cone(plain, of_evaluation, of_sample);
    EXPECT_GT(same_mean_p_value(light_of_cone(bsdf, of_evaluation, of_sample), truth), kFalseAlarmRate);
    // Planted bugs: a side that forgets the guide.
    const auto forgets = [](const BsdfSample& sample) { return sample.pdf / sample.guide_gain; };
    EXPECT_LT(same_mean_p_value(light_of_cone(bsdf, of_evaluation, forgets), truth), kFalseAlarmRate);
    const auto unguided = [](const BsdfEvaluation& f) { return f.unguided_pdf; };
    EXPECT_LT(same_mean_p_value(light_of_cone(bsdf, unguided, of_sample), truth), kFalseAlarmRate);
  }
}

/// What a kind of scattering brings must not depend on the guide: where kinds matter only Bsdfs without narrow lobes
/// have one.
TEST(GuidedBsdf, SharesOfKindsStayTheSame) {
  const Bsdf guided = cases()[1].bsdf;
  Bsdf plain = guided;
  plain.guide = {};
  std::array<Moments, kScatterKinds> with, without;
  for (auto& [bsdf, moments] :
       {std::pair<const Bsdf&, std::array<Moments, kScatterKinds>&>{guided, with}, {plain, without}}) {
    Rng rng(3, 0, 0, 0);
    for (int i = 0; i < 60000; ++i) {
      const std::optional<BsdfSample> sample = draw(bsdf, rng);
      for (size_t kind = 0; kind < kScatterKinds; ++kind)
        moments[kind].add(sample && static_cast<size_t>(sample->kind) == kind ? sample->total_weight().r : 0.0);
    }
  }
  for (size_t kind = 0; kind < kScatterKinds; ++kind)
    EXPECT_GT(same_mean_p_value(with[kind], without[kind]), kFalseAlarmRate) << kind;
  Rng rng(4, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const std::optional<BsdfSample> sample = draw(guided, rng);
    if (!sample) continue;
    const BsdfEvaluation a = evaluate_bsdf(guided, sample->wi), b = evaluate_bsdf(plain, sample->wi);
    for (size_t kind = 0; kind < kScatterKinds; ++kind)
      ASSERT_NEAR(a.pdf_by_kind[kind] / a.pdf, b.pdf_by_kind[kind] / b.pdf, 1e-4f);
  }
}

}  // namespace
}  // namespace cistern::test
