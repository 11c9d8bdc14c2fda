#include "transport/free_flight.h"

namespace cistern {
namespace {

std::array<float, 3> channels(Rgb c) { return {c.r, c.g, c.b}; }

/// The probability of being scattered over `length`.
float scattered_share(float extinction, float length) { return -std::expm1(-extinction * length); }

}  // namespace

FreeFlight::FreeFlight(const Medium& medium, Rgb throughput, float length)
    : medium_(medium), length_(length), extinction_(channels(medium.extinction)) {
  const std::array<float, 3> scattering = channels(medium.scattering), weight = channels(throughput);
  const std::array<float, 3> passed = channels(medium_transmittance(medium, length));
  float sum = 0.0f;
  for (size_t i = 0; i < 3; ++i) {
    const float albedo = scattering[i] > 0.0f ? scattering[i] / extinction_[i] : 0.0f;
    probability_[i] = std::abs(weight[i]) * albedo;
    // Squared: fog that is lit from within has less noise by its own light than by what is behind it.
    straight_ += std::abs(weight[i]) * sqr(std::max(1.0f - albedo, 0.0f)) * passed[i];
    sum += probability_[i];
  }
  can_scatter_ = sum > 0.0f && std::isfinite(sum + straight_) && length > 0.0f;
  if (!can_scatter_) return;
  sum += straight_;
  for (float& p : probability_) p /= sum;
  straight_ /= sum;
}

/// One of those that are possible.
int FreeFlight::channel(float u) const {
  int chosen = 0;
  float left = u;
  for (int i = 0; i < 3; ++i) {
    const float p = probability_[static_cast<size_t>(i)];
    if (p == 0.0f) continue;
    chosen = i;
    if (left < p) break;
    left -= p;
  }
  return chosen;
}

FreeFlight::Sample FreeFlight::sample(float u_channel, float u_distance) const {
  const bool is_straight = u_channel < straight_;
  const size_t chosen = static_cast<size_t>(channel(u_channel - straight_));
  const float t = is_straight ? length_ : -std::log1p(-u_distance) / extinction_[chosen];
  const bool is_inside = t < length_;
  const Rgb transmittance = medium_transmittance(medium_, is_inside ? t : length_);
  const std::array<float, 3> passed = channels(transmittance);
  float pdf = is_inside ? 0.0f : straight_;
  for (size_t i = 0; i < 3; ++i) pdf += probability_[i] * passed[i] * (is_inside ? extinction_[i] : 1.0f);
  if (!(pdf > 0.0f)) return {is_inside ? std::optional(t) : std::nullopt, Rgb()};
  const Rgb weight = transmittance * (1.0f / pdf);
  if (!is_inside) return {std::nullopt, weight};
  return {t, weight * medium_.scattering};
}

float FreeFlight::sample_inside(float u_channel, float u_distance) const {
  const float extinction = extinction_[static_cast<size_t>(channel(u_channel * (1.0f - straight_)))];
  const float share = scattered_share(extinction, length_);
  if (!(share > 0.0f)) return u_distance * length_;  // so thin that single precision sees nothing of it
  return std::min(-std::log1p(-u_distance * share) / extinction, length_);
}

float FreeFlight::pdf_inside(float distance) const {
  float pdf = 0.0f;
  for (size_t i = 0; i < 3; ++i) {
    if (probability_[i] == 0.0f) continue;
    const float share = scattered_share(extinction_[i], length_);
    pdf += probability_[i] *
           (share > 0.0f ? extinction_[i] * std::exp(-extinction_[i] * distance) / share : 1.0f / length_);
  }
  return pdf / (1.0f - straight_);
}

EquiAngular::EquiAngular(Vec3 origin, Vec3 direction, float begin, float end, Vec3 towards)
    : nearest_(dot(towards - origin, direction)), begin_(begin), end_(end) {
  apart_ = length(towards - origin - nearest_ * direction);
  first_ = std::atan2(begin - nearest_, apart_);
  angle_ = (std::isfinite(end) ? std::atan2(end - nearest_, apart_) : 0.5f * kPi) - first_;
}

float EquiAngular::sample(float u) const {
  return std::clamp(nearest_ + apart_ * std::tan(first_ + u * angle_), begin_, end_);
}

float EquiAngular::pdf(float distance) const {
  if (!(apart_ > 0.0f) || !(angle_ > 0.0f) || distance < begin_ || distance > end_) return 0.0f;
  return apart_ / (angle_ * (sqr(apart_) + sqr(distance - nearest_)));
}

}  // namespace cistern
