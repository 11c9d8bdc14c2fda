#include "transport/screen_points.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

namespace cistern::test {
namespace {

constexpr uint32_t kSide = 4, kFrames = 16;  // 256 points in a box of pixels
constexpr uint32_t kGrid = 16;

PathSampler sampler(uint32_t x, uint32_t y, uint32_t frame, const FramePoint& point) {
  return {5, y * 1000 + x, frame, SampleSequence::SOBOL, screen_point(x, y, point)};
}

/// Cells of a square grid with as many cells as the box of pixels at (x, y) has points.
size_t cells_hit(uint32_t x, uint32_t y, uint32_t length, const std::function<Vec2(PathSampler&)>& draw) {
  std::set<uint32_t> cells;
  for (uint32_t i = 0; i < kSide * kSide; ++i)
    for (uint32_t frame = 0; frame < kFrames; ++frame) {
      PathSampler numbers = sampler(x + i % kSide, y + i / kSide, frame, {0, frame, length});
      const Vec2 v = draw(numbers);
      cells.insert(static_cast<uint32_t>(v.y * kGrid) * kGrid + static_cast<uint32_t>(v.x * kGrid));
    }
  return cells.size();
}

TEST(ScreenPoints, PixelsOfABoxAreStratifiedTogether) {
  for (const auto& draw : std::vector<std::function<Vec2(PathSampler&)>>{
           [](PathSampler& s) { return s.filter(); }, [](PathSampler& s) { return s.lens(); },
           [](PathSampler& s) { return s.scattering(0).direction; },
           [](PathSampler& s) { return s.light(0).position; }})
    for (const auto& [x, y] : {std::pair{0u, 0u}, {128u, 64u}, {1020u, 500u}}) {
      EXPECT_EQ(cells_hit(x, y, kFrames, draw), kGrid * kGrid) << x << ' ' << y;
      // Boxes that the curve does not keep together, and pieces that are not used up, look otherwise.
      EXPECT_LT(cells_hit(x + 3, y + 1, kFrames, draw), 250u);
      EXPECT_LT(cells_hit(x, y, 64 * kFrames, draw), 220u);
    }
}

TEST(ScreenPoints, NoTwoPathsShareAPoint) {
  for (const uint32_t length : {1u, 5u, 16u, 1u << 20}) {
    std::set<std::pair<uint64_t, uint32_t>> points;
    for (const auto& [x, y] : {std::pair{0u, 0u}, {7u, 0u}, {0u, 127u}, {128u, 0u}, {70000u, 65536u}})
      for (const uint64_t sequence : {0, 1})
        for (uint32_t frame = 0; frame < 100; ++frame) {  // more than some lengths
          const SequencePoint point = screen_point(x, y, {sequence, frame, length});
          EXPECT_TRUE(points.insert({point.sequence, point.point}).second) << length << ' ' << x << ' ' << frame;
        }
  }
}

/// Neighbours of a block take far points of its sequence: what they draw is not alike. Were it, half of the picture
/// would be correlated with the other; 5 standard deviations of independent numbers.
TEST(ScreenPoints, NeighboursAreNotAlike) {
  double sum = 0.0;
  constexpr uint32_t kWidth = 256;
  for (uint32_t x = 0; x < kWidth; ++x)
    for (uint32_t y = 0; y < kWidth; ++y) {
      const auto value = [&](uint32_t column) {
        return sampler(column, y, 0, {0, 0, 64}).scattering(0).direction.x - 0.5;
      };
      sum += value(x) * value(x + kWidth);
    }
  EXPECT_LT(std::abs(sum) / (kWidth * kWidth), 5.0 / 12.0 / kWidth);
}

}  // namespace
}  // namespace cistern::test
