#include "lights/openings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "base/rng.h"

namespace cistern::test {
namespace {

/// Rays from points all over a box room of 8 x 6 x 3 m through points of a rectangle.
void add_rays(std::vector<EscapedRay>& rays, Rng& rng, Vec3 center, Vec3 half_u, Vec3 half_v, int count) {
  for (int i = 0; i < count; ++i) {
    const Vec2 a = rng.next_vec2(), b = rng.next_vec2();
    const Vec3 origin{8.0f * a.x - 4.0f, 6.0f * a.y - 3.0f, 3.0f * rng.next_float()};
    const Vec3 through = center + (2.0f * b.x - 1.0f) * half_u + (2.0f * b.y - 1.0f) * half_v;
    rays.push_back({origin, normalize(through - origin)});
  }
}

Vec3 turned(Vec3 v, float yaw) {
  return {std::cos(yaw) * v.x - std::sin(yaw) * v.y, std::sin(yaw) * v.x + std::cos(yaw) * v.y, v.z};
}

double share_that_passes(const AreaLight& opening, std::span<const EscapedRay> rays) {
  const auto passing = std::ranges::count_if(rays, [&](const EscapedRay& ray) { return passes(opening, ray); });
  return static_cast<double>(passing) / static_cast<double>(rays.size());
}

float area(const AreaLight& opening) { return length(opening.edge_u) * length(opening.edge_v); }

TEST(Openings, AWindowIsFoundInAnyWall) {
  constexpr float kMetres = 0.15f;  // about a cell
  Rng rng(1, 0, 0, 0);
  for (const float yaw : {0.0f, 0.4f, 1.2f}) {
    for (const int wall : {0, 1, 2}) {  // +x, +y, ceiling
      const Vec3 center = std::array{Vec3{4.1f, 0.5f, 1.6f}, Vec3{-1.0f, 3.1f, 1.6f}, Vec3{1.0f, 0.5f, 3.2f}}[wall];
      const Vec3 half_u = wall == 0 ? Vec3{0, 0.8f, 0} : Vec3{0.8f, 0, 0};
      const Vec3 half_v = wall == 2 ? Vec3{0, 0.5f, 0} : Vec3{0, 0, 0.5f};
      std::vector<EscapedRay> rays;
      add_rays(rays, rng, center, half_u, half_v, 600);
      for (EscapedRay& ray : rays) ray = {turned(ray.origin, yaw), turned(ray.direction, yaw)};
      const std::vector<AreaLight> openings = fit_openings(rays, yaw);
      ASSERT_EQ(openings.size(), 1u) << yaw << " " << wall;
      EXPECT_LT(length(openings[0].center - turned(center, yaw)), kMetres) << yaw << " " << wall;
      EXPECT_NEAR(area(openings[0]), 1.75, 0.2)  // of 1.6: openings are made a little wider
          << yaw << " " << wall;
      EXPECT_LT(dot(openings[0].normal, turned(center, yaw) - turned({0, 0, 1.5f}, yaw)), 0.0f) << "looks inwards";
      EXPECT_GT(share_that_passes(openings[0], rays), 0.97);
    }
  }
}

TEST(Openings, SeveralWindowsAreToldApart) {
  Rng rng(2, 0, 0, 0);
  std::vector<EscapedRay> first, second, skylight;
  add_rays(first, rng, {4.1f, -1.5f, 1.6f}, {0, 0.5f, 0}, {0, 0, 0.6f}, 800);
  add_rays(second, rng, {4.1f, 1.5f, 1.6f}, {0, 0.5f, 0}, {0, 0, 0.6f}, 600);
  add_rays(skylight, rng, {-2.0f, 0.0f, 3.1f}, {0.4f, 0, 0}, {0, 0.4f, 0}, 400);
  std::vector<EscapedRay> all = first;
  all.insert(all.end(), second.begin(), second.end());
  all.insert(all.end(), skylight.begin(), skylight.end());
  const std::vector<AreaLight> openings = fit_openings(all, 0.0f);
  ASSERT_EQ(openings.size(), 3u);
  EXPECT_GT(share_that_passes(openings[0], first), 0.95);  // those of most rays come first
  EXPECT_GT(share_that_passes(openings[1], second), 0.95);
  EXPECT_GT(share_that_passes(openings[2], skylight), 0.95);
  for (const AreaLight& opening : openings) EXPECT_LT(area(opening), 1.5f);
}

TEST(Openings, RaysWithNothingInCommonGiveNoSmallOnes) {
  Rng rng(3, 0, 0, 0);
  std::vector<EscapedRay> rays;
  for (int i = 0; i < 2000; ++i) {
    const Vec2 a = rng.next_vec2();
    Vec3 direction{rng.next_float() - 0.5f, rng.next_float() - 0.5f, rng.next_float()};
    rays.push_back({{10.0f * a.x, 10.0f * a.y, 0.1f * rng.next_float()}, normalize(direction)});
  }
  double small = 0.0;
  for (const AreaLight& opening : fit_openings(rays, 0.0f))
    if (area(opening) < 10.0f) small += share_that_passes(opening, rays);
  EXPECT_LT(small, 0.3);
}

TEST(Openings, NoRaysGiveNone) {
  EXPECT_TRUE(fit_openings({}, 0.0f).empty());
  const std::vector<EscapedRay> same(100, EscapedRay{{1, 2, 3}, {0, 0, 1}});
  EXPECT_TRUE(fit_openings(same, 0.0f).empty());
}

TEST(Openings, RaysPassTowardsTheOutsideAlone) {
  AreaLight opening;
  opening.center = {0, 0, 1};
  opening.edge_u = {2, 0, 0};
  opening.edge_v = {0, 1, 0};
  opening.normal = {0, 0, -1};
  EXPECT_TRUE(passes(opening, {{0.9f, 0.4f, 0}, {0, 0, 1}}));
  EXPECT_FALSE(passes(opening, {{0.9f, 0.6f, 0}, {0, 0, 1}}));
  EXPECT_FALSE(passes(opening, {{0, 0, 2}, {0, 0, -1}}));
  EXPECT_FALSE(passes(opening, {{0, 0, 2}, {0, 0, 1}}));
}

}  // namespace
}  // namespace cistern::test
