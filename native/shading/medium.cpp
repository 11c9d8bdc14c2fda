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

}  // namespace

void add_scattering(Medium& medium, Rgb scattering, float g) {
  const Rgb s = coefficients(scattering);
  if (is_black(s)) return;
  const float anisotropy = std::isfinite(g) ? std::clamp(g, -kLargestAnisotropy, kLargestAnisotropy) : 0.0f;
  medium.extinction += s;
  medium.scattering += s;
  int i = 0;
  while (i < medium.lobe_count && medium.lobes[static_cast<size_t>(i)].g != anisotropy) ++i;
  const bool is_full = i == Medium::kMaxLobes;
  PhaseLobe& lobe = medium.lobes[static_cast<size_t>(is_full ? i - 1 : i)];
  if (is_full) {
    const float before = average(lobe.scattering), more = average(s);
    lobe.g = (lobe.g * before + anisotropy * more) / (before + more);
    lobe.scattering += s;
  } else if (i < medium.lobe_count) {
    lobe.scattering += s;
  } else {
    lobe = {s, anisotropy};
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
