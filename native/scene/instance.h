#pragma once

#include <cstdint>

#include "base/transform.h"
#include "scene/light_group.h"
#include "scene/light_linking.h"
#include "scene/ray_visibility.h"

namespace cistern {

/// A mesh placed in the world. Plain values only: scenes hold hundreds of thousands.
struct Instance {
  int mesh = -1;                       // -1: removed
  int material_set = -1;               // index into Scene::material_sets
  int object = -1;                     // index into Scene::object_names
  uint8_t visibility = kVisibleToAll;  // RayVisibility bits
  bool is_holdout = false, is_shadow_catcher = false;
  bool blends_world_normals = false;       // see SceneBuilder::blend_normals_in_world
  uint8_t light_set = 0, shadow_set = 0;   // as a receiver and as a blocker of light: below kLightSets
  LightGroup light_group = kNoLightGroup;  // as an emitter
  float random = 0.0f;                     // Object Info > Random, in [0, 1)
  int values = -1;                         // row of Scene::instance_values; -1: reads 0
  LightLinks links;                        // as an emitter
  Transform object_to_world;               // finite and invertible; may mirror
  uint64_t key = 0;                        // the same in all snapshots that show this thing; 0: known by its handle
  friend bool operator==(const Instance&, const Instance&) = default;
};

}  // namespace cistern
