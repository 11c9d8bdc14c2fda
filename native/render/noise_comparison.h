#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace cistern {

/// Noise of pictures that are made in several ways, from a few frames of each: the variance of a frame over boxes of
/// pixels. The same boxes count for all.
class NoiseComparison {
 public:
  NoiseComparison(int width, int height, int box_size, size_t ways);

  /// The luminance of all pixels, row by row, of a frame that was made in one of the ways.
  void add_frame(size_t way, std::span<const float> luminance);

  /// By way, the relative variance of a frame, added up over boxes but for fireflies; frames of each way must be two or
  /// more. The regulariser is that of relative errors elsewhere.
  std::vector<double> variances() const;

  /// The variance of one way, times its `cost`, less the same of another: in units of what chance makes of it, which is
  /// told by how tiles of the picture differ. Fireflies count. Where light is rare no few frames have seen what they
  /// make of the noise, and the number is small; where one way is surely better it is not. Tiles must be two or more.
  double significance(size_t way, double cost, size_t other, double cost_of_other) const;

 private:
  struct Moments {
    double sum = 0.0, sum_of_squares = 0.0;
  };
  struct Way {
    int frames = 0;
    std::vector<Moments> boxes;
  };

  void sum_boxes(std::span<const float> luminance);
  std::vector<double> means() const;
  double variance(size_t way, size_t box) const;
  size_t tile_of(size_t box) const;

  size_t width_, side_, columns_;
  std::vector<double> sums_;  // by box, of the frame at hand
  std::vector<Way> ways_;
};

}  // namespace cistern
