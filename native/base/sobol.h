#pragma once

#include <cstdint>

namespace cistern {

/// Coordinate `dimension` of point `index` of an Owen-scrambled Sobol sequence, in [0, 1). Dimensions come in groups of
/// four that are jointly stratified; groups are shuffled against one another, so any number of dimensions may be used.
/// Each `seed` gives another scrambling: points of one seed are stratified, points of different seeds independent, and
/// the mean over seeds of an average over points is unbiased.
float sobol_owen(uint32_t index, int dimension, uint32_t seed);

/// The Sobol sequence itself, for dimension 0 to 3: 32 bits after the binary point. [Sobol 1967; numbers of Joe and Kuo
/// 2008, Constructing Sobol Sequences with Better Two-Dimensional Projections]
uint32_t sobol_bits(uint32_t index, int dimension);

}  // namespace cistern
