#include "transport/uneven_media.h"

namespace cistern {
namespace {

/// Of a ray; more means that it left a surface that is not closed far behind: the rest is taken for void.
constexpr int kMostCollisions = 1 << 16;

float sample_step(float rate, PathSampler& sampler) { return -std::log1p(-sampler.next_float()) / rate; }

float mean_magnitude(Rgb c) { return (std::abs(c.r) + std::abs(c.g) + std::abs(c.b)) * (1.0f / 3.0f); }

}  // namespace

Rgb estimate_transmittance(const UnevenRay& ray, float length, PathSampler& sampler) {
  constexpr float kDim = 0.05f;  // below, most estimates end: what they cost is worth more elsewhere
  Rgb result = medium_transmittance(ray.segment.even, length);
  const float bound = ray.segment.bound;
  float t = sample_step(bound, sampler);
  for (int i = 0; t < length && i < kMostCollisions; ++i, t += sample_step(bound, sampler)) {
    const Medium uneven = ray.media.uneven_at(ray.segment, ray.path, ray.origin + t * ray.direction);
    result *= Rgb(1.0f) - uneven.extinction * (1.0f / bound);
    const float size = mean_magnitude(result);
    if (size >= kDim) continue;
    if (!(sampler.next_float() * kDim < size)) return Rgb(0.0f);
    result *= kDim / size;
  }
  return result;
}

Rgb estimate_radiance(const UnevenRay& ray, float length, PathSampler& sampler) {
  const float t = sampler.next_float() * length;
  const Rgb emission = ray.at(t).emission;
  return is_black(emission) ? Rgb(0.0f) : emission * estimate_transmittance(ray, t, sampler) * length;
}

UnevenFlight sample_flight(const UnevenRay& ray, Rgb throughput, float length, PathSampler& sampler) {
  const float rate = ray.segment.bound + max_component(ray.segment.even.extinction);
  UnevenFlight flight{std::nullopt, Rgb(1.0f), {}};
  float t = sample_step(rate, sampler);
  for (int i = 0; t < length && i < kMostCollisions; ++i, t += sample_step(rate, sampler)) {
    flight.medium = ray.at(t);
    const Rgb rest = Rgb(rate) - flight.medium.extinction, carried = throughput * flight.weight;
    const float scattered = mean_magnitude(carried * flight.medium.scattering), passed = mean_magnitude(carried * rest);
    const float sum = scattered + passed;
    if (!(sum > 0.0f) || !std::isfinite(sum)) return {std::nullopt, Rgb(0.0f), {}};
    if (sampler.next_float() * sum < scattered) {
      flight.distance = t;
      flight.weight *= flight.medium.scattering * (sum / (scattered * rate));
      return flight;
    }
    flight.weight *= rest * (sum / (passed * rate));
  }
  return flight;
}

Medium typical_medium(const SegmentMedia& segment) {
  Medium medium = segment.even;
  if (segment.varies()) add_scattering(medium, Rgb(0.5f * segment.bound), 0.0f);
  return medium;
}

}  // namespace cistern
