#pragma once

#include <immintrin.h>

#include <array>

#include "base/hash.h"
#include "base/vec.h"

// [Burley 2020] Practical Hash-based Owen Scrambling, JCGT 9(4): shuffling and padding of low-dimensional sets.
// [Laine and Karras 2011] Stratified Sampling for Stochastic Transparency, §3.1: nested uniform scrambling by a hash in
// which bits depend on lower ones only, applied to reversed bits. [Vegdahl 2021] Building a Better LK Hash: the
// constants used here.

namespace cistern {

inline constexpr uint32_t reverse_bits(uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  return __builtin_bswap32(x);
}

/// Second dimension of the Sobol sequence, bits reversed (bit 0 is the half). Its generator matrix is Pascal's triangle
/// modulo 2, applied here by recursive halving; the first dimension, bits reversed, is the index itself. [Sobol 1967]
inline constexpr uint32_t reversed_sobol_second(uint32_t index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  return index ^ ((index >> 16) & 0x0000ffffu);
}

/// Third dimension, bits reversed, a byte of the index at a time: primitive polynomial x^2 + x + 1, first direction
/// numbers 1 and 3. [Joe and Kuo 2008, new-joe-kuo-6.21201]
class ReversedSobolThird {
 public:
  constexpr ReversedSobolThird() {
    std::array<uint32_t, 32> directions{0x80000000u, 0xc0000000u};
    for (size_t i = 2; i < directions.size(); ++i)
      directions[i] = directions[i - 1] ^ directions[i - 2] ^ (directions[i - 2] >> 2);
    for (size_t byte = 0; byte < tables_.size(); ++byte)
      for (uint32_t value = 0; value < 256; ++value)
        for (size_t bit = 0; bit < 8; ++bit)
          if (value >> bit & 1) tables_[byte][value] ^= reverse_bits(directions[8 * byte + bit]);
  }
  constexpr uint32_t operator()(uint32_t index) const {
    return tables_[0][index & 255] ^ tables_[1][index >> 8 & 255] ^ tables_[2][index >> 16 & 255] ^
           tables_[3][index >> 24];
  }

 private:
  std::array<std::array<uint32_t, 256>, 4> tables_{};
};
inline constexpr ReversedSobolThird kReversedSobolThird;

/// Owen scrambling of a number whose bits are reversed.
inline constexpr uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  return x ^ (x * 0x53a22864u);
}

/// Bits of each lane in reverse order, a nibble at a time.
inline __m128i reverse_bits(__m128i x) {
  const __m128i low_nibbles = _mm_set1_epi8(0x0f);
  const __m128i reversed = _mm_setr_epi8(0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15);
  const __m128i low = _mm_shuffle_epi8(_mm_slli_epi16(reversed, 4), _mm_and_si128(x, low_nibbles));
  const __m128i high = _mm_shuffle_epi8(reversed, _mm_and_si128(_mm_srli_epi16(x, 4), low_nibbles));
  const __m128i last_byte_first = _mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12);
  return _mm_shuffle_epi8(_mm_or_si128(low, high), last_byte_first);
}

/// scramble_reversed of each lane.
inline __m128i scramble_reversed(__m128i x, __m128i seed) {
  const auto times = [](__m128i a, uint32_t b) { return _mm_mullo_epi32(a, _mm_set1_epi32(static_cast<int>(b))); };
  x = _mm_xor_si128(x, times(x, 0x3d20adeau));
  x = _mm_add_epi32(x, seed);
  x = _mm_mullo_epi32(x, _mm_or_si128(_mm_srli_epi32(seed, 16), _mm_set1_epi32(1)));
  x = _mm_xor_si128(x, times(x, 0x05526c56u));
  return _mm_xor_si128(x, times(x, 0x53a22864u));
}

/// to_unit_float of each lane.
inline __m128 to_unit_floats(__m128i bits) {
  return _mm_mul_ps(_mm_cvtepi32_ps(_mm_srli_epi32(bits, 8)), _mm_set1_ps(0x1p-24f));
}

/// The first three coordinates of a point of the sequence, in [0, 1). Of a power of two of points, those of `pair` fill
/// every elementary interval.
struct SobolPoint {
  Vec2 pair;
  float third;
};

/// Point `index` of an Owen-scrambled Sobol sequence. Its coordinates are stratified together; sequences of different
/// `set` are shuffled against one another, so any number of them may be used. Each `seed` gives another scrambling:
/// points of one seed are stratified, points of different seeds independent, and the mean over seeds of an average over
/// points is unbiased.
inline SobolPoint sobol_point(uint32_t index, uint32_t set, uint32_t seed) {
  const uint64_t shuffle = mix_bits((uint64_t{seed} << 32) | (set + 1));
  const uint64_t scramble = mix_bits(shuffle);
  const uint32_t shuffled = reverse_bits(scramble_reversed(reverse_bits(index), static_cast<uint32_t>(shuffle)));
  const auto lanes = [](uint32_t a, uint32_t b, uint32_t c) {
    return _mm_setr_epi32(static_cast<int>(a), static_cast<int>(b), static_cast<int>(c), 0);
  };
  const __m128i reversed = lanes(shuffled, reversed_sobol_second(shuffled), kReversedSobolThird(shuffled));
  const __m128i seeds = lanes(static_cast<uint32_t>(scramble), static_cast<uint32_t>(scramble >> 32),
                              static_cast<uint32_t>(shuffle >> 32));
  const __m128 point = to_unit_floats(reverse_bits(scramble_reversed(reversed, seeds)));
  return {{point[0], point[1]}, point[2]};
}

/// The `index`-th of points that start at `start` and cover the unit square evenly: each by itself is uniform where
/// `start` is. The two-dimensional Kronecker sequence of the plastic number.
/// [Roberts 2018, The Unreasonable Effectiveness of Quasirandom Sequences]
inline Vec2 kronecker_point(Vec2 start, int index) {
  constexpr Vec2 kStep{0.7548776662f, 0.5698402910f};
  const auto fraction = [](float x) { return std::min(x - std::floor(x), kOneMinusEpsilon); };
  const auto i = static_cast<float>(index);
  return {fraction(start.x + i * kStep.x), fraction(start.y + i * kStep.y)};
}

}  // namespace cistern
