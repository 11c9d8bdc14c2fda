#include <gtest/gtest.h>

#include <limits>

#include "accel/accel_scenes.h"
#include "scene/strand_curve.h"
#include "shading/surface_point.h"

namespace cistern {
namespace {

using test::place;

/// Strands of these keys; radii fall evenly from `root` to `tip`.
std::shared_ptr<const Mesh> make_strands(const std::vector<std::vector<Vec3>>& strands, float root, float tip,
                                         StrandShape shape = StrandShape::SPLINES) {
  std::vector<Vec3> positions;
  std::vector<float> radii;
  std::vector<int32_t> offsets{0};
  for (const std::vector<Vec3>& keys : strands) {
    for (size_t k = 0; k < keys.size(); ++k) {
      positions.push_back(keys[k]);
      radii.push_back(lerp(root, tip, static_cast<float>(k) / static_cast<float>(keys.size() - 1)));
    }
    offsets.push_back(static_cast<int32_t>(positions.size()));
  }
  SceneBuilder builder;
  StrandInput input;
  input.name = "hair";
  input.positions = positions, input.radii = radii, input.strand_offsets = offsets;
  input.shape = shape;
  builder.add_strands(input);
  return builder.scene().meshes[0];
}

std::vector<Vec3> straight(float length, int keys) {
  std::vector<Vec3> result;
  for (int k = 0; k < keys; ++k)
    result.push_back({0.0f, 0.0f, length * static_cast<float>(k) / static_cast<float>(keys - 1)});
  return result;
}

struct Traced {
  std::shared_ptr<Scene> scene;
  std::shared_ptr<const Accel> accel;
};

Traced trace(std::shared_ptr<const Mesh> mesh, const Transform& object_to_world = {}) {
  const auto scene = test::make_scene();
  scene->meshes = {std::move(mesh)};
  place(*scene, 0, object_to_world);
  return {scene, Accel::build(scene)};
}

void expect_near(Vec3 found, Vec3 expected, float tolerance) {
  EXPECT_NEAR(found.x, expected.x, tolerance);
  EXPECT_NEAR(found.y, expected.y, tolerance);
  EXPECT_NEAR(found.z, expected.z, tolerance);
}

TEST(Strands, OfBallsAreSpheresAboutEachKey) {
  const Transform doubled{{2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {}};
  const Traced t =
      trace(make_strands({{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 0}, {0, 2, 0}}}, 0.1f, 0.2f, StrandShape::BALLS), doubled);
  const Ray ray{{2.2f, 0.0f, 3.0f}, {0.0f, 0.0f, -1.0f}};
  const std::optional<Hit> hit = t.accel->intersect(ray, kVisibleToCamera);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->triangle, 1u);
  const float height = std::sqrt(0.4f * 0.4f - 0.2f * 0.2f);
  EXPECT_NEAR(hit->t, 3.0f - height, 1e-5f);
  const SurfacePoint point = make_surface_point(*t.scene, ray, *hit);
  expect_near(point.position, {2.2f, 0.0f, height}, 1e-5f);
  expect_near(point.ns, {0.5f, 0.0f, height / 0.4f}, 1e-4f);
  EXPECT_FALSE(t.accel->intersect({{2.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}}, kVisibleToCamera)) << "from the inside";
  EXPECT_FALSE(t.accel->intersect({{1.0f, 0.0f, 3.0f}, {0.0f, 0.0f, -1.0f}}, kVisibleToCamera)) << "between keys";
}

TEST(Strands, AStraightOneIsACylinder) {
  const Traced t = trace(make_strands({straight(3.0f, 4)}, 0.1f, 0.1f));
  for (const float x : {-0.09f, 0.0f, 0.05f}) {
    const Ray ray{{x, -1.0f, 1.25f}, {0.0f, 1.0f, 0.0f}};
    const std::optional<Hit> hit = t.accel->intersect(ray, kVisibleToCamera);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->t, 1.0f - std::sqrt(0.01f - x * x), 1e-4f);
    EXPECT_EQ(hit->triangle, 1u);
    EXPECT_NEAR(hit->u, 0.25f, 1e-3f);
    const SurfacePoint point = make_surface_point(*t.scene, ray, *hit);
    const Vec3 normal{10.0f * x, -std::sqrt(1.0f - 100.0f * x * x), 0.0f};
    expect_near(point.ns, normal, 2e-3f);
    expect_near(point.position, 0.1f * normal + Vec3{0.0f, 0.0f, 1.25f}, 2e-4f);
    EXPECT_FALSE(point.is_backface);
  }
  EXPECT_FALSE(t.accel->intersect({{0.11f, -1.0f, 1.25f}, {0.0f, 1.0f, 0.0f}}, kVisibleToCamera));
  EXPECT_TRUE(t.accel->occluded({{0.0f, -1.0f, 1.0f}, {0.0f, 1.0f, 0.0f}}));
}

