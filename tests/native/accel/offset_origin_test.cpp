#include <gtest/gtest.h>

#include <array>

#include "accel_scenes.h"

namespace cistern::test {
namespace {

struct Case {
  float size, distance;         // of the triangle, and of it from the origin, in metres
  bool is_instance = false;     // placed there by an instance's matrix, rotated
  bool is_local_far = false;    // instances: by its own coordinates, which the matrix takes back: it is at the origin
  bool is_near_origin = false;  // rays leave where the triangle, moved there, passes the origin
};

/// Rays that leave triangles, about 1 in 2 to each side; how many hit the triangle they left. `offset` moves their
/// origin, of (position, reach, ng, direction).
template <class Offset>
int count_self_hits(const Case& c, const Offset& offset) {
  Rng rng(1, 0, 0, 0);
  constexpr int kTriangles = 40, kRaysPerTriangle = 100;
  int self_hits = 0;
  for (int i = 0; i < kTriangles; ++i) {
    const std::shared_ptr<Scene> scene = make_scene();
    const bool is_far_itself = !c.is_instance || c.is_local_far;
    const std::shared_ptr<Mesh> mesh = random_triangles(rng, 1, is_far_itself ? c.distance : 0.0f, c.size);
    Transform matrix = c.is_instance ? random_transform(rng, {1.0f, 1.0f, 1.0f}, c.distance) : Transform{};
    const Vec3 middle = (mesh->positions[0] + mesh->positions[1] + mesh->positions[2]) / 3.0f;
    if (c.is_local_far) matrix.translation = -matrix.vector(middle);
    if (c.is_near_origin)
      for (Vec3& p : mesh->positions) p = p - middle;
    scene->meshes = {mesh};
    place(*scene, 0, matrix);
    const std::shared_ptr<const Accel> accel = Accel::build(scene, {}, c.is_instance);
    const std::array<Vec3, 3> corners = scene->meshes[0]->triangle_positions(0);
    const Vec3 reach = coordinate_reach(matrix, corners);
    const Vec3 normal =
        normalize(cross(matrix.vector(corners[1] - corners[0]), matrix.vector(corners[2] - corners[0])));
    for (int k = 0; k < kRaysPerTriangle; ++k) {
      Vec2 b = square_to_triangle(rng.next_vec2());
      const float spread = c.is_near_origin ? 1.0f / c.size : 1.0f;  // about the middle
      b = {lerp(1.0f / 3.0f, b.x, spread), lerp(1.0f / 3.0f, b.y, spread)};
      const Vec3 position = matrix.point((1.0f - b.x - b.y) * corners[0] + b.x * corners[1] + b.y * corners[2]);
      const Vec3 direction = random_direction(rng);
      self_hits += accel->intersect({offset(position, reach, normal, direction), direction}, kVisibleToAll) ? 1 : 0;
    }
  }
  return self_hits;
}

constexpr std::array<Case, 18> kCases{{
    {1e-5f, 0.0f},
    {1e-3f, 0.0f},
    {1e-3f, 1.0f},
    {1.0f, 0.0f},
    {1.0f, 10.0f},
    {1.0f, 1e4f},
    {100.0f, 100.0f},
    {1e5f, 0.0f},
    {1e5f, 1e5f},
    {1e-3f, 1.0f, true},
    {1.0f, 10.0f, true},
    {1.0f, 1e4f, true},
    {1e5f, 1e5f, true},
    {1.0f, 1e4f, true, true},
    {1e3f, 0.0f, false, false, true},
    {1e5f, 0.0f, false, false, true},
    {1e3f, 0.0f, true, false, true},
    {1e5f, 0.0f, true, false, true},
}};

Vec3 leave(Vec3 position, Vec3 reach, Vec3 ng, Vec3 direction) {
  return offset_origin(position, surface_clearance(reach, ng), ng, direction);
}

TEST(OffsetOrigin, RaysDoNotHitTheSurfaceTheyLeave) {
  for (size_t i = 0; i < kCases.size(); ++i) EXPECT_EQ(count_self_hits(kCases[i], leave), 0) << "case " << i;
}

TEST(OffsetOrigin, PlantedBugWithoutOffsetIsSeen) {
  const auto no_offset = [](Vec3 position, Vec3, Vec3, Vec3) { return position; };
  for (size_t i = 0; i < kCases.size(); ++i) EXPECT_GT(count_self_hits(kCases[i], no_offset), 100) << "case " << i;
}

TEST(OffsetOrigin, PlantedBugOnTheWrongSideIsSeen) {
  const auto wrong_side = [](Vec3 p, Vec3 reach, Vec3 n, Vec3 d) { return leave(p, reach, n, -d); };
  EXPECT_GT(count_self_hits({1.0f, 0.0f}, wrong_side), 1000);
}

/// Large triangles, and objects whose own coordinates cancel with their translation.
TEST(OffsetOrigin, PlantedBugInProportionToThePointAloneIsSeen) {
  const auto by_point = [](Vec3 position, Vec3, Vec3 n, Vec3 d) {
    const Vec3 own = max(position, -position) + Vec3{0.03f, 0.03f, 0.03f};
    return leave(position, own, n, d);
  };
  for (size_t i = 13; i < kCases.size(); ++i) EXPECT_GT(count_self_hits(kCases[i], by_point), 100) << "case " << i;
}

TEST(OffsetOrigin, MovesLittle) {
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random_point(rng, i % 2 == 0 ? 0.1f : 1000.0f);
    const Vec3 n = random_direction(rng), reach = coordinate_reach({}, {p, p, p});
    EXPECT_LT(length(leave(p, reach, n, n) - p), 5e-6f * length(p));
    EXPECT_GT(dot(leave(p, reach, n, n) - p, n), 0.0f);
    EXPECT_LT(dot(leave(p, reach, n, -n) - p, n), 0.0f);
  }
}

/// A level floor of a kilometre keeps the shadows of things a tenth of a millimetre above it.
TEST(OffsetOrigin, AxesThatATriangleIsFlatInDoNotCount) {
  const Vec3 reach =
      coordinate_reach({}, {Vec3{-500.0f, -500.0f, 0.0f}, {500.0f, -500.0f, 0.0f}, {0.0f, 500.0f, 0.0f}});
  EXPECT_LT(surface_clearance(reach, {0.0f, 0.0f, 1.0f}), 1e-4f);
  EXPECT_GT(surface_clearance(reach, normalize({0.0f, 0.3f, 1.0f})), 1e-4f);
}

}  // namespace
}  // namespace cistern::test
