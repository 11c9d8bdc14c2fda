#include "shading/subsurface.h"

#include <gtest/gtest.h>

#include "base/frame.h"
#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

const Vec3 kNormal = normalize(Vec3{0.3f, -0.2f, 0.9f});
const Frame kFrame(kNormal);

Subsurface below(Rgb albedo, float g = 0.0f) {
  Subsurface subsurface{kNormal, Rgb(1.0f), albedo, Rgb(1.0f, 0.5f, 2.0f)};
  subsurface.anisotropy = g;
  return subsurface;
}

TEST(Subsurface, BrighterMediaScatterMore) {
  for (const float g : {0.0f, 0.4f, 0.9f}) {
    float last = -1.0f;
    for (float albedo = 0.0f; albedo <= 1.0f; albedo += 0.0625f) {
      const SubsurfaceMedium medium = subsurface_medium(below(Rgb(albedo), g));
      const float scatter = medium.single_scatter.g * medium.kept.g;
      EXPECT_GE(scatter, last) << albedo << " " << g;
      EXPECT_LT(medium.single_scatter.g, 1.0f);
      last = scatter;
    }
    EXPECT_EQ(subsurface_medium(below(Rgb(0.0f), g)).kept, Rgb(0.0f));
  }
}

TEST(Subsurface, DarkChannelsKeepLessOfTheLightInPlaceOfScatteringLess) {
  for (const SubsurfaceMethod method : {SubsurfaceMethod::RANDOM_WALK, SubsurfaceMethod::RANDOM_WALK_LEGACY}) {
    Subsurface red = below({0.8f, 0.3f, 0.01f});
    red.method = method;
    const SubsurfaceMedium medium = subsurface_medium(red);
    EXPECT_EQ(medium.single_scatter.b, 0.2f);
    EXPECT_LT(medium.kept.b, 0.5f);
    EXPECT_EQ(medium.kept.r, 1.0f);
    EXPECT_EQ(similar_isotropic(medium).kept, medium.kept);
  }
}

TEST(Subsurface, MeanFreePathsAreInProportionToTheRadius) {
  const Rgb sigma = subsurface_medium(below(Rgb(0.5f))).sigma_t;
  EXPECT_NEAR(sigma.r, 4.0f * kPi, 1e-4f);
  EXPECT_NEAR(sigma.g, 8.0f * kPi, 1e-4f);
  EXPECT_NEAR(sigma.b, 2.0f * kPi, 1e-4f);
  EXPECT_NEAR(subsurface_medium(below(Rgb(0.5f), 0.5f)).sigma_t.r, 8.0f * kPi, 1e-4f);
}

TEST(Subsurface, ADipoleOfSkinHasTheAlbedoItWasMadeFor) {
  // Diffuse reflectance of a dipole with the medium's diffusion length: sigma_tr = 1 / radius, sigma_t' = sigma_t.
  Subsurface skin = below(Rgb(0.3f, 0.6f, 0.9f));
  skin.method = SubsurfaceMethod::RANDOM_WALK_SKIN;
  skin.ior = 1.3f;
  const Rgb sigma = subsurface_medium(skin).sigma_t;
  const double eta = 1.3, fresnel = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
  const double boundary = 4.0 / 3.0 * (1.0 + fresnel) / (1.0 - fresnel);
  const auto reflectance = [&](double sigma_t, double radius) {
    const double length = 1.0 / (radius * sigma_t), albedo = 1.0 - length * length / 3.0;  // sqrt(3 (1 - albedo))
    return 0.5 * albedo * (1.0 + std::exp(-boundary * length)) * std::exp(-length);
  };
  EXPECT_NEAR(reflectance(sigma.r, 1.0), 0.3, 1e-3);
  EXPECT_NEAR(reflectance(sigma.g, 0.5), 0.6, 1e-3);
  EXPECT_NEAR(reflectance(sigma.b, 2.0), 0.9, 1e-3);
  EXPECT_GT(std::abs(reflectance(1.1 * sigma.g, 0.5) - 0.6), 1e-2);  // planted bug: another path
}

TEST(Subsurface, SimilarMediaAbsorbAlike) {
  const SubsurfaceMedium forward = subsurface_medium(below(Rgb(0.3f, 0.6f, 0.9f), 0.8f));
  const SubsurfaceMedium even = similar_isotropic(forward);
  EXPECT_EQ(even.g, 0.0f);
  const Rgb before = forward.sigma_t * (Rgb(1.0f) - forward.single_scatter);
  const Rgb after = even.sigma_t * (Rgb(1.0f) - even.single_scatter);
  EXPECT_NEAR(after.r / before.r, 1.0f, 1e-4f);
  EXPECT_NEAR(after.b / before.b, 1.0f, 1e-3f);
  const Rgb scattered = even.sigma_t * even.single_scatter / (forward.sigma_t * forward.single_scatter);
  EXPECT_NEAR(scattered.g, 0.2f, 1e-5f);  // 1 - g
}

TEST(Subsurface, SmoothBoundariesRefract) {
  Subsurface glassy = below(Rgb(0.5f));
  glassy.ior = 1.5f;
  glassy.alpha = 0.0f;
  for (const float cosine : {1.0f, 0.7f, 0.1f}) {
    const Vec3 wo = kFrame.to_world({std::sqrt(1.0f - cosine * cosine), 0.0f, cosine});
    const auto direction = sample_entry(glassy, wo, 0.2f, {0.4f, 0.7f});
    ASSERT_TRUE(direction);
    const Vec3 local = kFrame.to_local(*direction);
    EXPECT_NEAR(local.x, -std::sqrt(1.0f - cosine * cosine) / 1.5f, 1e-5f);  // Snell's law
    EXPECT_LT(local.z, 0.0f);
  }
  EXPECT_FALSE(sample_entry(glassy, -kNormal, 0.2f, {0.4f, 0.7f}));
}

TEST(Subsurface, HalfOfWhatEntersSkinIsDiffuse) {
  Subsurface skin = below(Rgb(0.5f));
  skin.method = SubsurfaceMethod::RANDOM_WALK_SKIN;
  const Vec3 wo = kFrame.to_world({0.8f, 0.0f, 0.6f});
  Rng rng(31, 0, 0, 0);
  const auto mean_cosine = [&](float lowest_choice) {
    Moments cosine;
    for (int i = 0; i < 20000; ++i) {
      const float u = lowest_choice + 0.5f * rng.next_float();
      cosine.add(-dot(*sample_entry(skin, wo, u, rng.next_vec2()), kNormal));
    }
    return cosine;
  };
  EXPECT_GT(mean_p_value(mean_cosine(0.0f), 2.0 / 3.0), kFalseAlarmRate);
  EXPECT_LT(mean_p_value(mean_cosine(0.5f), 2.0 / 3.0), kFalseAlarmRate);  // planted bug: refracted instead
}

}  // namespace
}  // namespace cistern::test
