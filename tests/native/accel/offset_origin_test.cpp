#include <gtest/gtest.h>

#include <array>

#include "accel_scenes.h"

namespace cistern::test {
namespace {

/// Rays that leave triangles of a given size at a given distance from the origin, about 1 in 2 to each side; how many
/// hit the triangle they left. `offset` moves their origin.
template <class Offset>
int count_self_hits(float size, float distance, bool keep_instances, const Offset& offset) {
  Rng rng(1, 0, 0, 0);
  constexpr int kTriangles = 40, kRaysPerTriangle = 100;
  int self_hits = 0;
  for (int i = 0; i < kTriangles; ++i) {
    const std::shared_ptr<Scene> scene = make_scene();
    scene->meshes = {random_triangles(rng, 1, keep_instances ? 0.0f : distance, size)};
    place(*scene, 0, keep_instances ? random_transform(rng, {1.0f, 1.0f, 1.0f}, distance) : Transform{});
    const std::shared_ptr<const Accel> accel = Accel::build(scene, {}, keep_instances);
    const Transform& m = scene->instances[0].object_to_world;
    const std::vector<Vec3>& p = scene->meshes[0]->positions;
    const Vec3 p0 = m.point(p[0]), edge_1 = m.point(p[1]) - p0, edge_2 = m.point(p[2]) - p0;
    const Vec3 normal = normalize(cross(edge_1, edge_2));
    for (int k = 0; k < kRaysPerTriangle; ++k) {
      const Vec2 uv = square_to_triangle(rng.next_vec2());
      const Vec3 position = p0 + uv.x * edge_1 + uv.y * edge_2;
      const Vec3 direction = random_direction(rng);
      self_hits += accel->intersect({offset(position, normal, direction), direction}, kVisibleToAll) ? 1 : 0;
    }
  }
  return self_hits;
}

struct Case {
  float size, distance;
};
constexpr std::array<Case, 9> kCases{{{1e-3f, 0.0f},
                                      {1e-3f, 1.0f},
                                      {1.0f, 0.0f},
                                      {1.0f, 10.0f},
                                      {1.0f, 1e4f},
                                      {100.0f, 100.0f},
                                      {1e3f, 0.0f},
                                      {1e5f, 0.0f},
                                      {1e5f, 1e5f}}};

TEST(OffsetOrigin, RaysDoNotHitTheSurfaceTheyLeave) {
  for (const Case& c : kCases) {
    for (const bool keep_instances : {false, true}) {
      EXPECT_EQ(count_self_hits(c.size, c.distance, keep_instances, offset_origin), 0)
          << "size " << c.size << ", distance " << c.distance << ", instanced " << keep_instances;
    }
  }
}

TEST(OffsetOrigin, PlantedBugWithoutOffsetIsSeen) {
  const auto no_offset = [](Vec3 position, Vec3, Vec3) { return position; };
  for (const Case& c : kCases) EXPECT_GT(count_self_hits(c.size, c.distance, false, no_offset), 100) << c.size;
}

TEST(OffsetOrigin, PlantedBugOnTheWrongSideIsSeen) {
  const auto wrong_side = [](Vec3 p, Vec3 n, Vec3 d) { return offset_origin(p, n, -d); };
  EXPECT_GT(count_self_hits(1.0f, 0.0f, false, wrong_side), 1000);
}

TEST(OffsetOrigin, MovesLittle) {
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = random_point(rng, i % 2 == 0 ? 0.1f : 1000.0f);
    const Vec3 n = random_direction(rng);
    EXPECT_LT(length(offset_origin(p, n, n) - p), 1e-4f * std::max(0.2f, length(p)));
    EXPECT_GT(dot(offset_origin(p, n, n) - p, n), 0.0f);
    EXPECT_LT(dot(offset_origin(p, n, -n) - p, n), 0.0f);
  }
}

}  // namespace
}  // namespace cistern::test
