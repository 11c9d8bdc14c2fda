#include "base/rng.h"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <vector>

#include "support/statistics.h"

namespace cistern::test {
namespace {

constexpr int kBins = 16;

/// p-value of pairs (i-th number of two sources) filling kBins^2 cells uniformly.
double pair_p_value(int count, const std::function<Vec2(int)>& pair) {
  std::vector<double> observed(kBins * kBins, 0.0), expected(kBins * kBins, double(count) / (kBins * kBins));
  for (int i = 0; i < count; ++i) {
    const Vec2 p = pair(i);
    observed[static_cast<size_t>(p.y * kBins) * kBins + static_cast<size_t>(p.x * kBins)] += 1.0;
  }
  return chi_square_p_value(observed, expected);
}

TEST(Rng, ConsecutiveNumbersAreUniformPairs) {
  Rng rng(1, 2, 3, 4);
  EXPECT_GT(pair_p_value(100000, [&](int) { return rng.next_vec2(); }), kFalseAlarmRate);
}

TEST(Rng, StreamsThatDifferInOneNumberAreIndependent) {
  using Key = std::array<uint32_t, 4>;  // seed, pixel, frame, stream
  for (size_t part = 0; part < 4; ++part) {
    const auto first = [&](int i) {
      Key key{7, 7, 7, 7};
      key[part] = static_cast<uint32_t>(i);
      return Rng(key[0], key[1], key[2], key[3]).next_float();
    };
    const auto neighbours = [&](int i) { return Vec2{first(i), first(i + 1)}; };
    EXPECT_GT(pair_p_value(50000, neighbours), shared_rate(4)) << part;
  }
}

TEST(Rng, PlantedBugOfKeysAddedUpIsSeen) {
  // Pixel and frame merely added: pixel p in frame f + 1 repeats pixel p + 1 in frame f.
  const auto number = [](int pixel, int frame) {
    return Rng(1, static_cast<uint32_t>(pixel + frame), 0, 0).next_float();
  };
  EXPECT_LT(pair_p_value(5000, [&](int i) { return Vec2{number(i, 1), number(i + 1, 0)}; }), kFalseAlarmRate);
}

TEST(Rng, StreamsCanBeReplayed) {
  Rng a(1, 2, 3, 4), b(1, 2, 3, 4);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.next_uint32(), b.next_uint32());
}

TEST(Rng, FloatsAreBelowOne) {
  EXPECT_EQ(to_unit_float(0), 0.0f);
  EXPECT_LT(to_unit_float(UINT32_MAX), 1.0f);
}

}  // namespace
}  // namespace cistern::test
