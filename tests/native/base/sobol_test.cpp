#include "base/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "base/hash.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

using Sequence = float (*)(uint32_t index, int dimension, uint32_t seed);

/// Whether the first 2^log_count points put one into each of the elementary intervals of 2^-k by 2^-(log_count - k),
/// for the k given.
bool fills_intervals(Sequence sequence, int dimension_x, int dimension_y, int log_count, int k, uint32_t seed) {
  const uint32_t count = 1u << log_count;
  const uint32_t columns = 1u << k, rows = count >> k;
  std::vector<bool> is_taken(count, false);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t x = static_cast<uint32_t>(sequence(i, dimension_x, seed) * static_cast<float>(columns));
    const uint32_t y = static_cast<uint32_t>(sequence(i, dimension_y, seed) * static_cast<float>(rows));
    if (is_taken[y * columns + x]) return false;
    is_taken[y * columns + x] = true;
  }
  return true;
}

/// How many of 2^log_cells square cells (an even power) the first points_per_cell * 2^log_cells points leave empty.
int empty_cells(Sequence sequence, int dimension_x, int dimension_y, int log_cells, uint32_t points_per_cell,
                uint32_t seed) {
  const uint32_t side = 1u << (log_cells / 2);
  std::set<uint32_t> taken;
  for (uint32_t i = 0; i < side * side * points_per_cell; ++i) {
    const uint32_t x = static_cast<uint32_t>(sequence(i, dimension_x, seed) * static_cast<float>(side));
    const uint32_t y = static_cast<uint32_t>(sequence(i, dimension_y, seed) * static_cast<float>(side));
    taken.insert(y * side + x);
  }
  return static_cast<int>(side * side - taken.size());
}

float coordinate(Vec2 point, int dimension) { return dimension % 2 == 0 ? point.x : point.y; }

float sobol_owen(uint32_t index, int dimension, uint32_t seed) {
  return coordinate(sobol_point(index, static_cast<uint32_t>(dimension) / 2, seed).pair, dimension);
}

/// Planted bug: neither the points are scrambled nor the index shuffled, so that pairs repeat one another.
float unscrambled(uint32_t index, int dimension, uint32_t) {
  const uint32_t second = reversed_sobol_second(index);
  return to_unit_float(reverse_bits(dimension % 2 == 0 ? index : second));
}

/// Planted bug: independent random numbers.
float independent(uint32_t index, int dimension, uint32_t seed) {
  return to_unit_float(static_cast<uint32_t>(mix_bits((uint64_t{seed} << 40) ^ (uint64_t(dimension) << 32) ^ index)));
}

TEST(Sobol, FirstPointsAreThePublishedOnes) {
  // [Joe and Kuo 2008]'s first two dimensions, in natural instead of Gray-code order.
  const float expected[2][8] = {{0.0f, 0.5f, 0.25f, 0.75f, 0.125f, 0.625f, 0.375f, 0.875f},
                                {0.0f, 0.5f, 0.75f, 0.25f, 0.625f, 0.125f, 0.375f, 0.875f}};
  for (int dimension = 0; dimension < 2; ++dimension) {
    for (uint32_t i = 0; i < 8; ++i) EXPECT_EQ(unscrambled(i, dimension, 0), expected[dimension][i]) << dimension;
  }
}

TEST(Sobol, ThirdDimensionIsThePublishedOne) {
  const float expected[8] = {0.0f, 0.5f, 0.75f, 0.25f, 0.375f, 0.875f, 0.625f, 0.125f};
  for (uint32_t i = 0; i < 8; ++i) EXPECT_EQ(to_unit_float(reverse_bits(kReversedSobolThird(i))), expected[i]) << i;
}

/// How many of 8 x 8 x 8 cells 512 points leave empty, `third` being the third coordinate.
template <class Third>
size_t empty_cubes(const Third& third) {
  std::set<uint32_t> taken;
  for (uint32_t i = 0; i < 512; ++i) {
    const Vec2 pair = sobol_point(i, 2, 5).pair;
    const auto column = static_cast<uint32_t>(pair.x * 8.0f), row = static_cast<uint32_t>(pair.y * 8.0f);
    taken.insert((static_cast<uint32_t>(third(i) * 8.0f) * 8 + row) * 8 + column);
  }
  return 512 - taken.size();
}

