#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "base/rgb.h"
#include "base/transform.h"
#include "scene/instance.h"

namespace cistern {

// All quantities are final physical ones; addon/sync/lights.py converts Blender's watts.

/// A sphere of uniform radiance, or with `soft` a disk of the same radius that always faces the shading point,
/// or with radius 0 a point. `intensity` is W/sr per unit of projected emitter: radiance = intensity / (pi r^2).
struct PointLight {
  Vec3 position;
  float radius = 0.0f;
  Rgb intensity;
  bool soft = true;
  friend bool operator==(const PointLight&, const PointLight&) = default;
};

/// A point light seen through a cone along `-axis_z` of `world_to_local`. The factor is
/// smoothstep((cos(theta) - cos_half_angle) / ((1 - cos_half_angle) * blend)), theta measured in light space.
struct SpotLight {
  PointLight emitter;
  Transform world_to_local;
  float cos_half_angle = 0.0f;
  float blend = 0.0f;
  friend bool operator==(const SpotLight&, const SpotLight&) = default;
};

/// A cone of directions around `direction` (from the scene towards the sun) with half angle `angle / 2`.
/// `irradiance` is W/m^2 on a plane facing it; angle 0 is a single direction.
struct SunLight {
  Vec3 direction;
  float angle = 0.0f;
  Rgb irradiance;
  friend bool operator==(const SunLight&, const SunLight&) = default;
};

/// A one-sided parallelogram (or the ellipse inscribed in it) emitting along `normal` = -Z of the light object.
struct AreaLight {
  Vec3 center, edge_u, edge_v;  // full edge vectors
  Vec3 normal;
  bool is_ellipse = false;
  Rgb radiance;        // on axis before the spread factor
  float spread = kPi;  // full angle in radians; pi = Lambertian emitter
  /// Emits nothing: light samples look for the environment through it, for those whom `normal` points to.
  bool is_portal = false;
  friend bool operator==(const AreaLight&, const AreaLight&) = default;
};

struct Light {
  std::string name;
  std::variant<PointLight, SpotLight, SunLight, AreaLight> shape;
  uint8_t visibility = kVisibleToAll;  // RayVisibility bits by which scattered rays may see the emitter
  bool casts_shadow = true;
  bool use_mis = true;     // false: sampled by next-event estimation only
  int max_bounces = 1024;  // paths with more bounces do not receive it
  LightLinks links;
  LightGroup light_group = kNoLightGroup;
  int material = -1;          // emission program multiplying the light, or -1
  Transform object_to_world;  // of the lamp object, for that program; the shape is in world space already
  bool removed = false;
  uint64_t key = 0;  // the same in all snapshots that show this lamp; 0: known by its handle
  friend bool operator==(const Light&, const Light&) = default;
};

inline bool is_portal(const Light& light) {
  const auto* area = std::get_if<AreaLight>(&light.shape);
  return area && area->is_portal;
}

}  // namespace cistern
