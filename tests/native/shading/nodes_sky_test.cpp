#include "shading/nodes_sky.h"

#include <gtest/gtest.h>

namespace cistern::test {
namespace {

Vec3 at_elevation(float elevation) { return {std::cos(elevation), 0.0f, std::sin(elevation)}; }

SunDisc disc_at(float elevation, float half_angle) {
  return {at_elevation(elevation), half_angle, {100, 0, 0}, {0, 100, 0}, elevation - half_angle, elevation + half_angle,
          elevation - half_angle};
}

TEST(SunDisc, ChangesColourFromBottomToTopAndDarkensTowardsTheLimb) {
  const SunDisc disc = disc_at(0.5f, 0.005f);
  const Vec3 sky{1, 2, 3};
  const Vec3 middle = sun_disc_node(disc, at_elevation(0.5f), sky, false);
  EXPECT_NEAR(middle.x, 51.0f, 0.01f);
  EXPECT_NEAR(middle.y, 52.0f, 0.01f);
  EXPECT_FLOAT_EQ(middle.z, 3.0f);
  for (const float r : {-0.99f, -0.5f, 0.5f, 0.9f}) {
    const float limb = 0.4f + 0.6f * std::sqrt(1.0f - r * r);
    const Vec3 seen = sun_disc_node(disc, at_elevation(0.5f + 0.005f * r), {}, false);
    EXPECT_NEAR(seen.x, 50.0f * (1.0f - r) * limb, 0.02f) << r;
    EXPECT_NEAR(seen.y, 50.0f * (1.0f + r) * limb, 0.02f) << r;
  }
}

TEST(SunDisc, LeavesTheSkyAroundItAndBelowTheHorizonAlone) {
  SunDisc disc = disc_at(0.5f, 0.005f);
  const Vec3 sky{1, 2, 3};
  EXPECT_EQ(sun_disc_node(disc, at_elevation(0.5051f), sky, true), sky);
  EXPECT_EQ(sun_disc_node(disc, at_elevation(0.4949f), sky, true), sky);
  EXPECT_EQ(sun_disc_node(disc, {}, sky, true), sky);
  disc.horizon = 0.5f;
  EXPECT_EQ(sun_disc_node(disc, at_elevation(0.499f), sky, true), sky);
  EXPECT_EQ(sun_disc_node(disc, at_elevation(0.5f + 1e-3f), sky, true).z, 0.0f) << "hides the sky";
}

TEST(SunDisc, TakesDirectionsOfAnyLength) {
  const SunDisc disc = disc_at(0.3f, 0.1f);
  const Vec3 d = at_elevation(0.34f);
  const Vec3 of_unit = sun_disc_node(disc, d, {}, false), of_long = sun_disc_node(disc, 7.0f * d, {}, false);
  EXPECT_NEAR(of_long.x, of_unit.x, 1e-3f);
  EXPECT_NEAR(of_long.y, of_unit.y, 1e-3f);
}

}  // namespace
}  // namespace cistern::test
