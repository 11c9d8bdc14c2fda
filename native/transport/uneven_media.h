#pragma once

#include <optional>

#include "transport/media.h"
#include "transport/path_sampler.h"

namespace cistern {

// Rays through media that vary from place to place. Tentative collisions come at the rate of ExtinctionBounds, which is
// constant in each block of a medium; what the medium lacks there to be as dense is made up by collisions that change
// nothing but weights. These may be negative where it is denser: the bounds are guesses by samples, and no mean depends
// on them.
// [Novák et al. 2014, Residual Ratio Tracking; Galtier et al. 2013, Integral formulation of null-collision Monte Carlo
// algorithms; Kutz et al. 2017, Spectral and Decomposition Tracking; blocks: Szirmay-Kalos, Tóth and Magdics 2011, Free
// Path Sampling in High Resolution Inhomogeneous Participating Media]

/// A piece of a ray in media; `path` is that of the ray.
struct UnevenRay {
  const Media& media;
  const SegmentMedia& segment;
  const PathState& path;
  Vec3 origin, direction;

  Medium at(float distance) const { return media.at(segment, path, direction, origin + distance * direction); }
};

/// The bounds of all that varies along a ray, added up.
class BoundsAlong {
 public:
  explicit BoundsAlong(const UnevenRay& ray);

  float bound() const { return bound_; }
  /// Where this bound ends; infinity after the last.
  float end() const { return end_; }
  void advance();

 private:
  void add_up();
  float find_world_bound() const;

  const UnevenRay& ray_;
  std::optional<WorldBlockWalk> world_;
  float world_bound_ = 0.0f;
  std::array<BlockWalk, MediaStack::kCapacity> walks_;
  size_t count_ = 0;
  float bound_ = 0.0f, end_ = 0.0f;
};

/// Its mean is the fraction of light that goes straight on over `length` metres.
Rgb estimate_transmittance(const UnevenRay& ray, float length, PathSampler& sampler);

/// Its mean is the radiance that arrives of what is emitted over the last `length` metres.
Rgb estimate_radiance(const UnevenRay& ray, float length, PathSampler& sampler);

/// Where light is scattered, if before `length`, and by what; `weight` as FreeFlight::Sample has it.
struct UnevenFlight {
  std::optional<float> distance;
  Rgb weight;
  Medium medium;
};
UnevenFlight sample_flight(const UnevenRay& ray, Rgb throughput, float length, PathSampler& sampler);

/// Distances along a ray about as light is scattered there, by the bounds alone: as FreeFlight's of what is even.
class UnevenDistances {
 public:
  UnevenDistances(const UnevenRay& ray, float length);

  /// A distance before the end, and its density per metre.
  float sample(float u) const;
  float pdf(float distance) const;

 private:
  const UnevenRay& ray_;
  float length_, even_;
  float share_;  // of light that is scattered before the end
};

}  // namespace cistern