TEST(Strands, OnlyTheOutsideIsSeen) {
  const Traced t = trace(make_strands({straight(3.0f, 4)}, 0.1f, 0.1f));
  const Ray from_inside{{0.0f, 0.0f, 1.3f}, {0.0f, 1.0f, 0.0f}};
  EXPECT_FALSE(t.accel->intersect(from_inside, kVisibleToCamera));
  EXPECT_FALSE(t.accel->occluded(from_inside));
  RayLanes rays;
  rays.set(0, from_inside);
  rays.set(1, {{0.0f, -1.0f, 1.3f}, {0.0f, 1.0f, 0.0f}});
  const LaneMask is_occluded = t.accel->occluded(rays, kVisibleToShadow);
  EXPECT_FALSE(is_occluded[0]);
  EXPECT_TRUE(is_occluded[1]);
}

TEST(Strands, PassThroughTheirKeysAlongACatmullRomSpline) {
  const std::vector<Vec3> keys{{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 1.0f}, {2.0f, 0.0f, 1.0f}};
  const auto mesh = make_strands({keys, keys}, 0.05f, 0.02f);
  ASSERT_EQ(mesh->triangle_count(), 6u);
  for (size_t i = 0; i < 6; ++i) {
    const StrandSegment segment = strand_segment(*mesh, i);
    expect_near(segment.center(0.0f), keys[i % 3], 1e-6f);
    expect_near(segment.center(1.0f), keys[i % 3 + 1], 1e-6f);
  }
  // half way: (-p0 + 9 p1 + 9 p2 - p3) / 16, the last key counting twice where the strand ends
  expect_near(strand_segment(*mesh, 1).center(0.5f), {1.0f, 0.0f, 0.5f}, 1e-6f);
  expect_near(strand_segment(*mesh, 3).center(0.5f), {0.5f, 0.0f, -1.0f / 16.0f}, 1e-6f);
  EXPECT_NEAR(strand_segment(*mesh, 1).radius(0.5f), 0.035f, 1e-6f);
  const Traced t = trace(mesh);
  const std::optional<Hit> hit = t.accel->intersect({{0.5f, -1.0f, -1.0f / 16.0f}, {0.0f, 1.0f, 0.0f}}, kVisibleToAll);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->u, 0.5f, 1e-3f);
  EXPECT_EQ(hit->triangle % 3, 0u);
}

TEST(Strands, StraightOnesDoNotBend) {
  const std::vector<Vec3> keys{{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 1.0f}};
  const auto mesh = make_strands({keys, keys}, 0.05f, 0.05f, StrandShape::LINES);
  expect_near(strand_segment(*mesh, 2).center(0.5f), {0.5f, 0.0f, 0.0f}, 0.0f);
  const Traced t = trace(mesh);
  for (const Vec3 middle : {Vec3{0.5f, 0.0f, 0.0f}, Vec3{1.0f, 0.0f, 0.5f}}) {
    const Ray ray{middle - Vec3{0.0f, 1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}};
    const std::optional<Hit> hit = t.accel->intersect(ray, kVisibleToAll);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->t, 0.95f, 1e-4f);
    EXPECT_NEAR(hit->u, 0.5f, 1e-3f);
    expect_near(make_surface_point(*t.scene, ray, *hit).ns, {0.0f, -1.0f, 0.0f}, 1e-3f);
  }
  const bool is_equal = is_same_mesh(*mesh, *make_strands({keys, keys}, 0.05f, 0.05f));
  EXPECT_FALSE(is_equal);
  EXPECT_TRUE(is_same_mesh(*mesh, *make_strands({keys, keys}, 0.05f, 0.05f, StrandShape::LINES)));
  EXPECT_FALSE(is_same_mesh(*mesh, *make_strands({keys, keys}, 0.06f, 0.05f, StrandShape::LINES)));
}

