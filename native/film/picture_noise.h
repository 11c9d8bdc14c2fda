#pragma once

#include "film/film.h"

namespace cistern {

/// What a display makes of a picture, about, so that noise counts as much as it shows: 0 for black, towards 1 for any
/// brighter. [Reinhard et al. 2002, equation 3, and the curve of IEC 61966-2-1]
double displayed(double radiance);

/// How noisy what a film shows is to the eye, once Combined Noise is kept: the standard error of the `displayed`
/// picture times `exposure`, as root mean square over blocks of 8 x 8 pixels and their channels; that of the block than
/// which one in twenty is noisier. In [0, 0.5]. Light that no sample has found is not in it.
double picture_noise(const Film& film, double exposure);

}  // namespace cistern