TEST(Sobol, CoordinatesOfAPointAreStratifiedTogether) {
  // Independent of one another they leave 512 / e = 188 empty.
  EXPECT_LT(empty_cubes([](uint32_t i) { return sobol_point(i, 2, 5).third; }), 140u);
  EXPECT_GT(empty_cubes([](uint32_t i) { return sobol_point(i, 3, 5).third; }), 150u);
}

TEST(Sobol, EveryDimensionIsStratified) {
  for (int dimension = 0; dimension < 12; ++dimension) {
    for (const int log_count : {1, 4, 10}) {
      EXPECT_TRUE(fills_intervals(sobol_owen, dimension, dimension + 1, log_count, log_count, 77)) << dimension;
    }
  }
  const Sequence third = [](uint32_t index, int, uint32_t seed) { return sobol_point(index, 1, seed).third; };
  for (uint32_t seed = 0; seed < 4; ++seed) EXPECT_TRUE(fills_intervals(third, 0, 0, 10, 10, seed));
}

TEST(Sobol, PairsFillAllElementaryIntervals) {
  for (const int dimension : {0, 2, 8}) {
    for (const int log_count : {4, 7, 10}) {
      for (int k = 0; k <= log_count; ++k) {
        for (uint32_t seed = 0; seed < 4; ++seed) {
          EXPECT_TRUE(fills_intervals(sobol_owen, dimension, dimension + 1, log_count, k, seed));
        }
      }
    }
  }
  EXPECT_FALSE(fills_intervals(independent, 0, 1, 4, 2, 0));
}

TEST(Sobol, PairsAreIndependentOfOneAnother) {
  // Dimensions 0 and 2 have the same generator matrix: unshuffled they lie on a line.
  EXPECT_LT(empty_cells(sobol_owen, 0, 2, 10, 1, 3), 1024 * 0.42);
  EXPECT_GT(empty_cells(unscrambled, 0, 2, 10, 1, 3), 900);
}

/// Smallest p-value of "the mean of x is 1/2", "of x^2 is 1/3" and "of x y is 1/4" over seeds with 3 points each: a
/// count at which unscrambled points are biased.
double mean_p_value_of(Sequence sequence) {
  double smallest = 1.0;
  for (int dimension = 0; dimension < 8; ++dimension) {
    Moments first, second, product;
    for (uint32_t seed = 0; seed < 3000; ++seed) {
      double sum = 0.0, squares = 0.0, products = 0.0;
      for (uint32_t i = 0; i < 3; ++i) {
        const double x = sequence(i, dimension, seed), y = sequence(i, dimension + 1, seed);
        sum += x / 3.0;
        squares += x * x / 3.0;
        products += x * y / 3.0;
      }
      first.add(sum);
      second.add(squares);
      product.add(products);
    }
    smallest =
        std::min({smallest, mean_p_value(first, 0.5), mean_p_value(second, 1.0 / 3.0), mean_p_value(product, 0.25)});
  }
  return smallest;
}

TEST(Sobol, MeanOverSeedsIsUnbiased) { EXPECT_GT(mean_p_value_of(sobol_owen), shared_rate(24)); }

TEST(Sobol, PlantedBugOfUnscrambledPointsIsSeen) { EXPECT_LT(mean_p_value_of(unscrambled), shared_rate(24)); }

TEST(Sobol, OnePointOverSeedsIsUniform) {
  constexpr int kBins = 64, kSeeds = 20000;
  for (const int dimension : {0, 3, 5}) {
    std::vector<double> observed(kBins, 0.0), expected(kBins, double{kSeeds} / kBins);
    for (uint32_t seed = 0; seed < kSeeds; ++seed) {
      observed[static_cast<size_t>(sobol_owen(5, dimension, seed) * kBins)] += 1.0;
    }
    EXPECT_GT(chi_square_p_value(observed, expected), shared_rate(3));
  }
}

TEST(Sobol, ConvergesFasterThanIndependentPoints) {
  // Root mean square error of a smooth integral over a pair with 256 points: far below that of independent ones.
  const auto error = [](Sequence sequence) {
    double squares = 0.0;
    for (uint32_t seed = 0; seed < 64; ++seed) {
      double mean = 0.0;
      for (uint32_t i = 0; i < 256; ++i) {
        double f = 1.0;
        for (int d = 0; d < 2; ++d) f *= 0.5 + sequence(i, d, seed);
        mean += f / 256.0;
      }
      squares += (mean - 1.0) * (mean - 1.0);
    }
    return std::sqrt(squares / 64.0);
  };
  EXPECT_LT(error(sobol_owen), 0.1 * error(independent));
}

}  // namespace
}  // namespace cistern::test