TEST(Strands, ObjectsBeyondAllScaleAreLeftOut) {
  const auto scene = test::make_scene();
  scene->meshes = {make_strands({straight(3.0f, 4)}, 0.1f, 0.1f)};
  place(*scene, 0, {{1e-20f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, {}});
  EXPECT_FALSE(Accel::build(scene)->intersect({{0.0f, -1.0f, 1.0f}, {0.0f, 1.0f, 0.0f}}, kVisibleToCamera));
}

TEST(Strands, PointsAreOnTheSurfaceUnderAnyTransform) {
  Rng rng(7, 0, 0, 0);
  for (const Vec3 stretch : {Vec3{1.0f, 1.0f, 1.0f}, Vec3{-2.0f, 2.0f, 2.0f}, Vec3{0.5f, 1.0f, 3.0f}}) {
    const Transform object_to_world = test::random_transform(rng, stretch, 5.0f);
    const Traced t = trace(make_strands({straight(1.0f, 5)}, 0.01f, 0.01f), object_to_world);
    const Transform to_object = inverse(object_to_world);
    int found = 0;
    for (int i = 0; i < 1000; ++i) {
      const Vec3 target = object_to_world.point({0.0f, 0.0f, rng.next_float()});
      const Vec3 direction = test::random_direction(rng);
      const Ray ray{target - 3.0f * direction, direction};
      const std::optional<Hit> hit = t.accel->intersect(ray, kVisibleToCamera);
      if (!hit) continue;
      ++found;
      const SurfacePoint point = make_surface_point(*t.scene, ray, *hit);
      const Vec3 p = to_object.point(point.position);
      EXPECT_NEAR(std::hypot(p.x, p.y), 0.01f, 1e-5f);
      EXPECT_LT(length(point.position - (ray.origin + hit->t * ray.direction)), 1e-3f);
      EXPECT_GE(dot(point.ng, point.wo), 0.0f);
    }
    EXPECT_GT(found, 950);
  }
}

/// Rays that leave a convex strand, outwards or through its inside, meet nothing.
TEST(Strands, RaysThatLeaveDoNotMeetTheStrandAgain) {
  Rng rng(8, 0, 0, 0);
  for (const float radius : {1e-5f, 1e-3f, 0.1f}) {
    const Traced t = trace(make_strands({straight(1.0f, 9)}, radius, radius));
    int points = 0, outwards = 0, inwards = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 direction = test::random_direction(rng);
      const Vec3 target{0.0f, 0.0f, 0.1f + 0.8f * rng.next_float()};
      const Ray ray{target - 2.0f * direction, direction};
      const std::optional<Hit> hit = t.accel->intersect(ray, kVisibleToCamera);
      if (!hit) continue;
      ++points;
      const SurfacePoint point = make_surface_point(*t.scene, ray, *hit);
      Vec3 wi = test::random_direction(rng);
      if (dot(wi, point.ng) < 0.0f) wi = -wi;
      outwards += t.accel->occluded({offset_origin(point.position, point.clearance, point.ng, wi), wi});
      inwards += t.accel->occluded({offset_origin(point.position, point.clearance, point.ng, -wi), -wi});
    }
    EXPECT_GT(points, 15000) << radius;
    EXPECT_LE(outwards, points / 1000) << radius;
    EXPECT_LE(inwards, points / 1000) << radius;
  }
}

