#pragma once

#include <vector>

#include "scene/scene.h"

namespace cistern {

/// Directions at most an angle away from `axis`.
struct SkyCone {
  Vec3 axis;                   // unit, away from the scene
  float one_minus_cos = 0.0f;  // of that angle: a cosine would be too coarse for the sun

  float solid_angle() const { return 2.0f * kPi * one_minus_cos; }
};

bool contains(const SkyCone& cone, Vec3 direction);
/// Uniform, density 1 / solid angle.
Vec3 sample_cone(const SkyCone& cone, Vec2 u);
/// The direction itself, or if the cone contains it the nearest one just outside.
Vec3 outside(const SkyCone& cone, Vec3 direction);

/// The sun discs that the environment's program draws (Op::SUN_DISC).
struct SkySuns {
  std::vector<SkyCone> cones;
  bool are_all_found = true;  // false: the nodes bend directions, and a disc may be anywhere and of any shape
};
SkySuns find_sky_suns(const Scene& scene);

}  // namespace cistern
