#include <gtest/gtest.h>

#include <cmath>

#include "accel/accel_scenes.h"
#include "base/rng.h"
#include "shading/surface_point.h"

namespace cistern {
namespace {

using test::place;

constexpr std::array<float, 4> kAsItIs{1.0f, 0.0f, 0.0f, 0.0f};
/// Tests of chances compare means of this many rays, and fail by chance at most once in 1e7 each.
constexpr int kRays = 40000;
constexpr double kDeviations = 5.7;

struct Splat {
  Vec3 position, scale;
  std::array<float, 4> rotation = kAsItIs;
  float opacity = 1.0f;
};

std::shared_ptr<const Mesh> make_splats(const std::vector<Splat>& splats) {
  std::vector<Vec3> positions, scales;
  std::vector<std::array<float, 4>> rotations, radiance;
  for (const Splat& splat : splats) {
    positions.push_back(splat.position);
    scales.push_back(splat.scale);
    rotations.push_back(splat.rotation);
    radiance.push_back({0.0f, 0.0f, 0.0f, splat.opacity});
  }
  SplatInput input;
  input.name = "garden";
  input.positions = positions, input.scales = scales, input.rotations = rotations, input.radiance = radiance;
  SceneBuilder builder;
  builder.add_splats(input);
  return builder.scene().meshes[0];
}

struct Traced {
  std::shared_ptr<Scene> scene;
  std::shared_ptr<const Accel> accel;

  /// Its number among those that were given.
  uint32_t splat(uint32_t triangle) const { return scene->meshes[0]->vertices[triangle][0]; }
};

Traced trace(std::shared_ptr<const Mesh> mesh, const Transform& object_to_world = {}) {
  const auto scene = test::make_scene();
  scene->meshes = {std::move(mesh)};
  place(*scene, 0, object_to_world);
  return {scene, Accel::build(scene)};
}

/// Nearly the same ray many times: chances are those of the first.
class Beam {
 public:
  explicit Beam(const Ray& ray) : ray_(ray), rng_(11, 0, 0, 0) {}
  Ray next() {
    Ray ray = ray_;
    const auto step = [&] { return 1e-4f * (rng_.next_float() - 0.5f); };
    ray.origin = ray.origin + Vec3{step(), step(), step()};
    return ray;
  }

