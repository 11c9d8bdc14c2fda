#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "base/transform.h"

namespace cistern {

struct SurfaceSheet;

/// SHEET: looks at each point of a surface from right above it, for baking.
enum class CameraType : uint8_t { PERSPECTIVE, ORTHOGRAPHIC, PANORAMIC, SHEET };

enum class PanoramaType : uint8_t {
  EQUIRECTANGULAR,
  CUBEMAP_FACE,  // equal angles
  MIRROR_BALL,
  FISHEYE_EQUIDISTANT,
  FISHEYE_EQUISOLID,
  FISHEYE_POLYNOMIAL,
  CENTRAL_CYLINDRICAL,
};

/// What a panoramic camera sees where. Each type uses some of these; angles are radians, ranges from left to right and
/// from bottom to top.
struct Panorama {
  PanoramaType type = PanoramaType::EQUIRECTANGULAR;
  Vec2 longitude{-kPi, kPi}, latitude{-0.5f * kPi, 0.5f * kPi};
  Vec2 cylinder{-1.0f, 1.0f};         // heights, of a cylinder of radius 1
  float fov = kPi;                    // of fisheyes, across
  float lens = 10.5f;                 // of equisolid ones; mm, as the sensor
  Vec2 sensor{36.0f, 24.0f};          // of the full frame
  std::array<float, 5> polynomial{};  // angle from the axis, negated, by powers of the distance on the sensor
  friend bool operator==(const Panorama&, const Panorama&) = default;
};

/// A thin-lens or parallel camera looking along -Z of `camera_to_world`, +Y up.
/// The sensor rectangle is given for the *full* frame: in camera space a perspective ray through the image point
/// (s, t) in [0,1]^2 (t up) passes (lerp(left, right, s), lerp(bottom, top, t), -1); an orthographic one starts there.
/// A panoramic camera's rectangle is a part of the frame of its panorama, (0, 0) to (1, 1), or lies around it, as that
/// of a viewport. It focuses on a sphere, and clips by distance.
struct Camera {
  CameraType type = CameraType::PERSPECTIVE;
  Transform camera_to_world;
  float left = -1.0f, right = 1.0f, bottom = -1.0f, top = 1.0f;
  float clip_start = 0.0f, clip_end = 1e30f;  // along the view axis (Z depth)
  float aperture_radius = 0.0f;               // metres; 0 = pinhole
  float focus_distance = 1.0f;                // along the view axis
  int blades = 0;                             // < 3: round
  float blade_rotation = 0.0f;                // radians; 0: the middle of an edge on the right
  float aperture_ratio = 1.0f;                // > 1: anamorphic, narrower in x
  Panorama panorama;                          // of PANORAMIC ones
  // Of SHEET ones. What they see has the size of the sheet; the rest of a camera says where materials take it to be.
  std::shared_ptr<const SurfaceSheet> sheet;
  bool sees_sheet_from_eye = false;               // from there, instead of right above
  CameraType eye_type = CameraType::PERSPECTIVE;  // what it was
  friend bool operator==(const Camera&, const Camera&) = default;
};

}  // namespace cistern
