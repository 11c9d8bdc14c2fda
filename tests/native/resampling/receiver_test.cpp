#include "resampling/receiver.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/warp.h"

namespace cistern::test {
namespace {

constexpr Vec3 kUp{0.0f, 0.0f, 1.0f};

Receiver lambert() { return {{}, kUp, kUp, kUp, Rgb(0.6f), {}, 1.0f, 0.0f}; }
Receiver metal(float alpha, Vec3 wo) { return {{}, kUp, kUp, wo, {}, Rgb(0.9f), alpha, 0.0f}; }

/// Calls `visit` with directions even over the sphere.
template <class Visit>
void for_directions(int count, const Visit& visit) {
  Rng rng(1, 0, 0, 0);
  for (int i = 0; i < count; ++i) {
    const float z = 2.0f * rng.next_float() - 1.0f, phi = 2.0f * kPi * rng.next_float();
    const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
    visit(Vec3{r * std::cos(phi), r * std::sin(phi), z});
  }
}

TEST(Receiver, IsExactForLambert) {
  for (float cosine : {1.0f, 0.5f, 0.1f}) {
    const Response response = respond(lambert(), {std::sqrt(1.0f - cosine * cosine), 0.0f, cosine});
    EXPECT_FLOAT_EQ(response.f_cos.g, 0.6f * kInvPi * cosine);
    EXPECT_FLOAT_EQ(response.pdf, kInvPi * cosine);
  }
}

TEST(Receiver, NothingComesFromBehindItsSide) {
  for_directions(1000, [](Vec3 wi) {
    for (const Receiver& receiver : {lambert(), metal(0.3f, kUp)}) {
      EXPECT_EQ(is_black(respond(receiver, wi).f_cos), wi.z <= 0.0f);
    }
  });
}

// A target of zero where light is reflected loses that light: the mean normal of lobes that lean apart may face away
// from what one of them reflects. Such a surface is two-sided if it lets light through as well, also as clear glass,
// which is no part of the receiver.
TEST(Receiver, IsPositiveWhereverALobeWithANormalOfItsOwnMayReflect) {
  for (const Vec3 side : {kUp, Vec3{}}) {
    for (Receiver receiver : {lambert(), metal(0.3f, kUp)}) {
      receiver.side = side;
      receiver.n = normalize(Vec3{0.8f, 0.0f, 0.6f});
      for_directions(1000, [&](Vec3 wi) {
        if (wi.z <= 0.0f) return;
        EXPECT_FALSE(is_black(respond(receiver, wi).f_cos));
        EXPECT_GT(respond(receiver, wi).pdf, 0.0f);
      });
    }
  }
}

TEST(Receiver, TransmissionTakesLightFromBothSides) {
  Receiver receiver{{}, {}, kUp, kUp, {}, {}, 1.0f, 0.5f};
  for_directions(1000, [&](Vec3 wi) { EXPECT_FALSE(is_black(respond(receiver, wi).f_cos)); });
}

TEST(Receiver, ReflectsNoMoreThanItsAlbedoAndSamplesOnce) {
  constexpr int kDirections = 200000;
  constexpr float kSphere = 4.0f * kPi;
  for (float alpha : {0.1f, 0.4f, 1.0f}) {
    for (const Vec3 wo : {kUp, normalize(Vec3{1.0f, 0.0f, 0.5f})}) {
      double albedo = 0.0, sampled = 0.0;
      for_directions(kDirections, [&](Vec3 wi) {
        const Response response = respond(metal(alpha, wo), wi);
        albedo += response.f_cos.g;
        sampled += response.pdf;
      });
      // The sums have standard errors below 2 %. Rough facets send part of the light and of the samples into each
      // other.
      EXPECT_LT(albedo * kSphere / kDirections, 0.9 * 1.06) << alpha;
      EXPECT_GT(albedo * kSphere / kDirections, 0.9 * 0.3) << alpha;
      EXPECT_LT(sampled * kSphere / kDirections, 1.08) << alpha;
      EXPECT_GT(sampled * kSphere / kDirections, 0.5) << alpha;
    }
  }
}

TEST(Receiver, BlackSurfacesAskForNothing) {
  Receiver receiver = lambert();
  receiver.diffuse = {};
  EXPECT_TRUE(is_black(respond(receiver, kUp).f_cos));
  EXPECT_EQ(respond(receiver, kUp).pdf, 0.0f);
}

}  // namespace
}  // namespace cistern::test
