#pragma once

#include "scene/instance.h"
#include "scene/material_program.h"

namespace cistern {

/// Light from infinitely far away: a material program with one emission closure, evaluated for a direction
/// (its coordinates are the world-space direction; see `Op::GENERATED`). Sampled by `lights/environment`.
struct Environment {
  int material = -1;                   // -1: black
  int importance_width = 0;            // 0: chosen from the largest image it uses
  uint8_t visibility = kVisibleToAll;  // RayVisibility bits of the rays that may see it
  bool use_importance_sampling = true;
  LightGroup light_group = kNoLightGroup;
  friend bool operator==(const Environment&, const Environment&) = default;
};

}  // namespace cistern
