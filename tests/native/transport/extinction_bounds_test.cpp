#include "transport/extinction_bounds.h"

#include <gtest/gtest.h>

#include "base/rng.h"

namespace cistern::test {
namespace {

ExtinctionBounds random_bounds(Rng& rng) {
  ExtinctionBounds bounds;
  bounds.blocks = {5, 3, 4};
  for (int i = 0; i < 5 * 3 * 4; ++i) bounds.bound.push_back(rng.next_float());
  bounds.largest = 2.0f;  // larger than any: known for what is outside
  return bounds;
}

/// What the walk should say at a place; not a number within rounding of where blocks meet.
float bound_at(const ExtinctionBounds& bounds, Vec3 place) {
  size_t index = 0;
  bool is_inside = true;
  for (int axis = 0; axis < 3; ++axis) {
    const int size = bounds.blocks[static_cast<size_t>(axis)];
    const float x = place[axis];
    if (std::abs(x - std::round(x)) < 1e-4f) return NAN;
    is_inside &= x > 0.0f && x < static_cast<float>(size);
    if (is_inside) index = index * static_cast<size_t>(size) + static_cast<size_t>(x);
  }
  return is_inside ? bounds.bound[index] : bounds.largest;
}

/// Rays from inside and outside, along axes too, at places all along them.
TEST(BlockWalk, HasTheBoundOfEachPlaceOfARay) {
  Rng rng(1, 0, 0, 0);
  const ExtinctionBounds bounds = random_bounds(rng);
  const auto coordinate = [&] { return 10.0f * rng.next_float() - 3.0f; };
  int checked = 0;
  for (int ray = 0; ray < 2000; ++ray) {
    const Vec3 origin{coordinate(), coordinate(), coordinate()};
    Vec3 direction{coordinate() - 2.0f, coordinate() - 2.0f, coordinate() - 2.0f};
    if (ray % 4 == 1) direction.x = 0.0f;
    if (ray % 8 == 1) direction.z = 0.0f;
    BlockWalk walk(bounds, 3.0f, origin, direction);
    for (float t = 0.0f; t < 4.0f; t += 0.037f) {
      while (walk.end() < t) walk.advance();
      const float expected = bound_at(bounds, origin + t * direction);
      if (std::isnan(expected)) continue;
      ASSERT_EQ(walk.bound(), 3.0f * expected) << "ray " << ray << " at " << t;
      ++checked;
    }
  }
  EXPECT_GT(checked, 100000);
}

TEST(BlockWalk, EndsAfterTheBox) {
  Rng rng(2, 0, 0, 0);
  const ExtinctionBounds bounds = random_bounds(rng);
  BlockWalk walk(bounds, 1.0f, {0.5f, 0.5f, 0.5f}, {1.0f, 0.0f, 0.0f});
  for (int block = 0; block < 5; ++block) {
    EXPECT_FLOAT_EQ(walk.end(), static_cast<float>(block) + 0.5f);
    walk.advance();
  }
  EXPECT_EQ(walk.bound(), bounds.largest);
  EXPECT_TRUE(std::isinf(walk.end()));
  BlockWalk missing(bounds, 1.0f, {-1.0f, -1.0f, 0.5f}, {0.0f, 1.0f, 0.0f});
  EXPECT_EQ(missing.bound(), bounds.largest);
  EXPECT_TRUE(std::isinf(missing.end()));
}

WorldExtinctionBounds random_world(Rng& rng) {
  constexpr size_t kBlocks = WorldExtinctionBounds::kBlocks;
  WorldExtinctionBounds bounds{.middle = {1.0f, -2.0f, 0.5f}, .half_size = 3.0f, .bound = {}};
  for (size_t i = 0; i < WorldExtinctionBounds::kBoxes * kBlocks * kBlocks * kBlocks; ++i)
    bounds.bound.push_back(rng.next_float());
  return bounds;
}

/// Of the smallest box around the place; not a number near where blocks or boxes meet.
float bound_at(const WorldExtinctionBounds& bounds, Vec3 place) {
  constexpr int kBlocks = WorldExtinctionBounds::kBlocks;
  for (int box = 0; box < WorldExtinctionBounds::kBoxes; ++box) {
    const float half_size = std::ldexp(bounds.half_size, box);
    const Vec3 at = (place - bounds.middle) * (0.5f * kBlocks / half_size);
    if (std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) >= 0.5f * kBlocks) continue;
    size_t index = static_cast<size_t>(box);
    for (int axis = 0; axis < 3; ++axis) {
      const float x = at[axis] + 0.5f * kBlocks;
      if (std::abs(x - std::round(x)) < 1e-2f) return NAN;
      index = index * kBlocks + static_cast<size_t>(x);
    }
    return bounds.bound[index];
  }
  return 0.0f;
}

/// Rays of all lengths, from inside of all boxes and from beyond, along axes too.
TEST(WorldBlockWalk, HasTheBoundOfEachPlaceOfARay) {
  Rng rng(3, 0, 0, 0);
  const WorldExtinctionBounds bounds = random_world(rng);
  int checked = 0, ended = 0;
  for (int ray = 0; ray < 2000; ++ray) {
    const float size = std::exp2(26.0f * rng.next_float());
    const auto coordinate = [&] { return 2.0f * rng.next_float() - 1.0f; };
    const Vec3 origin = size * Vec3{coordinate(), coordinate(), coordinate()};
    Vec3 direction{coordinate(), coordinate(), coordinate()};
    if (ray % 4 == 1) direction.x = 0.0f;
    if (ray % 8 == 1) direction.z = 0.0f;
    direction = normalize(direction);
    WorldBlockWalk walk(bounds, origin, direction);
    for (float t = 0.01f; t < 1e9f; t *= 1.2f) {
      for (int step = 0; walk.end() < t; ++step) {
        ASSERT_LT(step, 1000);
        walk.advance();
      }
      const float expected = bound_at(bounds, origin + t * direction);
      if (std::isnan(expected) || walk.end() < 1.001f * t || t < 1.001f * walk.begin()) continue;
      ASSERT_EQ(walk.bound(), expected) << "ray " << ray << " at " << t;
      ++checked;
    }
    ended += std::isinf(walk.end()) && walk.bound() == 0.0f;
  }
  EXPECT_GT(checked, 50000);
  EXPECT_EQ(ended, 2000);
}

}  // namespace
}  // namespace cistern::test
