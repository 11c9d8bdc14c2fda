#include "grid/stride_selection.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "base/rng.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

const std::pair<uint32_t, uint32_t> kCases[] = {{1, 4}, {4, 4}, {5, 2}, {5, 4}, {7, 3}, {100, 4}, {33, 10}};

TEST(StrideSelection, TakesDifferentEntries) {
  for (const auto& [total, max_count] : kCases)
    for (uint32_t start = 0; start < total; ++start) {
      const StrideSelection s = select_by_stride(total, max_count, (start + 0.5) / total);
      std::set<uint32_t> chosen;
      for (uint32_t i = 0; i < s.count; ++i) chosen.insert(s[i]);
      ASSERT_EQ(chosen.size(), s.count);
      ASSERT_LE(s.count, max_count);
      ASSERT_GE(2 * s.count, std::min(total, max_count));
      ASSERT_LT(*chosen.rbegin(), total);
    }
  EXPECT_EQ(select_by_stride(0, 4, 0.5).count, 0u);
  EXPECT_EQ(select_by_stride(4, 0, 0.5).count, 0u);
  EXPECT_LT(select_by_stride(0xffffffffu, 4, 0x1.fffffffffffffp-1).start, 0xffffffffu);
}

/// p-value of all entries being chosen equally often: one of each selection, evenly, so that counts are independent.
template <class Select>
double p_value_of(const Select& select, uint32_t total, uint32_t max_count) {
  constexpr int kDraws = 20000;
  std::vector<double> observed(total), expected(total, kDraws / static_cast<double>(total));
  Rng rng(1, total, max_count, 0);
  for (int i = 0; i < kDraws; ++i) {
    const StrideSelection s = select(total, max_count, rng.next_double());
    ++observed[s[std::min(static_cast<uint32_t>(s.count * rng.next_double()), s.count - 1)]];
  }
  return chi_square_p_value(observed, expected);
}

TEST(StrideSelection, TakesAllEntriesEquallyOften) {
  for (const auto& [total, max_count] : kCases)
    EXPECT_GT(p_value_of(select_by_stride, total, max_count), shared_rate(std::size(kCases)));
}

TEST(StrideSelection, PlantedStartBelowTheStrideIsCaught) {
  const auto printed = [](uint32_t total, uint32_t max_count, double u) {
    StrideSelection s = select_by_stride(total, max_count, u);
    s.start = static_cast<uint32_t>(u * s.stride);
    return s;
  };
  EXPECT_LT(p_value_of(printed, 5, 2), kFalseAlarmRate) << "[Boissé 2021] Alg. 3: entry 0 comes twice as often";
}

}  // namespace
}  // namespace cistern::test
