#pragma once

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

/// Owen scrambling of a number whose bits are reversed.
inline constexpr uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  return x ^ (x * 0x53a22864u);
}

/// Pair number `pair` of coordinates of point `index` of an Owen-scrambled Sobol sequence, in [0, 1)^2. The two of a
/// pair fill every elementary interval; pairs are shuffled against one another, so any number of them may be used. Each
/// `seed` gives another scrambling: points of one seed are stratified, points of different seeds independent, and the
/// mean over seeds of an average over points is unbiased.
inline Vec2 sobol_pair(uint32_t index, uint32_t pair, uint32_t seed) {
  const uint64_t shuffle = mix_bits((uint64_t{seed} << 32) | (pair + 1));
  const uint64_t scramble = mix_bits(shuffle);
  const uint32_t shuffled = reverse_bits(scramble_reversed(reverse_bits(index), static_cast<uint32_t>(shuffle)));
  const uint32_t x = scramble_reversed(shuffled, static_cast<uint32_t>(scramble));
  const uint32_t y = scramble_reversed(reversed_sobol_second(shuffled), static_cast<uint32_t>(scramble >> 32));
  return {to_unit_float(reverse_bits(x)), to_unit_float(reverse_bits(y))};
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
