#include "render/noise_comparison.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/parallel.h"

namespace cistern {
namespace {

/// Boxes with the largest variances that do not count: fireflies decide nothing in so few frames.
constexpr double kLeftOut = 0.02;

/// Of the squared mean of all boxes, added to that of each.
constexpr double kRegulariser = 0.01;

/// Pixels on a side. Visible points share over more, but a tile has light from few others.
constexpr size_t kTile = 16;

double sqr(double x) { return x * x; }

double average(const std::vector<double>& values) {
  return std::reduce(values.begin(), values.end()) / static_cast<double>(values.size());
}

}  // namespace

NoiseComparison::NoiseComparison(int width, int height, int box_size, size_t ways)
    : width_(static_cast<size_t>(width)),
      side_(static_cast<size_t>(box_size)),
      columns_(block_count(width_, side_)),
      sums_(columns_ * block_count(static_cast<size_t>(height), side_)),
      ways_(ways) {
  for (Way& way : ways_) way.boxes.resize(sums_.size());
}

void NoiseComparison::sum_boxes(std::span<const float> luminance) {
  std::ranges::fill(sums_, 0.0);
  for (size_t i = 0; i < luminance.size(); ++i) {
    const size_t x = i % width_, y = i / width_;
    if (std::isfinite(luminance[i])) sums_[y / side_ * columns_ + x / side_] += luminance[i];
  }
}

void NoiseComparison::add_frame(size_t way, std::span<const float> luminance) {
  sum_boxes(luminance);
  Way& w = ways_[way];
  ++w.frames;
  for (size_t i = 0; i < sums_.size(); ++i) {
    w.boxes[i].sum += sums_[i];
    w.boxes[i].sum_of_squares += sums_[i] * sums_[i];
  }
}

/// By box, of all ways.
std::vector<double> NoiseComparison::means() const {
  std::vector<double> means(sums_.size());
  for (size_t i = 0; i < means.size(); ++i)
    for (const Way& way : ways_) means[i] += way.boxes[i].sum / way.frames / static_cast<double>(ways_.size());
  return means;
}

double NoiseComparison::variance(size_t way, size_t box) const {
  const Moments& m = ways_[way].boxes[box];
  const double frames = ways_[way].frames, mean = m.sum / frames;
  return std::max((m.sum_of_squares / frames - mean * mean) * frames / (frames - 1.0), 0.0);
}

std::vector<double> NoiseComparison::variances() const {
  const std::vector<double> means = this->means();
  const double regulariser = kRegulariser * sqr(average(means));
  struct Box {
    size_t index;
    double noise, scale;
  };
  std::vector<Box> boxes;
  for (size_t i = 0; i < means.size(); ++i) {
    const double square = sqr(means[i]) + regulariser;
    Box& box = boxes.emplace_back(Box{i, 0.0, square > 0.0 ? 1.0 / square : 0.0});
    for (size_t way = 0; way < ways_.size(); ++way) box.noise += variance(way, i) * box.scale;
  }
  std::ranges::sort(boxes, {}, &Box::noise);
  boxes.resize(boxes.size() - static_cast<size_t>(std::ceil(kLeftOut * static_cast<double>(boxes.size()))));
  std::vector<double> sums(ways_.size());
  for (size_t way = 0; way < ways_.size(); ++way)
    for (const Box& box : boxes) sums[way] += variance(way, box.index) * box.scale;
  return sums;
}

size_t NoiseComparison::tile_of(size_t box) const {
  const size_t boxes = kTile / side_;
  return box / columns_ / boxes * block_count(columns_, boxes) + box % columns_ / boxes;
}

double NoiseComparison::significance(size_t way, double cost, size_t other, double cost_of_other) const {
  const std::vector<double> means = this->means();
  struct Tile {
    double boxes = 0.0, mean = 0.0, difference = 0.0;
  };
  std::vector<Tile> tiles(tile_of(means.size() - 1) + 1);
  for (size_t i = 0; i < means.size(); ++i) {
    Tile& tile = tiles[tile_of(i)];
    tile.boxes += 1.0;
    tile.mean += means[i];
    tile.difference += cost * variance(way, i) - cost_of_other * variance(other, i);
  }
  // What a tile shows is known better than what a box does, which may owe all of it to one lucky path.
  const double regulariser = kRegulariser * sqr(average(means));
  double sum = 0.0, sum_of_squares = 0.0;
  for (const Tile& tile : tiles) {
    const double square = sqr(tile.mean / tile.boxes) + regulariser;
    const double difference = square > 0.0 ? tile.difference / square : 0.0;
    sum += difference;
    sum_of_squares += sqr(difference);
  }
  const auto count = static_cast<double>(tiles.size());
  const double spread = (sum_of_squares - sqr(sum) / count) * count / (count - 1.0);
  return spread > 0.0 ? sum / std::sqrt(spread) : 0.0;
}

}  // namespace cistern
