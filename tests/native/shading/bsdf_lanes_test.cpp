#include "shading/bsdf_lanes.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/sphere_map.h"
#include "shading/bsdf_statistics.h"
#include "shading/lobe_microfacet.h"

namespace cistern::test {
namespace {

const Frame kFrame(kTestNormal);
const Vec3 kBent = normalize(kTestNormal + Vec3{0.1f, -0.05f, 0.08f});

MicrofacetLobe reflection(float roughness, FresnelModel fresnel, Vec3 n = kTestNormal) {
  MicrofacetLobe lobe;
  lobe.n = n;
  lobe.alpha_x = lobe.alpha_y = sqr(roughness);
  lobe.ior = 1.45f;
  lobe.fresnel = fresnel;
  lobe.f0 = {0.03f, 0.05f, 0.04f};
  lobe.f90_or_b = Rgb(1.0f);
  lobe.reflection_tint = {0.9f, 0.8f, 0.7f};
  lobe.energy_scale = 1.1f;
  return lobe;
}

const LambertLobe kDiffuse{kTestNormal};
const Rgb kWhite(1.0f), kColor{0.5f, 0.3f, 0.2f};

void add_diffuse(Bsdf& bsdf) { add_lobe(bsdf, kDiffuse, kColor, 0.4f, kColor * 0.9f); }

/// All forms that lanes take, one in each lane.
std::vector<Bsdf> layered() {
  using enum FresnelModel;
  std::vector<Bsdf> result;
  const auto add = [&](float cosine) -> Bsdf& { return result.emplace_back(make_bsdf(at_angle(kFrame, cosine))); };
  add_diffuse(add(0.3f));
  Bsdf& plastic = add(0.8f);
  add_lobe(plastic, reflection(0.5f, GENERALIZED_SCHLICK), kWhite, 0.1f);
  add_diffuse(plastic);
  add_lobe(add(0.2f), reflection(0.7f, NONE, kBent), kColor, 0.5f);
  Bsdf& varnish = add(0.1f);
  add_diffuse(varnish);
  add_lobe(varnish, reflection(0.6f, DIELECTRIC), kWhite, 0.2f);
  Bsdf& smooth = add(0.7f);  // what it reflects is not rough
  add_lobe(smooth, reflection(0.15f, GENERALIZED_SCHLICK), kWhite, 0.1f);
  add_diffuse(smooth);
  Bsdf& mirror = add(0.5f);
  add_lobe(mirror, reflection(0.0f, GENERALIZED_SCHLICK), kWhite, 0.1f);
  add_diffuse(mirror);
  Bsdf& light = add(0.4f);  // seen through something denser: total reflection
  MicrofacetLobe inside = reflection(0.5f, DIELECTRIC);
  inside.ior = 0.7f;
  add_lobe(light, inside, kWhite, 0.3f);
  add_diffuse(light);
  Bsdf& flat = add(0.6f);  // smooth shading that disagrees with the triangle
  flat.ng = kBent;
  add_diffuse(flat);
  Bsdf& gem = add(0.5f);
  MicrofacetLobe strong = reflection(0.6f, DIELECTRIC);
  strong.ior = 6.0f;
  add_lobe(gem, strong, kWhite, 0.3f);
  add_diffuse(gem);
  Bsdf& skin = add(0.6f);
  add_diffuse(skin);
  add_subsurface(skin, {kTestNormal, Rgb(0.5f), Rgb(0.8f), Rgb(0.1f)}, 1e-4f);
  EXPECT_EQ(skin.subsurface_count, 1);
  Bsdf& facets = add(0.6f);  // without a normal of its own
  facets.ns = {};
  facets.ng = kBent;
  add_lobe(facets, reflection(0.5f, NONE, kBent), kWhite, 0.3f);
  Bsdf& hidden = add(0.3f);  // facets that look away from who looks
  add_lobe(hidden, reflection(0.5f, NONE, normalize(kTestNormal - hidden.wo)), kWhite, 0.3f);
  add_diffuse(hidden);
  Bsdf& black = add(0.4f);
  MicrofacetLobe untinted = reflection(0.5f, GENERALIZED_SCHLICK);
  untinted.f0 = Rgb();
  add_lobe(black, untinted, kWhite, 0.3f);
  add_diffuse(black);
  return result;
}

Vec3 near_mirror(const Bsdf& bsdf, Vec2 u) {
  return normalize(reflect(bsdf.wo, kTestNormal) + 0.3f * equal_area_direction(u));
}

float difference(Rgb a, Rgb b) { return max_component(max(a - b, b - a)) / std::max(max_component(b), 1e-3f); }

class BsdfLanesTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_GT(bsdfs_.size(), kLanes);
    weights_.fill(1.0);
    for (size_t i = 0; i < weights_.size(); i += 3) weights_[i] = 4.0;
    histogram_.emplace(weights_);
    lobes_.add({.axis = at_angle(kFrame, 0.5f), .square_radius = 0.01f, .share = 1.0f});
  }

  /// Largest differences to evaluate_bsdf: densities, and what is reflected.
  struct Differences {
    float of_pdf = 0.0f, of_light = 0.0f;
  };
  Differences differences(bool is_guided, float planted_weight) {
    Differences largest;
    for (size_t first = 0; first < bsdfs_.size(); first += kLanes)
      compare(std::span(bsdfs_).subspan(first, std::min(kLanes, bsdfs_.size() - first)), is_guided, planted_weight,
              largest);
    return largest;
  }

