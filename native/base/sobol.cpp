#include "base/sobol.h"

#include <array>
#include <cassert>

#include "base/hash.h"

// [Burley 2020] Practical Hash-based Owen Scrambling, JCGT 9(4): shuffling and padding of low-dimensional sets.
// [Laine and Karras 2011] Stratified Sampling for Stochastic Transparency, §3.1: nested uniform scrambling by a hash in
// which bits depend on lower ones only, applied to reversed bits. [Vegdahl 2021] Building a Better LK Hash: the
// constants used here.

namespace cistern {
namespace {

constexpr int kGroupSize = 4;
constexpr int kNibbles = 8;

using Matrix = std::array<uint32_t, 32>;  // column per bit of the index
using NibbleTable = std::array<std::array<uint32_t, 16>, kNibbles>;

/// A primitive polynomial's degree and inner coefficients, and the first direction numbers.
struct Polynomial {
  int degree;
  uint32_t coefficients;
  std::array<uint32_t, 3> first;
};

// Lines 2 to 4 of Joe and Kuo's list; dimension 0 is the van der Corput sequence.
constexpr std::array<Polynomial, kGroupSize - 1> kPolynomials{
    {{1, 0, {1, 0, 0}}, {2, 1, {1, 3, 0}}, {3, 1, {1, 3, 1}}}};

constexpr uint32_t reverse_bits(uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  return __builtin_bswap32(x);
}

constexpr Matrix direction_numbers(const Polynomial& p) {
  Matrix v{};
  for (int k = 0; k < 32; ++k) {
    if (k < p.degree) {
      v[k] = p.first[k] << (31 - k);
      continue;
    }
    v[k] = v[k - p.degree] ^ (v[k - p.degree] >> p.degree);
    for (int i = 1; i < p.degree; ++i) {
      if ((p.coefficients >> (p.degree - 1 - i)) & 1u) v[k] ^= v[k - i];
    }
  }
  return v;
}

/// Bit-reversed Sobol points, as the scrambling wants them, for every value of every 4 bits of the index.
constexpr NibbleTable reversed_table(const Polynomial& p) {
  const Matrix v = direction_numbers(p);
  NibbleTable table{};
  for (int nibble = 0; nibble < kNibbles; ++nibble) {
    for (uint32_t value = 0; value < 16; ++value) {
      uint32_t bits = 0;
      for (int k = 0; k < 4; ++k) {
        if ((value >> k) & 1u) bits ^= v[4 * nibble + k];
      }
      table[nibble][value] = reverse_bits(bits);
    }
  }
  return table;
}

constexpr std::array<NibbleTable, kGroupSize - 1> kTables{
    {reversed_table(kPolynomials[0]), reversed_table(kPolynomials[1]), reversed_table(kPolynomials[2])}};

uint32_t reversed_sobol(uint32_t index, int dimension) {
  if (dimension == 0) return index;
  const NibbleTable& table = kTables[dimension - 1];
  uint32_t bits = 0;
  for (int nibble = 0; nibble < kNibbles; ++nibble) bits ^= table[nibble][(index >> (4 * nibble)) & 15u];
  return bits;
}

/// Owen scrambling of a number whose bits are reversed.
uint32_t scramble_reversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return x;
}

}  // namespace

uint32_t sobol_bits(uint32_t index, int dimension) {
  assert(dimension >= 0 && dimension < kGroupSize);
  return reverse_bits(reversed_sobol(index, dimension));
}

float sobol_owen(uint32_t index, int dimension, uint32_t seed) {
  const uint32_t group = static_cast<uint32_t>(dimension) / kGroupSize;
  const uint64_t group_hash = mix_bits((uint64_t{seed} << 32) | (group + 1));
  const uint64_t dimension_hash = mix_bits(group_hash ^ (static_cast<uint64_t>(dimension) << 32));
  const uint32_t shuffled = reverse_bits(scramble_reversed(reverse_bits(index), static_cast<uint32_t>(group_hash)));
  const uint32_t point = reversed_sobol(shuffled, dimension % kGroupSize);
  return to_unit_float(reverse_bits(scramble_reversed(point, static_cast<uint32_t>(dimension_hash >> 32))));
}

}  // namespace cistern
