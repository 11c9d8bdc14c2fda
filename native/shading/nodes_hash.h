#pragma once

#include <array>
#include <bit>

#include "base/vec.h"

namespace cistern {

// The hashes behind Blender's procedural textures: bit-exact, because a user's texture must keep its look.

using std::rotl;

/// Bob Jenkins' lookup3 of 1 to 4 words, or of lanes of such. [burtleburtle.net/bob/c/lookup3.c, public domain]
template <typename Word, size_t kCount>
inline Word hash_of_words(const std::array<Word, kCount>& words) {
  static_assert(kCount >= 1 && kCount <= 4);
  Word a(0xdeadbeefu + (static_cast<uint32_t>(kCount) << 2) + 13u);
  Word b = a, c = a;
  a += words[0];  // words that are not there are 0
  if constexpr (kCount > 1) b += words[1];
  if constexpr (kCount > 2) c += words[2];
  if constexpr (kCount == 4) {
    a = (a - c) ^ rotl(c, 4), c += b;
    b = (b - a) ^ rotl(a, 6), a += c;
    c = (c - b) ^ rotl(b, 8), b += a;
    a = (a - c) ^ rotl(c, 16), c += b;
    b = (b - a) ^ rotl(a, 19), a += c;
    c = (c - b) ^ rotl(b, 4), b += a;
    a += words[3];
  }
  c = (c ^ b) - rotl(b, 14);
  a = (a ^ c) - rotl(c, 11);
  b = (b ^ a) - rotl(a, 25);
  c = (c ^ b) - rotl(b, 16);
  a = (a ^ c) - rotl(c, 4);
  b = (b ^ a) - rotl(a, 14);
  c = (c ^ b) - rotl(b, 24);
  return c;
}

template <typename... Words>
inline uint32_t hash_words(Words... words) {
  return hash_of_words(std::array<uint32_t, sizeof...(Words)>{static_cast<uint32_t>(words)...});
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
