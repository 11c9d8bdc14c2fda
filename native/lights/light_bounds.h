#pragma once

#include <span>

#include "base/vec.h"

namespace cistern {

/// What a cluster of emitters can send, bounded from above: where they are, where they face and how strong they are.
/// [Conty Estevez and Kulla 2018, Importance Sampling of Many Lights with Adaptive Tree Splitting, §4.1]
struct LightBounds {
  Bounds3 box;
  Vec3 axis{0.0f, 0.0f, 1.0f};  // unit; centre of the cone of emitter normals
  float cos_normals = -1.0f;    // half angle of that cone; -1 = all directions
  float cos_emission = 0.0f;    // farthest from its normal that an emitter sends light
  float intensity = 0.0f;       // W/sr along the normal (magnitude), summed
  float near_distance2 = 0.0f;  // m^2; from nearer than its root, or from within the box, irradiance grows no more
  bool is_two_sided = false;    // light leaves along the normal and against it alike
};

/// Bounds of all of `parts`, of which at least one must be given. Uses no trigonometry.
LightBounds merge(std::span<const LightBounds> parts);

}  // namespace cistern
