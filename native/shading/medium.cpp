#include "shading/medium.h"

namespace cistern {
namespace {

float coefficient(float v) { return v > 0.0f ? std::min(v, kDensest) : 0.0f; }  // 0 for nan
Rgb coefficients(Rgb c) { return {coefficient(c.r), coefficient(c.g), coefficient(c.b)}; }

/// Infinitely far away in a vacuum 0 * infinity is meant to be 0.
float optical_depth(float extinction, float distance) { return extinction > 0.0f ? extinction * distance : 0.0f; }

/// The integral of exp(-extinction t) over t up to `distance`.
float mean_path(float extinction, float distance) {
  const float depth = optical_depth(extinction, distance);
  if (depth > 0.0f && std::isfinite(1.0f / extinction)) return -std::expm1(-depth) / extinction;
  return std::isfinite(distance) ? distance : 0.0f;
}

PhaseFunction joined(const PhaseFunction& a, float weight_a, const PhaseFunction& b, float weight_b) {
  if (!a.is_henyey_greenstein() || !b.is_henyey_greenstein()) return weight_a < weight_b ? b : a;
  return PhaseFunction::henyey_greenstein((a.g() * weight_a + b.g() * weight_b) / (weight_a + weight_b));
}

}  // namespace

void add_scattering(Medium& medium, Rgb scattering, const PhaseFunction& phase) {
  const Rgb s = coefficients(scattering);
  if (is_black(s)) return;
  medium.extinction += s;
  medium.scattering += s;
  int i = 0;
  while (i < medium.lobe_count && medium.lobes[static_cast<size_t>(i)].phase != phase) ++i;
  const bool is_full = i == Medium::kMaxLobes;
  PhaseLobe& lobe = medium.lobes[static_cast<size_t>(is_full ? i - 1 : i)];
  if (is_full) {
    lobe = {lobe.scattering + s, joined(lobe.phase, average(lobe.scattering), phase, average(s))};
  } else if (i < medium.lobe_count) {
    lobe.scattering += s;
  } else {
    lobe = {s, phase};
    ++medium.lobe_count;
  }
}

void add_absorption(Medium& medium, Rgb absorption) { medium.extinction += coefficients(absorption); }

Rgb medium_transmittance(const Medium& medium, float distance) {
  const Rgb e = medium.extinction;
  return {std::exp(-optical_depth(e.r, distance)), std::exp(-optical_depth(e.g, distance)),
          std::exp(-optical_depth(e.b, distance))};
}

Rgb medium_radiance(const Medium& medium, float distance) {
  const Rgb e = medium.extinction;
  return medium.emission * Rgb(mean_path(e.r, distance), mean_path(e.g, distance), mean_path(e.b, distance));
}

}  // namespace cistern
