#include "film/picture_noise.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace cistern {
namespace {

/// Pixels on a side: of 64 estimates with one degree of freedom each, the root mean square is right to about a tenth.
constexpr size_t kBlock = 8;

/// Of all blocks those that may be noisier: no picture waits for its last firefly.
constexpr double kLeftOut = 0.05;

struct Block {
  double squares = 0.0;
  size_t values = 0;

  double noise() const { return std::sqrt(squares / static_cast<double>(values)); }
};

}  // namespace

double displayed(double radiance) {
  const double compressed = radiance > 0.0 ? radiance / (1.0 + radiance) : 0.0;
  return compressed < 0.0031308 ? 12.92 * compressed : 1.055 * std::pow(compressed, 1.0 / 2.4) - 0.055;
}

double picture_noise(const Film& film, double exposure) {
  const std::vector<float> picture = film.resolve(Pass::COMBINED), errors = film.resolve(Pass::COMBINED_NOISE);
  const auto width = static_cast<size_t>(film.width()), height = static_cast<size_t>(film.height());
  const size_t columns = block_count(width, kBlock);
  std::vector<Block> blocks(columns * block_count(height, kBlock));
  parallel_blocks(height, kBlock, [&](size_t row, size_t begin, size_t end) {
    for (size_t pixel = begin * width; pixel < end * width; ++pixel) {
      Block& block = blocks[row * columns + pixel % width / kBlock];
      for (size_t c = 0; c < 3; ++c) {
        const double mean = picture[4 * pixel + c], error = errors[3 * pixel + c];
        // Of what two halves of the samples show: also where that is far from linear.
        const double difference = displayed(exposure * (mean + error)) - displayed(exposure * (mean - error));
        block.squares += 0.25 * difference * difference;
        ++block.values;
      }
    }
  });
  std::vector<double> noise(blocks.size());
  std::ranges::transform(blocks, noise.begin(), &Block::noise);
  const auto left_out = static_cast<std::ptrdiff_t>(kLeftOut * static_cast<double>(noise.size()));
  const auto kept = noise.end() - 1 - left_out;
  std::ranges::nth_element(noise, kept);
  return *kept;
}

}  // namespace cistern
