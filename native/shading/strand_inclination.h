#pragma once

#include "base/vec.h"

namespace cistern {

inline float cosine_of(float sine) { return safe_sqrt(1.0f - sine * sine); }

/// Of a direction against the plane across a strand.
struct Inclination {
  float sine, cosine;
};

/// Density of inclinations, over cosine and angle, of light seen at `o`: M_p with variance `v`. [d'Eon et al. 2011, An
/// Energy-Conserving Hair Reflectance Model, eq. 7]
float longitudinal_density(Inclination i, Inclination o, float v);
Inclination sample_longitudinal(Inclination o, float v, float u_height, float u_turns);

}  // namespace cistern
