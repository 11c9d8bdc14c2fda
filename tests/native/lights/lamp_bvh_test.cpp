#include "lights/lamp_bvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "base/rng.h"

namespace cistern {
namespace {

Vec3 random_point(Rng& rng) { return {rng.next_float(), rng.next_float(), rng.next_float()}; }

/// In the unit cube; a third of them flat, a third points.
std::vector<Bounds3> random_boxes(size_t count, Rng& rng) {
  std::vector<Bounds3> boxes(count);
  for (size_t i = 0; i < count; ++i) {
    const Vec3 center = random_point(rng);
    const Vec3 half = random_point(rng) * (i % 3 == 0 ? 0.0f : 0.02f);
    boxes[i].extend(center - half);
    boxes[i].extend(i % 3 == 1 ? Vec3{center.x + half.x, center.y + half.y, center.z - half.z} : center + half);
  }
  return boxes;
}

/// In double precision, of a box that is larger by a margin (m).
bool meets(const Bounds3& box, const Ray& ray, double margin) {
  double enter = ray.t_min, leave = ray.t_max;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.lower[axis] - margin - ray.origin[axis]) / ray.direction[axis];
    const double b = (box.upper[axis] + margin - ray.origin[axis]) / ray.direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

class LampBvhTest : public testing::TestWithParam<size_t> {};

TEST_P(LampBvhTest, FindsEachBoxThatARayCrossesOnceAndFewOthers) {
  Rng rng(GetParam(), 1, 2, 3);
  const std::vector<Bounds3> boxes = random_boxes(GetParam(), rng);
  std::vector<uint32_t> items(boxes.size());
  std::iota(items.begin(), items.end(), 100u);
  const LampBvh bvh(boxes, items);
  EXPECT_EQ(bvh.is_empty(), boxes.empty());
  for (int k = 0; k < 300; ++k) {
    Ray ray;
    ray.origin = random_point(rng) * 3.0f - Vec3{1.0f, 1.0f, 1.0f};
    // Half of the rays go to a box, so that points are met as well.
    const Vec3 aim = k % 2 == 0 || boxes.empty() ? random_point(rng) : boxes[rng.next_uint32() % boxes.size()].center();
    ray.direction = normalize(aim - ray.origin);
    ray.t_min = 0.0f;
    ray.t_max = k % 3 == 0 ? 1.0f : INFINITY;
    std::vector<uint32_t> found;
    bvh.for_each(ray, [&](uint32_t item) { found.push_back(item - 100u); });
    std::sort(found.begin(), found.end());
    EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
    for (uint32_t i = 0; i < boxes.size(); ++i) {
      const bool is_found = std::binary_search(found.begin(), found.end(), i);
      EXPECT_TRUE(is_found || !meets(boxes[i], ray, 0.0));
      EXPECT_TRUE(!is_found || meets(boxes[i], ray, 1e-4));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Counts, LampBvhTest, testing::Values(0, 1, 2, 7, 8, 9, 15, 17, 63, 64, 65, 513, 3000));

TEST(LampBvh, MemoryIsBounded) {
  Rng rng(1, 2, 3, 4);
  const std::vector<Bounds3> boxes = random_boxes(100'000, rng);
  std::vector<uint32_t> items(boxes.size());
  std::iota(items.begin(), items.end(), 0u);
  EXPECT_LT(LampBvh(boxes, items).memory_bytes(), 45u * boxes.size());
}

}  // namespace
}  // namespace cistern
