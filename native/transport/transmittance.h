#pragma once

#include "transport/path_context.h"

namespace cistern {

/// Fraction of what `light` sends that reaches `position`, on a surface with geometric normal `ng`: 0 behind opaque
/// surfaces, tinted by transparent ones.
Rgb transmittance(const PathContext& context, Vec3 position, Vec3 ng, const IncidentLight& light,
                  const PathState& path);

}  // namespace cistern
