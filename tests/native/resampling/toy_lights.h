#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/rng.h"
#include "resampling/resample.h"
#include "support/statistics.h"

namespace cistern::test {

inline constexpr size_t kLights = 12;
/// Targets of one receiver for every light. A sample is the index of a light, in counting measure.
using Targets = std::array<float, kLights>;
using LightReservoir = Reservoir<size_t>;

/// Samples W made with M uniform candidates, confidence c.
inline LightReservoir initial_reservoir(const Targets& p_hat, int M, float c, Rng& rng, uint64_t& non_finite) {
  ReservoirBuilder<size_t> builder(non_finite);
  for (int m = 0; m < M; ++m) {
    const auto light = static_cast<size_t>(rng.next_float() * kLights);
    builder.add(light, p_hat[light] * double{kLights} / M, p_hat[light], rng.next_float());
  }
  return builder.finish(c);
}

/// Means over many runs of W where light s was chosen, else 0: what an unbiased reservoir makes 1 for every light that
/// its receiver sees.
struct MeanWeights {
  std::array<Moments, kLights> of_light;

  void add(const LightReservoir& reservoir) {
    for (size_t s = 0; s < kLights; ++s) of_light[s].add(reservoir.sample == s ? reservoir.W : 0.0f);
  }
  /// p-value of "the means are `expected`" for all lights together [Šidák 1967].
  double p_value(std::span<const double> expected) const {
    double smallest = 1.0;
    for (size_t s = 0; s < kLights; ++s) smallest = std::min(smallest, mean_p_value(of_light[s], expected[s]));
    return -std::expm1(kLights * std::log1p(-smallest));
  }
};

/// 1 for every light the receiver sees.
inline std::array<double, kLights> seen_by(const Targets& p_hat) {
  std::array<double, kLights> seen{};
  for (size_t s = 0; s < kLights; ++s) seen[s] = p_hat[s] > 0.0f ? 1.0 : 0.0;
  return seen;
}

}  // namespace cistern::test