TEST(Strands, BadOnesAreLeftOut) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Vec3> positions{{0, 0, 0},   {0, 0, 1}, {1, 0, 0}, {2, 0, 0},
                                    {2, nan, 1}, {2, 0, 2}, {3, 0, 0}, {3, 0, 1}};
  const std::vector<float> radii{0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, -0.1f, 0.0f};
  const std::vector<int32_t> offsets{0, 2, 2, 3, 6, 8};  // of two keys, none, one, three (one not finite), two
  const std::vector<int32_t> slots{0, 1, 2, 3, 4};
  StrandInput input;
  input.name = "hair";
  input.positions = positions, input.radii = radii, input.strand_offsets = offsets, input.material_indices = slots;
  SceneBuilder builder;
  builder.add_strands(input);
  const Mesh& mesh = *builder.scene().meshes[0];
  EXPECT_EQ(mesh.triangle_count(), 2u);
  EXPECT_EQ(mesh.dropped_triangles, 2u);
  EXPECT_EQ(mesh.polygons, (std::vector<uint32_t>{0, 4}));
  EXPECT_EQ(mesh.material_slots, (std::vector<uint16_t>{0, 4}));
  EXPECT_EQ(mesh.radii[6], 0.0f);
  const Traced t = trace(builder.scene().meshes[0]);
  EXPECT_TRUE(t.accel->occluded({{0.0f, -1.0f, 0.5f}, {0.0f, 1.0f, 0.0f}}));
  EXPECT_FALSE(t.accel->occluded({{1.0f, -1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}}));
}

/// Straight, at one place, there and back, with keys that repeat, at random, and without width at every other key.
StrandInput degenerate_strands(Rng& rng, float size, float radius, std::vector<Vec3>& positions,
                               std::vector<float>& radii, std::vector<int32_t>& offsets) {
  offsets = {0};
  for (int strand = 0; strand < 6; ++strand) {
    const Vec3 direction = test::random_direction(rng);
    for (int k = 0; k < 5; ++k) {
      const float along[] = {static_cast<float>(k), 0.0f, static_cast<float>(k % 2), static_cast<float>(k / 2)};
      positions.push_back(strand < 4 ? (size * along[strand]) * direction : test::random_point(rng, size));
      radii.push_back(strand == 5 ? radius * static_cast<float>(k % 2) : radius);
    }
    offsets.push_back(static_cast<int32_t>(positions.size()));
  }
  StrandInput input;
  input.name = "hair";
  input.positions = positions, input.radii = radii, input.strand_offsets = offsets;
  return input;
}

/// Embree goes on, and what it finds are numbers.
void expect_harmless(const StrandInput& input, Rng& rng, float size) {
  SceneBuilder builder;
  builder.add_strands(input);
  const Traced t = trace(builder.scene().meshes[0]);
  for (int i = 0; i < 200; ++i) {
    const Ray ray{test::random_point(rng, i % 2 == 0 ? 3.0f : std::min(size, 1e15f)), test::random_direction(rng)};
    const std::optional<Hit> hit = t.accel->intersect(ray, kVisibleToCamera);
    t.accel->occluded(ray);
    if (!hit) continue;
    const SurfacePoint point = make_surface_point(*t.scene, ray, *hit);
    EXPECT_TRUE(std::isfinite(hit->t) && std::isfinite(length(point.ng))) << size;
  }
}

TEST(Strands, DegenerateOnesDoNoHarm) {
  Rng rng(9, 0, 0, 0);
  for (const StrandShape shape : {StrandShape::SPLINES, StrandShape::LINES, StrandShape::BALLS}) {
    for (const float size : {0.0f, 1e-30f, 1e-12f, 1e-3f, 1.0f, 1e6f, 1e12f, 1e20f, 1e37f}) {
      for (const float radius : {0.0f, 1e-30f, 1e-6f, 1.0f, 1e10f, 1e30f}) {
        std::vector<Vec3> positions;
        std::vector<float> radii;
        std::vector<int32_t> offsets;
        StrandInput input = degenerate_strands(rng, size, radius, positions, radii, offsets);
        input.shape = shape;
        expect_harmless(input, rng, size);
      }
    }
  }
}

}  // namespace
}  // namespace cistern
