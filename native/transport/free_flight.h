#pragma once

#include <optional>

#include "base/vec.h"
#include "shading/medium.h"

namespace cistern {

/// How far light goes in a homogeneous medium until it is scattered. The extinction of a colour channel that was chosen
/// by what it may still bring is sampled, and weighed by the mean density over the channels: spectral multiple
/// importance sampling, balance heuristic. Beside that the end is chosen at once, by what of each channel reaches it
/// and the square of what its medium absorbs of all that it takes: what a channel does not scatter can always pass.
/// [Wilkie et al. 2014, Hero Wavelength Spectral Sampling; Novák et al. 2018, Monte Carlo Methods for Volumetric Light
/// Transport Simulation, §4.3]
class FreeFlight {
 public:
  /// `throughput` of the path so far; the medium goes on for `length` metres, which may be infinite.
  FreeFlight(const Medium& medium, Rgb throughput, float length);

  /// False where nothing that is scattered would bring light.
  bool can_scatter() const { return can_scatter_; }

  /// Where light is scattered, if before the end; `weight` is what the throughput changes by: transmittance over the
  /// density (per metre), times the scattering coefficient; or at the end over its probability. Needs can_scatter.
  struct Sample {
    std::optional<float> distance;  // none: at the end
    Rgb weight;
  };
  Sample sample(float u_channel, float u_distance) const;

  /// A distance before the end, and its density per metre: as sample, given that light is scattered before the end.
  float sample_inside(float u_channel, float u_distance) const;
  float pdf_inside(float distance) const;

 private:
  /// `u` below the sum of their probabilities.
  int channel(float u) const;

  const Medium& medium_;
  float length_;
  bool can_scatter_ = false;
  std::array<float, 3> extinction_{}, probability_{};
  float straight_ = 0.0f;  // probability of the end beside those of the channels
};

/// Distances along a ray in proportion to 1 / r^2 towards a point, between `begin` and `end`, which may be infinite.
/// [Kulla and Fajardo 2012, Importance Sampling Techniques for Path Tracing in Participating Media: equi-angular]
class EquiAngular {
 public:
  EquiAngular(Vec3 origin, Vec3 direction, float begin, float end, Vec3 towards);

  /// Whether the point is so far away that all distances are alike to it, and angles too small for single precision.
  static bool is_far(Vec3 origin, float begin, float end, Vec3 towards) {
    return end - begin < 1e-3f * length(towards - origin);
  }
  float sample(float u) const;
  /// Per metre; 0 beyond the ends.
  float pdf(float distance) const;

 private:
  float nearest_, apart_;  // where the ray comes nearest to the point, and how near
  float begin_, end_;
  float first_, angle_;  // as seen from the point
};

}  // namespace cistern
