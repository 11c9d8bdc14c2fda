#pragma once

#include <optional>

#include "shading/bsdf.h"

namespace cistern {

/// How light passes the face of a pane: weight is that of BSDF sampling times the probability of this choice.
struct PaneFace {
  Vec3 wi;  // unit
  Rgb weight;
};

/// Empty unless the point is flat, without bumps, and passes light in a single direction: by one delta lobe that
/// refracts, without being transparent.
std::optional<PaneFace> find_pane_face(const SurfacePoint& point, const Bsdf& bsdf);

}  // namespace cistern
