#include "lights/cumulative_rows.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/rng.h"

namespace cistern::test {
namespace {

/// Many intervals are empty, one holds most.
std::vector<float> uneven(int count, uint32_t row) {
  Rng rng(1, row, 0, 0);
  std::vector<float> values(static_cast<size_t>(count));
  for (float& v : values) v = rng.next_float() < 0.4f ? 0.0f : rng.next_float();
  values[values.size() / 3] = 30.0f;
  return values;
}

TEST(CumulativeRows, FindsTheIntervalOfEveryNumber) {
  for (const int count : {1, 2, 7, 63, 64, 65, 127, 128, 129, 1000, 4096}) {
    CumulativeRows rows(count, 3);
    for (int row = 0; row < 3; ++row) rows.set_row(row, uneven(count, static_cast<uint32_t>(row)).data());
    Rng rng(2, 0, 0, 0);
    for (int i = 0; i < 3000; ++i) {
      const int row = i % 3;
      // The begin of an interval belongs to it, and the number before to the one before.
      const float begin = rows.before(row, static_cast<int>(rng.next_float() * static_cast<float>(count)));
      for (const float u : {rng.next_float(), begin, std::nextafter(begin, 0.0f), 0.0f, 0x1.fffffep-1f}) {
        if (u >= 1.0f) continue;  // where intervals at the end are empty, they begin there
        const int found = rows.find(row, u);
        ASSERT_GE(found, 0);
        ASSERT_LT(found, count);
        ASSERT_LE(rows.before(row, found), u) << count << " " << u;
        ASSERT_GT(rows.before(row, found + 1), u) << count << " " << u;
        ASSERT_GT(rows.probability(row, found), 0.0f);
      }
    }
  }
}

TEST(CumulativeRows, SharesAreThoseOfTheValues) {
  const std::vector<float> values{1.0f, 0.0f, 3.0f, 4.0f}, nothing(4);
  CumulativeRows rows(4, 2);
  EXPECT_EQ(rows.set_row(0, values.data()), 8.0);
  EXPECT_EQ(rows.set_row(1, nothing.data()), 0.0);
  EXPECT_EQ(rows.probability(0, 0), 0.125f);
  EXPECT_EQ(rows.probability(0, 1), 0.0f);
  EXPECT_EQ(rows.probability(0, 3), 0.5f);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(rows.probability(1, i), 0.25f);
}

}  // namespace
}  // namespace cistern::test
