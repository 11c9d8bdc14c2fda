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

  /// By way, the relative variance of a frame, added up over boxes; frames of each way must be two or more. The
  /// regulariser is that of relative errors elsewhere.
  std::vector<double> variances() const;

 private:
  struct Moments {
    double sum = 0.0, sum_of_squares = 0.0;
  };
  struct Way {
    int frames = 0;
    std::vector<Moments> boxes;
  };

  void sum_boxes(std::span<const float> luminance);

  size_t width_, side_, columns_;
  std::vector<double> sums_;  // by box, of the frame at hand
  std::vector<Way> ways_;
};

}  // namespace cistern
