#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/vec.h"

namespace cistern {

/// A density over all directions, constant over each of 16 x 16 parts of equal solid angle (sphere_map.h). 544 bytes:
/// shares are kept in 65,536ths, parts with less have none.
class DirectionHistogram {
 public:
  static constexpr int kSide = 16, kBins = kSide * kSide;

  /// `weights`: not negative, finite, with a sum above 0.
  explicit DirectionHistogram(std::span<const double, kBins> weights);

  static uint32_t bin(const Vec3& w);
  /// Fetches all of it, so that what follows does not wait for memory.
  void prefetch() const {
    constexpr size_t kCacheLine = 64;
    for (size_t at = 0; at < sizeof(*this); at += kCacheLine)
      __builtin_prefetch(reinterpret_cast<const char*>(this) + at);
  }

  /// Share of a part, in [0, 1].
  float pmf(uint32_t bin) const { return static_cast<float>(end(bin) - begin_[bin]) * (1.0f / kUnits); }
  /// Density of `sample`, per solid angle.
  float pdf(const Vec3& w) const { return pmf(bin(w)) * (kBins / (4.0f * kPi)); }
  /// Keeps the stratification of `u` as far as the shares allow.
  Vec3 sample(Vec2 u) const;

 private:
  static constexpr uint32_t kUnits = 1 << 16;
  uint32_t end(uint32_t bin) const { return bin + 1 < kBins ? begin_[bin + 1] : kUnits; }

  alignas(32) std::array<uint16_t, kBins> begin_;  // sum of the shares before, row by row
  std::array<uint16_t, kSide> row_begin_;          // of the first part of each row, again: together in the cache
};

}  // namespace cistern
