#include "film/picture_noise.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace cistern {
namespace {

/// Pixels on a side: of 64 estimates with one degree of freedom each, the root mean square is right to about a tenth.
constexpr size_t kBlock = 8;

/// Of all blocks those that `of_most` leaves out.
constexpr double kLeftOut = 0.05;

/// How much more noise than a finished block those around it may have.
constexpr double kNeighbours = 1.4;

constexpr size_t kColors = 3, kChannels = 4;

struct Block {
  double squares = 0.0, squares_of_backdrop = 0.0;
  size_t pixels = 0;

  double noise() const {
    return std::sqrt(std::max(squares, kColors * squares_of_backdrop) / static_cast<double>(kColors * pixels));
  }
};

/// Half of what two halves of the samples show the difference of, squared: also where that is far from linear.
double square_of_error(double radiance, double error) {
  const double difference = displayed(radiance + error) - displayed(radiance - error);
  return 0.25 * difference * difference;
}

}  // namespace

double displayed(double radiance) {
  const double compressed = radiance > 0.0 ? radiance / (1.0 + radiance) : 0.0;
  return compressed < 0.0031308 ? 12.92 * compressed : 1.055 * std::pow(compressed, 1.0 / 2.4) - 0.055;
}

PictureNoise::PictureNoise(const Film& film, double exposure) {
  const std::vector<float> picture = film.resolve(Pass::COMBINED), errors = film.resolve(Pass::COMBINED_NOISE);
  const auto width = static_cast<size_t>(film.width()), height = static_cast<size_t>(film.height());
  columns_ = block_count(width, kBlock), rows_ = block_count(height, kBlock);
  std::vector<Block> blocks(columns_ * rows_);
  parallel_blocks(height, kBlock, [&](size_t row, size_t begin, size_t end) {
    for (size_t pixel = begin * width; pixel < end * width; ++pixel) {
      Block& block = blocks[row * columns_ + pixel % width / kBlock];
      const float *mean = &picture[kChannels * pixel], *error = &errors[kChannels * pixel];
      for (size_t c = 0; c < kColors; ++c) block.squares += square_of_error(exposure * mean[c], exposure * error[c]);
      block.squares_of_backdrop += square_of_error(1.0 - mean[kColors], error[kColors]);
      ++block.pixels;
    }
  });
  noise_.resize(blocks.size());
  std::ranges::transform(blocks, noise_.begin(), &Block::noise);
}

double PictureNoise::of_most() const {
  std::vector<double> noise = noise_;
  const auto left_out = static_cast<std::ptrdiff_t>(kLeftOut * static_cast<double>(noise.size()));
  const auto kept = noise.end() - 1 - left_out;
  std::ranges::nth_element(noise, kept);
  return *kept;
}

double PictureNoise::of_worst() const { return std::ranges::max(noise_); }

size_t PictureNoise::finish_quiet_blocks(Film& film, double threshold) const {
  const auto width = static_cast<size_t>(film.width()), pixels = width * static_cast<size_t>(film.height());
  size_t left = 0;
  for (size_t pixel = 0; pixel < pixels; ++pixel) {
    const auto number = static_cast<uint32_t>(pixel);
    if (film.is_finished(number)) continue;
    if (is_quiet(pixel % width / kBlock, pixel / width / kBlock, threshold))
      film.finish(number);
    else
      ++left;
  }
  return left;
}

bool PictureNoise::is_quiet(size_t column, size_t row, double threshold) const {
  if (noise_[row * columns_ + column] > threshold) return false;
  for (size_t y = row - std::min<size_t>(row, 1); y <= std::min(row + 1, rows_ - 1); ++y)
    for (size_t x = column - std::min<size_t>(column, 1); x <= std::min(column + 1, columns_ - 1); ++x)
      if (noise_[y * columns_ + x] > kNeighbours * threshold) return false;
  return true;
}

}  // namespace cistern
