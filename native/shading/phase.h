#pragma once

#include "shading/medium.h"

namespace cistern {

/// Of a medium that scatters: the mean over its lobes by the grey of what each scatters, as in Cycles. So colours of
/// media that overlap are exact, and which of them scatters forward is the same for all colours.
float evaluate_phase(const Medium& medium, float cosine);

/// A direction by that density.
struct PhaseSample {
  Vec3 direction;
  float pdf = 0.0f;  // per solid angle: the phase function itself
};
PhaseSample sample_phase(const Medium& medium, Vec3 direction, float u_lobe, Vec2 u_direction);

}  // namespace cistern
