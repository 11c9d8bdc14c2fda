#pragma once

#include <cmath>

#include "base/rgb.h"
#include "base/vec.h"
#include "shading/subsurface.h"

namespace cistern {

/// How far from where it enters light leaves a surface, for one colour: a sum of two exponentials over the distance.
/// Cut off at `end`, where 0.4 % are missing, as in Cycles, and that much brighter before.
/// [Christensen and Burley 2015, Approximate Reflectance Profiles for Efficient Subsurface Scattering, eq. 3]
class DiffusionProfile {
 public:
  /// `width`: d of the paper, metres; at least 0.
  explicit DiffusionProfile(float width) : width_(width) {}

  float end() const { return kEnd * width_; }
  /// Of the distance r, per metre: what a ring there receives. 0 from `end` on.
  float density(float r) const {
    if (!(r < end())) return 0.0f;
    const float third = std::exp(-r / (3.0f * width_));
    return (third * third * third + third) / (4.0f * width_ * kCovered);
  }
  /// Per square metre.
  float area_density(float r) const { return density(r) * (0.5f * kInvPi) / r; }
  /// A distance by that density. The distribution, 1 - e^(-r/d) / 4 - 3 e^(-r/3d) / 4, is a cubic in e^(-r/3d).
  /// [Golubev 2019, Sampling Burley's Normalized Diffusion Profiles]
  float sample(float u) const {
    const float third = 2.0f * std::sinh(std::asinh(2.0f * (1.0f - kCovered * u)) * (1.0f / 3.0f));
    return std::min(-3.0f * width_ * std::log(third), end());
  }

 private:
  static constexpr float kEnd = 16.0f, kCovered = 0.99637901f;  // the distribution at kEnd
  float width_;
};

/// d for each colour: the mean free path, which is radius / (4 pi) by Blender's custom, over a fit to the albedo for
/// light that enters in a beam. [Christensen and Burley 2015, eq. 5 and 6]
inline Rgb profile_widths(const Subsurface& subsurface) {
  constexpr float kMeanFreePath = 0.25f * kInvPi;
  const auto width = [](float radius, float albedo) {
    return kMeanFreePath * radius / (1.9f - albedo + 3.5f * sqr(albedo - 0.8f));
  };
  return {width(subsurface.radius.r, subsurface.albedo.r), width(subsurface.radius.g, subsurface.albedo.g),
          width(subsurface.radius.b, subsurface.albedo.b)};
}

}  // namespace cistern
