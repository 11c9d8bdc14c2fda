#pragma once

#include "shading/bsdf.h"

namespace cistern {

/// GGX width up to which a lobe is sharp: light samples seldom find what it reflects of a lamp.
inline constexpr float kSharpAlpha = 0.1f;
bool is_sharp(const Lobe& lobe);

/// Raises the sample weights of sharp lobes over those of others, for vertices after the first. What diffuse lobes
/// scatter finds lamps that light samples find as well; what sharp lobes scatter is nearly all there is of their
/// highlights, so that by albedo they are chosen too seldom. What the weights add up to stays as it was, and so does
/// Lobe::albedo.
void prefer_sharp_lobes(Bsdf& bsdf);

}  // namespace cistern
