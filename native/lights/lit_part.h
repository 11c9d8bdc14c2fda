#pragma once

#include <optional>

#include "lights/lamp_shapes.h"

namespace cistern {

/// The part of a ray, between `begin` and `end` metres from its origin, that a lamp may light: in the cone of a spot,
/// in front of an area lamp; of others all. A guess for sampling: a little of what is lit may be left out where the
/// lamp is large. None where nothing is.
struct LitPart {
  float begin = 0.0f, end = INFINITY;
};
std::optional<LitPart> lit_part(const Lamp& lamp, const Vec3& origin, const Vec3& direction, float length);

}  // namespace cistern
