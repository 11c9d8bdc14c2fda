#pragma once

#include "film/film.h"

namespace cistern {

/// What a display makes of a picture, about, so that noise counts as much as it shows: 0 for black, towards 1 for any
/// brighter. [Reinhard et al. 2002, equation 3, and the curve of IEC 61966-2-1]
double displayed(double radiance);

/// How noisy what a film shows is to the eye, once Combined Noise is kept: the standard error of the `displayed`
/// picture times an exposure, as root mean square over blocks of 8 x 8 pixels and their channels; or that of a white
/// backdrop as their alpha lets it through, where this is noisier. In [0, 0.5]. Light that no sample has found is not
/// in it.
class PictureNoise {
 public:
  PictureNoise(const Film& film, double exposure);

  /// That of the block than which one in twenty is noisier: no picture waits for its last firefly.
  double of_most() const;
  double of_worst() const;

  /// Finishes the pixels of blocks that have no more noise than the threshold, and none around them much more: what is
  /// seen there may be in the block, too, and only not have been met yet. How many pixels are left to sample.
  size_t finish_quiet_blocks(Film& film, double threshold) const;

 private:
  bool is_quiet(size_t column, size_t row, double threshold) const;

  size_t columns_, rows_;
  std::vector<double> noise_;  // by block
};

}  // namespace cistern
