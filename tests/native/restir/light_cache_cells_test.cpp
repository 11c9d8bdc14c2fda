#include "restir/light_cache_cells.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <set>

#include "base/rng.h"
#include "base/warp.h"
#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr uint32_t kPoints = 20000;
constexpr Vec3 kUp{0.0f, 0.0f, 1.0f};

/// A square of side 1 at z = 0 and one of side 2 at z = 1, of which an instance at z = 2 is 1.5 times as large.
std::shared_ptr<const Scene> three_squares() {
  PathScene scene;
  const int paint = scene.diffuse(0.5f);
  scene.floor(0.0f, 1.0f, paint);
  Instance larger = scene.floor(1.0f, 2.0f, paint);
  larger.object_to_world = {{1.5f, 0, 0}, {0, 1.5f, 0}, {0, 0, 1}, {0, 0, 1}};
  scene.builder.add_instance(larger);
  return scene.builder.snapshot();
}

/// Keys of all occupied cells of the square of a half side at a height, seen from above or below.
std::set<LightCacheKey> keys_of_square(const LightCacheCells& cells, float z, float half, Vec3 normal) {
  std::set<LightCacheKey> keys;
  constexpr int kSteps = 400;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const float x = (static_cast<float>(i % kSteps) + 0.5f) / kSteps,
                y = (static_cast<float>(i / kSteps) + 0.5f) / kSteps;
    keys.insert(cells.key_of({half * (2.0f * x - 1.0f), half * (2.0f * y - 1.0f), z}, normal));
  }
  keys.erase(kNoLightCacheKey);
  return keys;
}

size_t count_points(const LightCacheCells& cells, const std::set<LightCacheKey>& keys) {
  size_t count = 0;
  std::vector<LightCacheCells::SurfacePosition> points;
  for (const LightCacheKey key : keys) {
    cells.points_of(key, kPoints, points);
    count += points.size();
  }
  return count;
}

TEST(LightCacheCells, SpreadsPointsByArea) {
  const auto cells = LightCacheCells::build(*three_squares(), kPoints, 1);
  const double areas[] = {1.0, 4.0, 9.0};
  for (int i = 0; i < 3; ++i) {
    const auto height = static_cast<float>(i);
    for (const Vec3 side : {kUp, -kUp}) {
      const auto keys = keys_of_square(*cells, height, 0.5f * static_cast<float>(i + 1), side);
      EXPECT_NEAR(static_cast<double>(count_points(*cells, keys)), kPoints * areas[i] / 14.0, 2.0) << i;
    }
  }
  EXPECT_GT(std::abs(kPoints / 3.0 - kPoints / 14.0), 100.0) << "planted: as many points on every mesh";
}

TEST(LightCacheCells, PointsLieInTheirCell) {
  const auto cells = LightCacheCells::build(*three_squares(), kPoints, 1);
  std::vector<LightCacheCells::SurfacePosition> points;
  for (const LightCacheKey key : keys_of_square(*cells, 1.0f, 1.0f, -kUp)) {
    cells->points_of(key, 3, points);
    ASSERT_GE(points.size(), 1u);
    ASSERT_LE(points.size(), 3u);
    for (const auto& point : points) {
      ASSERT_EQ(cells->key_of(point.position, point.normal), key);
      ASSERT_LT(point.normal.z, 0.0f);
      ASSERT_NEAR(point.position.z, 1.0f, 1e-5f);
    }
  }
}

TEST(LightCacheCells, AxisAlignedNormalsKeepTheirBin) {
  PathScene scene;
  const int paint = scene.diffuse(0.5f);
  scene.quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, paint);
  scene.quad({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, paint);
  scene.quad({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, paint);
  const auto cells = LightCacheCells::build(*scene.builder.snapshot(), 10 * kPoints, 1);
  constexpr float kNoise = 0.05f;
  Rng rng(1, 0, 0, 0);
  std::set<LightCacheKey> keys;
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, kUp})
    for (const Vec3 normal : {axis, -axis}) {
      const Vec3 position = Vec3{0.3f, 0.3f, 0.3f} * (Vec3{1, 1, 1} - axis);
      const LightCacheKey key = cells->key_of(position, normal);
      EXPECT_NE(key, kNoLightCacheKey);
      keys.insert(key % LightCacheCells::kNormalBins);
      for (int i = 0; i < 200; ++i)
        ASSERT_EQ(cells->key_of(position, normalize(normal + square_to_sphere(rng.next_vec2()) * kNoise)), key);
    }
  EXPECT_EQ(keys.size(), 6u);
}

