#pragma once

#include <algorithm>

#include "base/direction_histogram.h"
#include "base/direction_lobes.h"

namespace cistern {

/// Where light is thought to come from: a histogram of what earlier paths found, lobes towards caustics, both, or
/// neither. Refers to these.
struct DirectionGuide {
  /// Of the directions of a lobe that is guided.
  static constexpr float kHistogramShare = 0.5f;

  const DirectionHistogram* histogram = nullptr;
  const DirectionLobes* caustics = nullptr;
  Vec3 position;  // of who looks

  explicit operator bool() const { return histogram || caustics; }
  /// How many of the directions follow the guide.
  float share() const { return (histogram ? kHistogramShare : 0.0f) + (caustics ? caustic_share() : 0.0f); }
  float caustic_share() const { return (histogram ? 1.0f - kHistogramShare : 1.0f) * caustics->worth(); }
  /// Density of `sample`, per solid angle.
  float pdf(const Vec3& w) const {
    const float found = histogram ? kHistogramShare * histogram->pdf(w) : 0.0f;
    return (caustics ? found + caustic_share() * caustics->pdf(w, position) : found) / share();
  }
  /// There must be something. Keeps the stratification of `u` as far as the parts do.
  Vec3 sample(Vec2 u) const {
    if (!caustics) return histogram->sample(u);
    const float of_caustics = caustic_share() / share();
    if (u.x < of_caustics) return caustics->sample({u.x / of_caustics, u.y}, position);
    return histogram->sample({std::min((u.x - of_caustics) / (1.0f - of_caustics), kOneMinusEpsilon), u.y});
  }
};

}  // namespace cistern
