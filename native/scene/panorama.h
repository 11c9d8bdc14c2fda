#pragma once

#include <optional>

#include "scene/camera.h"

// Panoramas as Cycles has them (intern/cycles/kernel/camera/projection.h tells the conventions): which direction, in
// camera space (looking along -Z, +Y up), is seen at the point (s, t) of the full frame, and the inverse.

namespace cistern {

/// Unit; empty where nothing is seen: outside of circles and fields of view.
std::optional<Vec3> panorama_direction(const Panorama& panorama, Vec2 film_position);

/// Outside of the frame too, as for other cameras. Empty where a projection has no place for a direction.
std::optional<Vec2> panorama_position(const Panorama& panorama, Vec3 direction);

/// The angle that a pixel covers that is so wide and high in fractions of the frame, about, in the middle of it.
float panorama_pixel_angle(const Panorama& panorama, Vec2 pixel);

}  // namespace cistern
