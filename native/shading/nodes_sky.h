#pragma once

#include "base/vec.h"

namespace cistern {

/// A disc in the sky whose colour changes with elevation. Angles in radians, elevations above the plane z = 0.
struct SunDisc {
  Vec3 direction;  // unit, towards its centre
  float half_angle = 0.0f;
  Vec3 bottom, top;                                     // radiance of its middle at the two elevations below
  float bottom_elevation = 0.0f, top_elevation = 0.0f;  // linear in between
  float horizon = 0.0f;                                 // elevation that the disc is seen above
};

/// Op::SUN_DISC: what is seen in `direction`, where the sky alone is `sky`. The limb is darker than the middle by
/// Eddington's law with coefficient 0.6. [Milne 1921] The disc is added to the sky, or replaces it with
/// `hides_sky`, as in Cycles before 5.0.
Vec3 sun_disc_node(const SunDisc& disc, Vec3 direction, Vec3 sky, bool hides_sky);

}  // namespace cistern
