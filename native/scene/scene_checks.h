#pragma once

#include <string>

#include "scene/camera.h"
#include "scene/light.h"

namespace cistern {

// Checks of plain values that enter a scene; each throws Error naming the object, the member and its value.

/// Every entry finite.
void check_transform(const std::string& name, const char* what, const Transform& transform);
/// Everything finite, lengths and angles not negative, directions not zero. Negative energy is allowed, as in Cycles.
void check_light(const Light& light);
/// An invertible matrix, a window with an area, clip_start < clip_end, sensible lens.
void check_camera(const Camera& camera, const std::string& name);

/// Whether a finite transform flattens space so far that it has no useful inverse.
bool is_singular(const Transform& transform);

}  // namespace cistern
