#pragma once

#include <algorithm>
#include <bit>

#include "base/hash.h"
#include "transport/path_sampler.h"

// [Ahmed and Wonka 2020] Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of
// Pixels, ACM TOG 39(6), §3: pixels take consecutive pieces of one sequence, in the order of a curve through them.

namespace cistern {

/// Where a frame lies among those of a sequence: the `point`-th of about `length` (more than that are allowed).
struct FramePoint {
  uint64_t sequence = 0;
  uint32_t point = 0, length = 1;
};

/// Every other bit of a number of 32, from the lowest one on.
inline constexpr uint32_t spread_bits(uint32_t x) {
  x &= 0xffff;
  x = (x | (x << 8)) & 0x00ff00ff;
  x = (x | (x << 4)) & 0x0f0f0f0f;
  x = (x | (x << 2)) & 0x33333333;
  return (x | (x << 1)) & 0x55555555;
}

/// The point of a pixel's frame. Pixels of square blocks share one sequence, of which each has a piece of `length`
/// points, a power of two, along a Morton curve. So the points of each pixel are stratified, and those of 2 x 2, 4 x 4,
/// ... pixels together too: errors of neighbours cancel. Scrambling the sequence shuffles the curve.
inline SequencePoint screen_point(uint32_t x, uint32_t y, const FramePoint& frame) {
  constexpr int kMostSide = 7,
                kMostBits = 24;  // of a block of pixels; of all its points, for 256 light samples of each
  const int frame_bits = std::bit_width(std::max(frame.length, 1u) - 1);
  const int side = std::clamp((kMostBits - frame_bits) / 2, 0, kMostSide);
  const uint32_t in_block = (1u << side) - 1;
  const uint32_t pixel = spread_bits(x & in_block) | (spread_bits(y & in_block) << 1);
  const uint64_t block = (uint64_t{x >> side} << 32) | (y >> side);
  const uint64_t piece = frame_bits < 32 ? frame.point >> frame_bits : 0;  // of frames beyond its length
  const uint32_t in_piece = frame.point - static_cast<uint32_t>(piece << frame_bits);
  return {hash_combine(hash_combine(block, frame.sequence), piece), (pixel << frame_bits) | in_piece};
}

}  // namespace cistern
