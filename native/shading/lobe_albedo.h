#pragma once

#include "shading/bsdf.h"

namespace cistern {

/// What the lobe sends on of light from everywhere, its weight not included: 1 where the model has no estimate.
Rgb lobe_albedo(const Lobe& lobe, const Vec3& wo);

/// The same for the colour passes of lobes other than microfacets: with Cycles' estimate for hair, and none for velvet.
Rgb lobe_color(const Lobe& lobe, const Vec3& wo);

}  // namespace cistern
