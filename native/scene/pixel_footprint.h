#pragma once

#include "scene/camera.h"

namespace cistern {

/// A pixel of a width x height picture: its size at the camera and the angle by which that grows. A perspective
/// pixel starts as a point, an orthographic one keeps its size, of panoramas the one in the middle stands for all, of
/// sheets the mean.
struct PixelFootprint {
  float size = 0.0f, angle = 0.0f;
};
PixelFootprint pixel_footprint(const Camera& camera, int width, int height);

}  // namespace cistern
