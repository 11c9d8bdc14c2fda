#pragma once

#include "base/rng.h"
#include "base/sobol.h"

namespace cistern {

enum class SampleSequence : uint8_t { SOBOL, RANDOM };

/// Random numbers of one camera path. The first dimensions of a path come from an Owen-scrambled Sobol sequence over
/// the frames of its pixel, the rest (and every dimension with RANDOM) from a counter-based generator: so a path is a
/// function of (seed, pixel, frame) alone.
class PathSampler {
 public:
  /// Dimensions of the camera, then of each vertex. A vertex has kPerVertex of them from kFirstVertex on.
  enum Dimension { FILTER = 0, LENS = 2, kFirstVertex = 4 };
  enum VertexDimension { BSDF_DIRECTION = 0, LIGHT_POSITION = 2, BSDF_LOBE = 4, LIGHT_CHOICE = 5, kPerVertex = 6 };

  PathSampler(uint64_t seed, uint32_t pixel, uint32_t frame, SampleSequence sequence)
      : rng_(seed, pixel, frame, 0),
        scramble_(static_cast<uint32_t>(hash_combine(mix_bits(seed), pixel))),
        frame_(frame),
        sobol_dimensions_(sequence == SampleSequence::SOBOL ? kSobolDimensions : 0) {}

  float get_1d(int dimension) {
    return dimension < sobol_dimensions_ ? sobol_owen(frame_, dimension, scramble_) : rng_.next_float();
  }
  Vec2 get_2d(int dimension) {
    const float x = get_1d(dimension);
    return {x, get_1d(dimension + 1)};
  }
  float vertex_1d(int vertex, VertexDimension d) { return get_1d(kFirstVertex + vertex * kPerVertex + d); }
  Vec2 vertex_2d(int vertex, VertexDimension d) { return get_2d(kFirstVertex + vertex * kPerVertex + d); }
  /// For decisions that gain nothing from stratification (Russian roulette, passing through).
  float next_float() { return rng_.next_float(); }

 private:
  static constexpr int kSobolDimensions = kFirstVertex + 2 * kPerVertex;

  Rng rng_;
  uint32_t scramble_;
  uint32_t frame_;
  int sobol_dimensions_;
};

}  // namespace cistern
