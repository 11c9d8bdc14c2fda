#pragma once

#include "base/rng.h"
#include "base/sobol.h"

namespace cistern {

enum class SampleSequence : uint8_t {
  SOBOL,        // of boxes of pixels
  PIXEL_SOBOL,  // of each pixel by itself: errors of neighbours are then independent, as denoisers expect
  RANDOM,       // no sequence
};

/// Where a path's Sobol points lie.
struct SequencePoint {
  uint64_t sequence = 0;
  uint32_t point = 0;
};

/// Random numbers of one camera path. The first dimensions of a path come from an Owen-scrambled Sobol sequence over
/// the frames of its pixel, or of a block of pixels (transport/screen_points.h), the rest (and every dimension with
/// RANDOM) from a counter-based generator: so a path is a function of (seed, pixel, frame, point) alone. Points of a
/// sequence depend on each other: frames that act on what earlier ones found take another sequence than those.
class PathSampler {
 public:
  PathSampler(uint64_t seed, uint32_t pixel, uint32_t frame, SampleSequence sequence)
      : PathSampler(seed, pixel, frame, sequence, {pixel, frame}) {}
  PathSampler(uint64_t seed, uint32_t pixel, uint32_t frame, SampleSequence sequence, SequencePoint point)
      : rng_(seed, pixel, frame, 0),
        scramble_(static_cast<uint32_t>(hash_combine(mix_bits(seed), point.sequence))),
        point_(point.point),
        is_sobol_(sequence != SampleSequence::RANDOM) {}

  Vec2 filter() { return point_of(FILTER).pair; }
  Vec2 lens() { return point_of(LENS).pair; }
  float wavelength() { return is_sobol_ ? point_of(FILTER).third : rng_.next_float(); }

  /// Which light, with all bits of a double, since there may be millions; and which point of it.
  struct LightNumbers {
    double choice;
    Vec2 position;
  };
  /// Of sample `index` of `count` (at most 256) at the vertex; those of all frames are stratified together.
  LightNumbers light(int vertex, uint32_t index = 0, uint32_t count = 1) {
    if (!is_stratified(vertex)) {
      const double choice = rng_.next_double();
      return {choice, rng_.next_vec2()};
    }
    const uint32_t set = set_of(LIGHT, vertex);
    const uint32_t number = point_ * count + index;
    const SobolPoint point = sobol_point(number, set, scramble_);
    const uint64_t below = mix_bits(hash_combine(scramble_, (uint64_t{set} << 32) | number)) >> 40;
    return {point.third + static_cast<double>(below) * 0x1p-48, point.pair};  // a float has no bits for those
  }

  /// Which lobe, and which direction of it.
  struct ScatteringNumbers {
    float lobe;
    Vec2 direction;
  };
  ScatteringNumbers scattering(int vertex) {
    if (!is_stratified(vertex)) {
      const float lobe = rng_.next_float();
      return {lobe, rng_.next_vec2()};
    }
    const SobolPoint point = point_of(set_of(SCATTERING, vertex));
    return {point.third, point.pair};
  }

  /// Direction and free path of step `step` of a walk below the surface, the first of which enters.
  struct WalkNumbers {
    Vec2 direction;
    float distance;
  };
  WalkNumbers walk(int vertex, int step) {
    if (!is_stratified(vertex) || step >= kStratifiedSteps) {
      const Vec2 direction = rng_.next_vec2();
      return {direction, rng_.next_float()};
    }
    const SobolPoint point = point_of(WALK + static_cast<uint32_t>(step));
    return {point.pair, point.third};
  }

  /// Which colour, and how far, for the first segment of a path in media.
  struct FlightNumbers {
    float channel, distance;
  };
  FlightNumbers first_flight() {
    const Vec2 u = point_of(FLIGHT).pair;
    return {u.x, u.y};
  }

  /// How, and where on a segment in media, light samples of that vertex's number are looked for.
  struct MediumLightNumbers {
    float technique, channel, distance;
  };
  MediumLightNumbers light_in_medium(int vertex) {
    if (!is_stratified(vertex)) {
      const Vec2 u = rng_.next_vec2();
      return {u.x, rng_.next_float(), u.y};
    }
    const SobolPoint point = point_of(MEDIUM_LIGHT);
    return {point.pair.x, point.third, point.pair.y};
  }

  /// For decisions that gain little from stratification: Russian roulette, passing through.
  float next_float() { return rng_.next_float(); }
  double next_double() { return rng_.next_double(); }

 private:
  /// What later vertices see depends on so many numbers before that little is gained there (two and four: 0 to 6 %).
  static constexpr int kStratifiedVertices = 1;
  static constexpr int kStratifiedSteps = 4;

  /// Dimensions that are stratified together; those of a vertex follow one another.
  enum Set : uint32_t {
    FILTER,
    LENS,
    LIGHT,
    SCATTERING,
    PER_VERTEX = 2,
    WALK = LIGHT + PER_VERTEX * kStratifiedVertices,
    FLIGHT = WALK + kStratifiedSteps,
    MEDIUM_LIGHT
  };
  bool is_stratified(int vertex) const { return is_sobol_ && vertex < kStratifiedVertices; }
  static uint32_t set_of(Set set, int vertex) { return set + PER_VERTEX * static_cast<uint32_t>(vertex); }
  SobolPoint point_of(uint32_t set) {
    if (is_sobol_) return sobol_point(point_, set, scramble_);
    const Vec2 pair = rng_.next_vec2();
    return {pair, 0.0f};
  }

  Rng rng_;
  uint32_t scramble_;
  uint32_t point_;  // of the sequence
  bool is_sobol_;
};

}  // namespace cistern
