#pragma once

#include <cstdint>

namespace cistern {

/// Bijective 64-bit finaliser. [Steele et al. 2014, SplitMix64; constants of Stafford's Mix13]
inline constexpr uint64_t mix_bits(uint64_t v) {
  v ^= v >> 30;
  v *= 0xbf58476d1ce4e5b9ull;
  v ^= v >> 27;
  v *= 0x94d049bb133111ebull;
  v ^= v >> 31;
  return v;
}

inline constexpr uint64_t hash_combine(uint64_t seed, uint64_t value) {
  return mix_bits(seed ^ (value + 0x9e3779b97f4a7c15ull + (seed << 6) + (seed >> 2)));
}

/// Uniform float in [0, 1) from the upper bits of a hash.
inline constexpr float to_unit_float(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

}  // namespace cistern
