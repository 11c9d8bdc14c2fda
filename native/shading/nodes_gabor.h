#pragma once

#include "base/vec.h"

namespace cistern {

struct GaborSettings {
  float frequency = 2.0f;       // waves across the unit distance
  float anisotropy = 1.0f;      // [0, 1]: 0 lets waves run in all directions, 1 along the orientation alone
  float angle = 0.785398f;      // orientation in two dimensions, in radians
  Vec3 axis{1.0f, 1.0f, 0.0f};  // orientation in three dimensions, of any length
};

struct GaborResult {
  float value = 0.5f;      // about [0, 1]
  float phase = 0.0f;      // [0, 1]
  float intensity = 0.0f;  // at least 0
};

/// Blender's Gabor Texture in 2 (x, y) or 3 dimensions, coordinates already scaled.
GaborResult gabor_node(Vec3 p, int dimensions, const GaborSettings& settings);

}  // namespace cistern
