#pragma once

#include "base/rng.h"
#include "base/sobol.h"

namespace cistern {

enum class SampleSequence : uint8_t { SOBOL, RANDOM };

/// Where in the sequences of a pixel a frame's Sobol points lie.
struct SequencePoint {
  uint32_t sequence = 0, point = 0;
};
/// Bit of the sequences of frames that act on what a trial of earlier frames found.
inline constexpr uint32_t kDecidedSequence = uint32_t{1} << 31;

/// Random numbers of one camera path. The first dimensions of a path come from an Owen-scrambled Sobol sequence over
/// the frames of its pixel, the rest (and every dimension with RANDOM) from a counter-based generator: so a path is a
/// function of (seed, pixel, frame) alone. Points of a sequence depend on each other: frames that act on what earlier
/// ones found take another sequence than those.
class PathSampler {
 public:
  PathSampler(uint64_t seed, uint32_t pixel, uint32_t frame, SampleSequence sequence)
      : PathSampler(seed, pixel, frame, sequence, {0, frame}) {}
  PathSampler(uint64_t seed, uint32_t pixel, uint32_t frame, SampleSequence sequence, SequencePoint point)
      : rng_(seed, pixel, frame, 0),
        scramble_(static_cast<uint32_t>(hash_combine(mix_bits(seed), pixel))),
        point_(point.point),
        is_sobol_(sequence == SampleSequence::SOBOL) {
    if (point.sequence > 0) scramble_ = static_cast<uint32_t>(hash_combine(mix_bits(scramble_), point.sequence));
  }

  Vec2 filter() { return pair(FILTER); }
  Vec2 lens() { return pair(LENS); }
  Vec2 bsdf_direction(int vertex) { return vertex == 0 ? pair(FIRST_BSDF) : rng_.next_vec2(); }
  Vec2 light_position(int vertex) { return vertex == 0 ? pair(FIRST_LIGHT) : rng_.next_vec2(); }
  /// Which light, with all bits of a double: there may be millions.
  double light_choice(int vertex) {
    if (vertex > 0 || !is_sobol_) return rng_.next_double();
    const uint64_t below = mix_bits((uint64_t{scramble_} << 32) | point_) >> 40;  // what a float has no bits for
    return pair(FIRST_CHOICES).x + static_cast<double>(below) * 0x1p-48;
  }
  float lobe_choice(int vertex) { return vertex == 0 ? pair(FIRST_CHOICES).y : rng_.next_float(); }
  /// For decisions that gain little from stratification: Russian roulette, passing through.
  float next_float() { return rng_.next_float(); }
  double next_double() { return rng_.next_double(); }

 private:
  enum Pair : uint32_t { FILTER, LENS, FIRST_BSDF, FIRST_LIGHT, FIRST_CHOICES };

  Vec2 pair(Pair which) { return is_sobol_ ? sobol_pair(point_, which, scramble_) : rng_.next_vec2(); }

  Rng rng_;
  uint32_t scramble_;
  uint32_t point_;  // of the sequence
  bool is_sobol_;
};

}  // namespace cistern
