#pragma once

#include <optional>

#include "transport/media.h"
#include "transport/path_sampler.h"

namespace cistern {

// Rays through media that vary from place to place. Tentative collisions come at a constant rate, SegmentMedia::bound;
// what the medium lacks there to be as dense is made up by collisions that change nothing but weights. These may be
// negative where it is denser: the bound is a guess by samples, and no mean depends on it.
// [Novák et al. 2014, Residual Ratio Tracking; Galtier et al. 2013, Integral formulation of null-collision Monte Carlo
// algorithms; Kutz et al. 2017, Spectral and Decomposition Tracking]

/// A piece of a ray in media; `path` is that of the ray.
struct UnevenRay {
  const Media& media;
  const SegmentMedia& segment;
  const PathState& path;
  Vec3 origin, direction;

  Medium at(float distance) const { return media.at(segment, path, origin + distance * direction); }
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

/// A medium that is the same everywhere, about as dense: for choosing distances.
Medium typical_medium(const SegmentMedia& segment);

}  // namespace cistern
