#pragma once

#include "transport/path_context.h"

namespace cistern {

/// Fraction of what `light` sends that reaches `receiver`: 0 behind opaque surfaces, tinted by transparent ones.
Rgb transmittance(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                  const PathState& path);

}  // namespace cistern
