#pragma once

#include <array>
#include <bit>

#include "base/vec.h"

namespace cistern {

// The hashes behind Blender's procedural textures: bit-exact, because a user's texture must keep its look.

/// Bob Jenkins' lookup3 of 1 to 4 words. [burtleburtle.net/bob/c/lookup3.c, public domain]
template <typename... Words>
inline uint32_t hash_words(Words... words) {
  constexpr uint32_t kCount = sizeof...(Words);
  static_assert(kCount >= 1 && kCount <= 4);
  const std::array<uint32_t, 4> k{static_cast<uint32_t>(words)...};
  uint32_t a = 0xdeadbeefu + (kCount << 2) + 13u;
  uint32_t b = a, c = a;
  a += k[0];
  b += k[1];  // words that are not there are 0
  c += k[2];
  if constexpr (kCount == 4) {
    a = (a - c) ^ std::rotl(c, 4), c += b;
    b = (b - a) ^ std::rotl(a, 6), a += c;
    c = (c - b) ^ std::rotl(b, 8), b += a;
    a = (a - c) ^ std::rotl(c, 16), c += b;
    b = (b - a) ^ std::rotl(a, 19), a += c;
    c = (c - b) ^ std::rotl(b, 4), b += a;
    a += k[3];
  }
  c = (c ^ b) - std::rotl(b, 14);
  a = (a ^ c) - std::rotl(c, 11);
  b = (b ^ a) - std::rotl(a, 25);
  c = (c ^ b) - std::rotl(b, 16);
  a = (a ^ c) - std::rotl(c, 4);
  b = (b ^ a) - std::rotl(a, 14);
  c = (c ^ b) - std::rotl(b, 24);
  return c;
}

/// Hash of the bits of 1 to 4 floats, in [0, 1].
template <typename... Floats>
inline float hash_floats(Floats... values) {
  return static_cast<float>(hash_words(std::bit_cast<uint32_t>(static_cast<float>(values))...)) *
         (1.0f / 4294967295.0f);
}

/// PCG hash of N integers to N floats in [0, 1]. [Jarzynski and Olano 2020, Hash Functions for GPU Rendering], with
/// the signed shift that Blender uses.
template <size_t N>
inline std::array<float, N> hash_pcg(const std::array<int32_t, N>& key) {
  static_assert(N >= 2 && N <= 4);
  std::array<uint32_t, N> v;
  for (size_t i = 0; i < N; ++i) v[i] = static_cast<uint32_t>(key[i]) * 1664525u + 1013904223u;
  const auto stir = [&v] {
    if constexpr (N == 2) {
      v[0] += v[1] * 1664525u;
      v[1] += v[0] * 1664525u;
    } else if constexpr (N == 3) {
      v[0] += v[1] * v[2];
      v[1] += v[2] * v[0];
      v[2] += v[0] * v[1];
    } else {
      v[0] += v[1] * v[3];
      v[1] += v[2] * v[0];
      v[2] += v[0] * v[1];
      v[3] += v[1] * v[2];
    }
  };
  stir();
  for (uint32_t& word : v) word ^= static_cast<uint32_t>(static_cast<int32_t>(word) >> 16);
  stir();
  std::array<float, N> result;
  for (size_t i = 0; i < N; ++i) result[i] = static_cast<float>(v[i] & 0x7fffffffu) * (1.0f / 2147483648.0f);
  return result;
}

/// Three hashes of one float or vector, for colours.
inline Vec3 hash_color(float k) { return {hash_floats(k), hash_floats(k, 1.0f), hash_floats(k, 2.0f)}; }

}  // namespace cistern
