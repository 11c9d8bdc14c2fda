#pragma once

#include <span>
#include <vector>

#include "scene/light.h"

namespace cistern {

/// A ray that left the inside of a scene for the sky.
struct EscapedRay {
  Vec3 origin, direction;  // unit
};

/// Few rectangles that most of the rays pass, those of most rays first: the windows, doors and skylights of a building,
/// as portals that look inwards. They lie across the walls' axes: +Z, and +X turned by `yaw` (radians towards +Y). Rays
/// that have no opening in common give large rectangles, or none.
///
/// A grid is laid over the origins, and the rays are counted that cross each face of its cells. They are closest
/// together where they pass an opening: each votes for the face on its way that most rays cross. Rays whose faces are
/// neighbours are of one opening, and so are those that the smallest rectangle of all of them is no larger for. Its
/// plane is where that rectangle is smallest.
std::vector<AreaLight> fit_openings(std::span<const EscapedRay> rays, float yaw);

/// Whether a ray leaves through an opening.
bool passes(const AreaLight& opening, const EscapedRay& ray);

}  // namespace cistern
