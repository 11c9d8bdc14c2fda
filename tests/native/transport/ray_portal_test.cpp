#include "transport/ray_portal.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "shading/closures.h"

namespace cistern::test {
namespace {

/// Two portals, and what is transparent beside them.
Bsdf window(Rgb straight) {
  Bsdf bsdf;
  bsdf.transparency = straight;
  add_portal(bsdf, {Rgb(0.2f, 0.1f, 0.0f), {1.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}});
  add_portal(bsdf, {Rgb(0.0f, 0.1f, 0.3f), {2.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}});
  return bsdf;
}

TEST(RayPortal, ChoicesAddUpToWhatPasses) {
  for (const Rgb straight : {Rgb(0.3f, 0.0f, 0.1f), Rgb(0.0f)}) {
    const Bsdf bsdf = window(straight);
    Rgb sum;
    float first = 0.0f, nothing = 0.0f;
    constexpr int kSteps = 10000;
    for (int i = 0; i < kSteps; ++i) {
      const PortalChoice choice = choose_portal(bsdf, (static_cast<float>(i) + 0.5f) / kSteps);
      sum += choice.weight * (1.0f / (choice.probability * kSteps));
      if (!choice.portal) nothing += 1.0f / kSteps;
      if (choice.portal == bsdf.portals.data()) first += 1.0f / kSteps;
    }
    EXPECT_NEAR(sum.r, bsdf.transparency.r, 1e-3f);
    EXPECT_NEAR(sum.g, bsdf.transparency.g, 1e-3f);
    EXPECT_NEAR(sum.b, bsdf.transparency.b, 1e-3f);
    EXPECT_NEAR(first, 0.1f / average(bsdf.transparency), 1e-3f);
    EXPECT_NEAR(nothing, average(straight) / average(bsdf.transparency), 1e-3f);
  }
}

TEST(RayPortal, ManyAreLeftOutAndCopiesHaveThemAll) {
  Bsdf bsdf;
  for (int i = 0; i < Bsdf::kMaxPortals + 2; ++i)
    add_portal(bsdf, {Rgb(0.01f), {static_cast<float>(i), 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}});
  const Bsdf copy = bsdf;
  EXPECT_EQ(copy.portal_count, Bsdf::kMaxPortals);
  EXPECT_EQ(copy.portals[Bsdf::kMaxPortals - 1].position.x, static_cast<float>(Bsdf::kMaxPortals - 1));
  EXPECT_NEAR(copy.transparency.g, 0.01f * Bsdf::kMaxPortals, 1e-6f);
}

TEST(RayPortal, ClosuresLeadStraightOnUnlessTheySayOtherwise) {
  SurfacePoint point;
  point.ng = point.ns = point.wo = {0.0f, 0.0f, 1.0f};
  const auto close = [&](Vec3 color, Vec3 direction) {
    Bsdf bsdf;
    bsdf.ng = point.ng;
    bsdf.wo = point.wo;
    const Vec3 inputs[] = {{0.5f, 0.0f, 0.0f}, color, {1.0f, 2.0f, 3.0f}, direction};
    add_closure(bsdf, Op::CLOSURE_RAY_PORTAL, inputs, nullptr, point);
    return bsdf;
  };
  const Bsdf straight = close({1.0f, 0.5f, 0.0f}, {});
  ASSERT_EQ(straight.portal_count, 1);
  EXPECT_EQ(straight.transparency, Rgb(0.5f, 0.25f, 0.0f));
  EXPECT_EQ(straight.portals[0].direction, (Vec3{0.0f, 0.0f, -1.0f}));
  EXPECT_EQ(close({1.0f, 1.0f, 1.0f}, {3.0f, 0.0f, 0.0f}).portals[0].direction, (Vec3{1.0f, 0.0f, 0.0f}));
  EXPECT_EQ(close({}, {}).portal_count, 0);
}

TEST(RayPortal, RaysThatStayWhereTheyAreLeaveTheSurface) {
  SurfacePoint point;
  point.position = {1.0f, 1.0f, 0.0f};
  point.ng = {0.0f, 0.0f, 1.0f};
  point.clearance = 1e-3f;
  const Vec3 down{0.0f, 0.0f, -1.0f};
  EXPECT_EQ(portal_ray(point, {Rgb(1.0f), point.position, down}).origin.z, -1e-3f);
  const Ray moved = portal_ray(point, {Rgb(1.0f), {5.0f, 0.0f, 0.0f}, down});
  EXPECT_EQ(moved.origin, (Vec3{5.0f, 0.0f, 0.0f}));
  EXPECT_EQ(moved.direction, down);
  // From 3e38 m away Embree would end the process.
  EXPECT_EQ(portal_ray(point, {Rgb(1.0f), {3e38f, 0.0f, -3e38f}, down}).origin, (Vec3{1e9f, 0.0f, -1e9f}));
}

}  // namespace
}  // namespace cistern::test