  void compare(std::span<Bsdf> bsdfs, bool is_guided, float planted_weight, Differences& largest) {
    BsdfLanes lanes;
    DirectionGuideLanes guides;
    for (size_t lane = 0; lane < bsdfs.size(); ++lane) {
      Bsdf& bsdf = bsdfs[lane];
      if (is_guided) bsdf.guide = {lane % 2 == 0 ? &*histogram_ : nullptr, lane % 3 == 0 ? nullptr : &lobes_, {}};
      EXPECT_TRUE(lanes.set(lane, bsdf)) << lane;
      guides.set(lane, bsdf.guide);
      bsdf.lobes[0].sample_weight *= planted_weight;
    }
    EXPECT_EQ(static_cast<size_t>(popcount(lanes.is_set())), bsdfs.size());
    Rng rng(3, 0, 0, 0);
    for (int i = 0; i < 4000; ++i) {
      Vec3Lanes wi;
      LaneMask is_asked(false);
      for (size_t lane = 0; lane < bsdfs.size(); ++lane) {
        wi.set(lane, i % 2 == 0 ? equal_area_direction(rng.next_vec2()) : near_mirror(bsdfs[lane], rng.next_vec2()));
        is_asked[lane] = rng.next_float() < 0.8f;
      }
      const BsdfLanes::Evaluation all = lanes.evaluate(wi, is_asked, is_guided ? &guides : nullptr);
      for (size_t lane = 0; lane < kLanes; ++lane) {
        BsdfEvaluation own;
        if (is_asked[lane]) own = evaluate_bsdf(bsdfs[lane], wi.at(lane));
        const bool is_sampled = own.pdf > 0.0f;
        EXPECT_EQ(all.pdf[lane] > 0.0f, is_sampled) << lane;
        const Rgb rough = is_sampled ? own.rough_cos : Rgb(), even = is_sampled ? own.even_cos : Rgb();
        largest.of_pdf = std::max(largest.of_pdf, std::abs(all.pdf[lane] - own.pdf) / std::max(own.pdf, 1e-3f));
        largest.of_light = std::max(
            {largest.of_light, difference(all.rough_cos.at(lane), rough), difference(all.even_cos.at(lane), even)});
      }
    }
  }

  std::vector<Bsdf> bsdfs_ = layered();
  std::array<double, DirectionHistogram::kBins> weights_{};
  std::optional<DirectionHistogram> histogram_;
  DirectionLobes lobes_;
};

constexpr float kTolerance = 1e-3f;

TEST_F(BsdfLanesTest, AreWhatEachIsByItself) {
  const auto [of_pdf, of_light] = differences(false, 1.0f);
  EXPECT_LT(of_pdf, kTolerance);
  EXPECT_LT(of_light, kTolerance);
}

TEST_F(BsdfLanesTest, AreWhatEachIsWithItsGuide) {
  const auto [of_pdf, of_light] = differences(true, 1.0f);
  EXPECT_LT(of_pdf, kTolerance);
  EXPECT_LT(of_light, kTolerance);
}

TEST_F(BsdfLanesTest, TellOtherChancesOfLobesApart) {
  EXPECT_GT(differences(false, 1.05f).of_pdf, 10.0f * kTolerance);  // planted bug
}

TEST_F(BsdfLanesTest, LeaveOtherFormsToOthers) {
  BsdfLanes lanes;
  const auto takes = [&](auto... lobes) {
    Bsdf bsdf = make_bsdf(at_angle(kFrame, 0.5f));
    (add_lobe(bsdf, lobes, kColor, 0.3f), ...);
    return lanes.set(0, bsdf);
  };
  const MicrofacetLobe rough = reflection(0.5f, FresnelModel::NONE);
  EXPECT_FALSE(takes());
  EXPECT_FALSE(takes(LambertLobe{kBent}));
  EXPECT_FALSE(takes(TranslucentLobe{kTestNormal}));
  EXPECT_FALSE(takes(make_oren_nayar(kTestNormal, at_angle(kFrame, 0.5f), 0.5f, kColor)));
  EXPECT_FALSE(takes(rough, reflection(0.3f, FresnelModel::NONE)));
  EXPECT_FALSE(takes(reflection(0.5f, FresnelModel::F82_TINT)));
  for (const auto change : {+[](MicrofacetLobe& lobe) { lobe.transmits = true; },
                            +[](MicrofacetLobe& lobe) { lobe.microfacets = Microfacets::BECKMANN; },
                            +[](MicrofacetLobe& lobe) { lobe.alpha_y = 0.5f; }}) {
    MicrofacetLobe other = rough;
    change(other);
    EXPECT_FALSE(takes(kDiffuse, other));
  }
  MicrofacetLobe refraction = rough;
  refraction.reflects = false;
  EXPECT_FALSE(takes(refraction));
  Bsdf displaced = make_bsdf(at_angle(kFrame, 0.5f));
  displaced.bump_ns = kBent;
  add_diffuse(displaced);
  EXPECT_FALSE(lanes.set(1, displaced));
  EXPECT_TRUE(none_of(lanes.is_set()));
  EXPECT_TRUE(takes(kDiffuse, rough));
  Bsdf even = make_bsdf(at_angle(kFrame, 0.5f));
  add_diffuse(even);
  even.rough_sampling = RoughSampling::COSINE;
  EXPECT_FALSE(lanes.set(1, even));
}

}  // namespace
}  // namespace cistern::test
