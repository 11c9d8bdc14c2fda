#pragma once

#include "accel/accel.h"
#include "scene/scene.h"

namespace cistern {

/// A ray that meets a sheet (see scene/surface_sheet.h) just in front of its origin, and what it meets there.
struct SheetRay {
  Ray ray;
  Hit hit;
};

/// Onto a pixel of the sheet of the scene's camera, `offset` pixels off its middle but never off its triangle. It comes
/// straight from above, against the shading normal, or from where the camera is. Empty where the pixel shows nothing.
std::optional<SheetRay> sheet_ray(const Scene& scene, size_t pixel, Vec2 offset);

}  // namespace cistern
