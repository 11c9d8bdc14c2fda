#pragma once

#include "base/transform.h"

namespace cistern {

enum class CameraType : uint8_t { PERSPECTIVE, ORTHOGRAPHIC };

/// A thin-lens or parallel camera looking along -Z of `camera_to_world`, +Y up.
/// The sensor rectangle is given for the *full* frame: in camera space a perspective ray through the image point
/// (s, t) in [0,1]^2 (t up) passes (lerp(left, right, s), lerp(bottom, top, t), -1); an orthographic one starts there.
struct Camera {
  CameraType type = CameraType::PERSPECTIVE;
  Transform camera_to_world;
  float left = -1.0f, right = 1.0f, bottom = -1.0f, top = 1.0f;
  float clip_start = 0.0f, clip_end = 1e30f;  // along the view axis (Z depth)
  float aperture_radius = 0.0f;               // metres; 0 = pinhole
  float focus_distance = 1.0f;                // along the view axis
  int blades = 0;                             // < 3: round
  float blade_rotation = 0.0f;                // radians
  float aperture_ratio = 1.0f;                // > 1: anamorphic, narrower in x
  friend bool operator==(const Camera&, const Camera&) = default;
};

}  // namespace cistern
