#include "transport/path_sampler.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

namespace cistern::test {
namespace {

using Draw = std::function<Vec2(PathSampler&)>;

const std::vector<Draw> kStratified{[](PathSampler& s) { return s.filter(); }, [](PathSampler& s) { return s.lens(); },
                                    [](PathSampler& s) { return s.scattering(0).direction; },
                                    [](PathSampler& s) { return s.light(0).position; },
                                    [](PathSampler& s) {
                                      return Vec2{static_cast<float>(s.light(0).choice), s.scattering(0).lobe};
                                    }};
const Draw kLater = [](PathSampler& s) { return s.scattering(1).direction; };

std::vector<float> numbers(uint64_t seed, uint32_t pixel, uint32_t frame, SampleSequence sequence) {
  PathSampler sampler(seed, pixel, frame, sequence);
  std::vector<float> values;
  const auto keep = [&](Vec2 v) { values.insert(values.end(), {v.x, v.y}); };
  for (const Draw& draw : kStratified) keep(draw(sampler));
  for (int vertex = 1; vertex < 4; ++vertex) {
    keep(sampler.light(vertex).position);
    keep(sampler.scattering(vertex).direction);
  }
  values.push_back(sampler.next_float());
  return values;
}

TEST(PathSampler, IsAFunctionOfSeedPixelAndFrame) {
  for (const SampleSequence sequence : {SampleSequence::SOBOL, SampleSequence::RANDOM}) {
    const std::vector<float> values = numbers(3, 1000, 7, sequence);
    EXPECT_EQ(values, numbers(3, 1000, 7, sequence));
    EXPECT_NE(values, numbers(4, 1000, 7, sequence));
    EXPECT_NE(values, numbers(3, 1001, 7, sequence));
    EXPECT_NE(values, numbers(3, 1000, 8, sequence));
    EXPECT_EQ(std::set<float>(values.begin(), values.end()).size(), values.size()) << "no number twice";
    for (const float value : values) {
      EXPECT_GE(value, 0.0f);
      EXPECT_LT(value, 1.0f);
    }
  }
}

TEST(PathSampler, StratifiedNumbersMayBeAskedInAnyOrder) {
  PathSampler forwards(1, 2, 3, SampleSequence::SOBOL), backwards(1, 2, 3, SampleSequence::SOBOL);
  std::vector<float> a, b;
  for (size_t i = 0; i < kStratified.size(); ++i) a.push_back(kStratified[i](forwards).y);
  for (size_t i = kStratified.size(); i-- > 0;) b.insert(b.begin(), kStratified[i](backwards).y);
  EXPECT_EQ(a, b);
  EXPECT_EQ(forwards.next_float(), backwards.next_float()) << "they draw nothing from the generator";
}

/// Cells of a square grid, as many as frames, that the frames of a pixel fall into.
size_t cells_hit(const Draw& draw, SampleSequence sequence) {
  constexpr uint32_t kSide = 8;
  std::set<uint32_t> cells;
  for (uint32_t frame = 0; frame < kSide * kSide; ++frame) {
    PathSampler sampler(5, 17, frame, sequence);
    const Vec2 v = draw(sampler);
    cells.insert(static_cast<uint32_t>(v.y * kSide) * kSide + static_cast<uint32_t>(v.x * kSide));
  }
  return cells.size();
}

TEST(PathSampler, FramesOfAPixelAreStratified) {
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(cells_hit(kStratified[i], SampleSequence::SOBOL), 64u);
  // What not being stratified looks like: 64 (1 - 1/e) = 40 on average.
  EXPECT_LT(cells_hit(kStratified[0], SampleSequence::RANDOM), 55u);
  EXPECT_LT(cells_hit(kLater, SampleSequence::SOBOL), 55u);
}

TEST(PathSampler, PairsAreNotCorrelated) {
  // Equal scrambling of two pairs would put all points on a diagonal.
  const Draw mixed = [](PathSampler& s) { return Vec2{s.filter().x, s.lens().x}; };
  EXPECT_GT(cells_hit(mixed, SampleSequence::SOBOL), 30u);
  const Draw planted = [](PathSampler& s) { return Vec2{s.filter().x, s.filter().x}; };
  EXPECT_LT(cells_hit(planted, SampleSequence::SOBOL), 30u);
}

TEST(PathSampler, NeighboursDoNotShareTheirSequence) {
  std::set<float> seen;
  for (uint32_t pixel = 0; pixel < 1000; ++pixel)
    seen.insert(PathSampler(0, pixel, 0, SampleSequence::SOBOL).filter().x);
  EXPECT_GT(seen.size(), 990u);
}

}  // namespace
}  // namespace cistern::test
