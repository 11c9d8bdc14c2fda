#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string_view>

namespace cistern {

/// MurmurHash3_x86_32 with seed 0. [Appleby 2011]
inline uint32_t murmur_hash_3(std::string_view text) {
  uint32_t hash = 0;
  const auto scrambled = [](uint32_t word) { return std::rotl(word * 0xcc9e2d51u, 15) * 0x1b873593u; };
  const auto byte = [&](size_t i) { return static_cast<uint32_t>(static_cast<uint8_t>(text[i])); };
  const size_t words = text.size() / 4;
  for (size_t i = 0; i < words; ++i) {
    const size_t b = 4 * i;
    hash ^= scrambled(byte(b) | byte(b + 1) << 8 | byte(b + 2) << 16 | byte(b + 3) << 24);
    hash = std::rotl(hash, 13) * 5u + 0xe6546b64u;
  }
  uint32_t rest = 0;
  for (size_t i = text.size(); i-- > 4 * words;) rest = rest << 8 | byte(i);
  hash ^= scrambled(rest);
  hash ^= static_cast<uint32_t>(text.size());
  hash = (hash ^ hash >> 16) * 0x85ebca6bu;
  hash = (hash ^ hash >> 13) * 0xc2b2ae35u;
  return hash ^ hash >> 16;
}

/// What Cryptomatte makes of a hash: the float of these bits, its exponent clamped so that it is finite and normal.
/// [Friedman and Jones 2015, Cryptomatte specification 1.2.0]
inline float matte_id(uint32_t hash) {
  const uint32_t exponent = std::clamp(hash >> 23 & 0xffu, 1u, 254u);
  return std::bit_cast<float>((hash & 0x807fffffu) | exponent << 23);
}
inline float matte_id(std::string_view name) { return matte_id(murmur_hash_3(name)); }

}  // namespace cistern