 private:
  Ray ray_;
  Rng rng_;
};

void expect_chance(int hits, double chance, const char* what) {
  const double deviation = std::sqrt(std::max(chance * (1.0 - chance), 1e-4) / kRays);
  EXPECT_NEAR(static_cast<double>(hits) / kRays, chance, kDeviations * deviation) << what;
}

struct Counts {
  std::array<int, 3> hits{};  // by splat
  int occluded = 0, in_packets = 0;
};

Counts count(const Traced& t, const Ray& along) {
  Counts counts;
  Beam beam(along);
  for (int i = 0; i < kRays; ++i) {
    const Ray ray = beam.next();
    if (const auto hit = t.accel->intersect(ray, kVisibleToCamera)) ++counts.hits[t.splat(hit->triangle)];
    counts.occluded += t.accel->occluded(ray) ? 1 : 0;
  }
  for (int i = 0; i < kRays; i += static_cast<int>(kLanes)) {
    RayLanes rays;
    for (size_t k = 0; k < kLanes; ++k) rays.set(k, beam.next());
    counts.in_packets += popcount(t.accel->occluded(rays, kVisibleToShadow));
  }
  return counts;
}

TEST(Splats, AreMetWhereTheyAreDensestByChance) {
  // Turned a quarter about z: its deviations are 1 along y and 0.5 along x.
  const float half = 0.25f * static_cast<float>(M_PI);
  const Traced t =
      trace(make_splats({{{1, 2, 3}, {1.0f, 0.5f, 0.1f}, {std::cos(half), 0.0f, 0.0f, std::sin(half)}, 0.8f}}));
  const Ray along{{1.4f, 2.3f, 10.0f}, {0.0f, 0.0f, -1.0f}};
  const double expected = 0.8 * std::exp(-0.5 * (0.8 * 0.8 + 0.3 * 0.3));
  const Counts counts = count(t, along);
  expect_chance(counts.hits[0], expected, "closest");
  expect_chance(counts.occluded, expected, "any");
  expect_chance(counts.in_packets, expected, "any in packets");
  Beam beam(along);
  for (int i = 0; i < 10; ++i) {
    const Ray ray = beam.next();
    const std::optional<Hit> hit = t.accel->intersect(ray, kVisibleToCamera);
    if (!hit) continue;
    EXPECT_NEAR(hit->t, 7.0f, 1e-3f);
    const SurfacePoint point = make_surface_point(*t.scene, ray, *hit);
    EXPECT_NEAR(point.ng.z, 1.0f, 1e-6f) << "flattest along z";
    EXPECT_NEAR(point.position.z, 3.0f, 1e-4f);
    EXPECT_TRUE(point.is_splat);
  }
}

TEST(Splats, MayBeThinAndFarAway) {
  const Traced t = trace(make_splats({{{1, 2, 3}, {1.0f, 1.0f, 3e-8f}, kAsItIs, 0.9f}}));
  const Vec3 away = normalize(Vec3{0.5f, 0.3f, 1.0f});
  const Counts counts = count(t, {Vec3{1, 2, 3} + 20.0f * away, -away});
  expect_chance(counts.hits[0], 0.9, "closest");
  expect_chance(counts.occluded, 0.9, "any");
}

TEST(Splats, InScaledObjectsAreScaled) {
  const Transform placed{{4, 0, 0}, {0, 2, 0}, {0, 0, 1}, {10, 0, 0}};
  const Traced t = trace(make_splats({{{1, 2, 3}, {1.0f, 0.5f, 0.1f}}}), placed);
  const double expected = std::exp(-0.5 * (0.25 + 1.0));
  expect_chance(count(t, {{16.0f, 5.0f, 10.0f}, {0.0f, 0.0f, -1.0f}}).hits[0], expected, "closest");
}

TEST(Splats, CoverEachOtherInTheOrderOfTheirDensestPlaces) {
  // The second comes first, and both are where the other's box is.
  const Traced t = trace(make_splats({{{0, 0, 0}, {1, 1, 1}, kAsItIs, 0.5f},
                                      {{0, 0, 0.5f}, {1, 1, 1}, kAsItIs, 0.4f},
                                      {{0, 0, -0.5f}, {1, 1, 1}, kAsItIs, 0.9f}}));
  const Counts counts = count(t, {{0.0f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}});
  expect_chance(counts.hits[1], 0.4, "first");
  expect_chance(counts.hits[0], 0.6 * 0.5, "second");
  expect_chance(counts.hits[2], 0.3 * 0.9, "third");
  expect_chance(counts.occluded, 1.0 - 0.6 * 0.5 * 0.1, "any");
}

TEST(Splats, InOnePlaceDecideByThemselves) {
  const Splat splat{{0, 0, 0}, {1, 1, 1}, kAsItIs, 0.5f};
  const Counts counts = count(trace(make_splats({splat, splat})), {{0.0f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}});
  expect_chance(counts.occluded, 0.75, "any of both");
}

TEST(Splats, EndWhereTheirOpacityWouldBeAHundredth) {
  const Traced t = trace(make_splats({{{0, 0, 0}, {1, 1, 1}}}));
  const float radius = std::sqrt(2.0f * std::log(100.0f));
  EXPECT_GT(count(t, {{radius - 0.01f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}}).hits[0], 200);
  EXPECT_EQ(count(t, {{radius + 0.01f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}}).hits[0], 0);
}

TEST(Splats, LieWithinTheirBoxes) {
  // Long and thin, tilted about x by 20 and then about z by 30 degrees, seen across at two and a half deviations of its
  // short axes: boxes reach 5.8, and cut what is beyond by no more than a hash can tell.
  const float a = 0.5f * 0.349f, b = 0.5f * 0.524f;
  const std::array<float, 4> turn{std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(a) * std::sin(b),
                                  std::cos(a) * std::sin(b)};
  const Traced t = trace(make_splats({{{0, 0, 0}, {0.01f, 0.02f, 1.0f}, turn}}));
  const Gaussian& gaussian = t.scene->meshes[0]->splats->gaussians[0];
  const Vec3 x = normalize(gaussian.row_x), y = normalize(gaussian.row_y), z = normalize(gaussian.row_z);
  EXPECT_NEAR(z.x, std::sin(0.349f) * std::sin(0.524f), 1e-3f);
  EXPECT_NEAR(z.y, -std::sin(0.349f) * std::cos(0.524f), 1e-3f);
  EXPECT_NEAR(z.z, std::cos(0.349f), 1e-3f);
  for (const auto& [along, off, off_deviations] : {std::tuple{x, y, 0.02f}, std::tuple{y, x, 0.01f}}) {
    const Vec3 place = 0.7f * z + 2.5f * off_deviations * off;
    // Beams are as wide as 0.0001, over which the chance changes by at most 1.3 %.
    const double expected = std::exp(-0.5 * (0.7 * 0.7 + 2.5 * 2.5));
    const double found = count(t, {place - along, along}).hits[0] / static_cast<double>(kRays);
    EXPECT_NEAR(found, expected, kDeviations * std::sqrt(expected / kRays) + 0.013 * expected);
  }
}

TEST(Splats, MayBeMetWhereTheirChanceIsNotZero) {
  const Traced t = trace(make_splats({{{0, 0, 0}, {1, 1, 1}, kAsItIs, 0.02f}}));
  Ray through{{0.0f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}};
  const Ray past{{1.3f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}};
  EXPECT_TRUE(t.accel->has_splats());
  EXPECT_TRUE(t.accel->may_meet_splats(through));
  EXPECT_FALSE(t.accel->may_meet_splats(past)) << "the radius is 1.18";
  RayLanes rays;
  rays.set(0, through);
  rays.set(1, past);
  EXPECT_TRUE(t.accel->may_meet_splats(rays)[0]);
  EXPECT_FALSE(t.accel->may_meet_splats(rays)[1]);
  through.t_max = 9.0f;
  EXPECT_FALSE(t.accel->may_meet_splats(through)) << "it is densest beyond";
  through.t_max = INFINITY;
  through.leaves = {0, 0};
  EXPECT_FALSE(t.accel->may_meet_splats(through));
  EXPECT_FALSE(t.accel->occluded_but_for_panes(Ray{{0.0f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}}));
}

TEST(Splats, AreNotMetByRaysThatLeaveThem) {
  const Traced t = trace(make_splats({{{0, 0, 0}, {1, 1, 1}}, {{0, 0, 5}, {1, 1, 1}}}));
  ASSERT_EQ(t.splat(0), 0u);
  Ray ray{{0.0f, 0.0f, -0.5f}, {0.0f, 0.0f, 1.0f}};
  EXPECT_EQ(count(t, ray).hits[0], kRays) << "of opacity 1";
  ray.leaves = {0, 0};
  const Counts counts = count(t, ray);
  EXPECT_EQ(counts.hits[0], 0);
  EXPECT_EQ(counts.hits[1], kRays);
  EXPECT_EQ(counts.occluded, kRays);
  EXPECT_EQ(counts.in_packets, kRays);
  ray.t_max = 4.0f;
  EXPECT_EQ(count(t, ray).occluded, 0);
  EXPECT_EQ(count(t, ray).in_packets, 0);
  ray.leaves = {1, 0};
  EXPECT_EQ(count(t, ray).occluded, kRays) << "of another instance";
  ray.passes = {0, 0};
  EXPECT_EQ(count(t, ray).occluded, 0);
}

TEST(Splats, TheSameRayMeetsTheSame) {
  const Traced t = trace(make_splats({{{0, 0, 0}, {1, 1, 1}, kAsItIs, 0.5f}}));
  Beam beam({{0.0f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}});
  for (int i = 0; i < 100; ++i) {
    const Ray ray = beam.next();
    EXPECT_EQ(t.accel->intersect(ray, kVisibleToCamera).has_value(), t.accel->occluded(ray));
  }
}

}  // namespace
}  // namespace cistern
