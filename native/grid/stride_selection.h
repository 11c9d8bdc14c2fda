#pragma once

#include <algorithm>
#include <cstdint>

namespace cistern {

/// At most `max_count` of the n entries of a cell, at equal distances from a random start: entry i is
/// (start + i stride) mod n with stride = ceil(n / max_count). [Boissé 2021] Alg. 3.
/// Each entry is equally likely (count / n). The paper draws the start below the stride, not below n, so that where
/// n is no multiple of the stride the first entries come too often.
struct StrideSelection {
  uint32_t total = 0, stride = 1, start = 0;
  uint32_t count = 0;  ///< how many are selected; ceil(n / stride), all different

  uint32_t operator[](uint32_t i) const {
    return static_cast<uint32_t>((start + static_cast<uint64_t>(i) * stride) % total);
  }
};

/// `u` in [0, 1) chooses the start. Nothing is selected from nothing or where max_count is 0.
inline StrideSelection select_by_stride(uint32_t total, uint32_t max_count, double u) {
  if (total == 0 || max_count == 0) return {};
  const uint32_t stride = (total - 1) / max_count + 1;
  const uint32_t start = std::min(static_cast<uint32_t>(u * total), total - 1);
  return {total, stride, start, (total - 1) / stride + 1};
}

}  // namespace cistern
