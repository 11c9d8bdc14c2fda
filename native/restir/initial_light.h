#pragma once

#include "base/rng.h"
#include "restir/light_target.h"

namespace cistern {

/// RIS over `count` light samples of the context's sampler: one reservoir of confidence 1. Candidates are spread over
/// emitters by strata and over their squares by a lattice; each by itself is drawn as by the sampler.
/// [Talbot et al. 2005, Importance Resampling for Global Illumination]
LightReservoir resample_light_candidates(const PathContext& context, const VisiblePoint& visible, int count, Rng& rng,
                                         uint64_t& non_finite);

}  // namespace cistern
