#pragma once

#include <algorithm>
#include <array>

#include "base/rgb.h"
#include "shading/phase_function.h"

namespace cistern {

/// What a medium scatters by one phase function.
struct PhaseLobe {
  Rgb scattering;  // 1/m
  PhaseFunction phase;
};

/// Denser is opaque in any case, and products of numbers beyond would overflow.
inline constexpr float kDensest = 1e18f;  // 1/m

/// What a homogeneous medium does to light on its way. Where media overlap they add up.
struct Medium {
  static constexpr int kMaxLobes = 8;  // as Cycles
  Rgb extinction;                      // 1/m: what absorption and scattering take away
  Rgb scattering;                      // 1/m: the sum of the lobes
  Rgb emission;                        // radiance per metre
  int lobe_count = 0;
  std::array<PhaseLobe, kMaxLobes> lobes;

  bool is_vacuum() const { return is_black(extinction) && is_black(emission); }
  bool scatters() const { return lobe_count > 0; }
};

/// Coefficients that are negative count as zero. Of more than kMaxLobes phase functions the last takes in the rest:
/// with the mean anisotropy where they are Henyey and Greenstein's, else with that of whichever scatters most.
void add_scattering(Medium& medium, Rgb scattering, const PhaseFunction& phase);
void add_absorption(Medium& medium, Rgb absorption);

/// Fraction of light that goes straight on over `distance`, which may be infinite.
Rgb medium_transmittance(const Medium& medium, float distance);

/// Radiance that arrives of what the medium emits over the last `distance` metres; nothing where it is infinite and
/// nothing absorbs.
Rgb medium_radiance(const Medium& medium, float distance);

}  // namespace cistern