TEST(LightCacheCells, KnowsWhereThereIsNothing) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto cells = LightCacheCells::build(*three_squares(), kPoints, 1);
  EXPECT_EQ(cells->key_of({0.0f, 0.0f, 0.5f}, kUp), kNoLightCacheKey);
  EXPECT_EQ(cells->key_of({0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}), kNoLightCacheKey);
  EXPECT_EQ(cells->key_of({kNan, 0.0f, 0.0f}, kUp), kNoLightCacheKey);
  EXPECT_EQ(cells->key_of({}, {}), kNoLightCacheKey);
  EXPECT_NE(cells->key_of({0.0f, 0.0f, 1e9f}, kUp), kNoLightCacheKey) << "above the top: the nearest cell";
  const auto empty = LightCacheCells::build(Scene{}, kPoints, 1);
  ASSERT_NE(empty, nullptr);
  EXPECT_EQ(empty->key_of({}, kUp), kNoLightCacheKey);
  EXPECT_EQ(empty->occupied_cells(), 0u);
}

TEST(LightCacheCells, FlatScenesHaveThickCells) {
  PathScene scene;
  scene.floor(0.0f, 1.0f, scene.diffuse(0.5f));
  const auto cells = LightCacheCells::build(*scene.builder.snapshot(), kPoints, 1);
  const LightCacheKey key = cells->key_of({0.1f, 0.1f, 0.0f}, kUp);
  EXPECT_NE(key, kNoLightCacheKey);
  EXPECT_EQ(cells->key_of({0.1f, 0.1f, 1e-6f}, kUp), key);
  EXPECT_EQ(cells->key_of({0.1f, 0.1f, -1e-6f}, kUp), key);
  EXPECT_GT(cells->cell_size().z, 0.01f);
}

TEST(LightCacheCells, FitsTheSameGeometryOnly) {
  PathScene scene;
  const Instance floor = scene.floor(0.0f, 1.0f, scene.diffuse(0.5f));
  const auto cells = LightCacheCells::build(*scene.builder.snapshot(), 100, 1);
  EXPECT_TRUE(cells->fits(*scene.builder.snapshot()));
  scene.point_lamp({0, 0, 1}, 1.0f);
  EXPECT_TRUE(cells->fits(*scene.builder.snapshot())) << "lights are not geometry";
  Instance moved = floor;
  moved.object_to_world.translation.x = 1e-3f;
  scene.replace_last(moved);
  EXPECT_FALSE(cells->fits(*scene.builder.snapshot()));
  scene.replace_last(floor);
  EXPECT_TRUE(cells->fits(*scene.builder.snapshot()));
  scene.floor(1.0f, 1.0f, 0);
  EXPECT_FALSE(cells->fits(*scene.builder.snapshot()));
}

TEST(LightCacheCells, StopsAndReports) {
  const auto scene = three_squares();
  EXPECT_EQ(LightCacheCells::build(*scene, kPoints, 1, {[] { return true; }}), nullptr);
  std::atomic<float> last{0.0f};
  EXPECT_NE(LightCacheCells::build(*scene, kPoints, 1, {[] { return false; }, [&](float done) { last = done; }}),
            nullptr);
  EXPECT_EQ(last, 1.0f);
}

TEST(LightCacheCells, DoNotDependOnThreads) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 7);
  const auto scene = three_squares();
  const auto expected = LightCacheCells::build(*scene, kPoints, 1);
  const LightCacheKey key = expected->key_of({0.1f, 0.1f, 2.0f}, kUp);
  std::vector<LightCacheCells::SurfacePosition> points, others;
  expected->points_of(key, kPoints, points);
  for (const int threads : {1, 2, 7}) {
    std::shared_ptr<const LightCacheCells> cells;
    tbb::task_arena(threads).execute([&] { cells = LightCacheCells::build(*scene, kPoints, 1); });
    cells->points_of(key, kPoints, others);
    ASSERT_EQ(points.size(), others.size());
    for (size_t i = 0; i < points.size(); ++i) ASSERT_EQ(points[i].position, others[i].position);
  }
}

}  // namespace
}  // namespace cistern::test
