#pragma once

#include <optional>
#include <variant>

#include "accel/accel.h"
#include "lights/light_bounds.h"
#include "scene/light.h"

namespace cistern {

// Lamps as sampling needs them: the physics of scene/light.h with everything that does not depend on the receiver
// worked out beforehand.

/// A point or spot light: a point, a sphere, or a disk that faces the receiver.
struct BallLamp {
  Vec3 position;
  float radius = 0.0f;
  bool is_disk = false;
  Rgb emission;  // radiance, or with radius 0 the intensity
  bool has_cone = false;
  Transform world_to_local;  // of the cone
  float cos_half_angle = -1.0f;
  float inverse_blend_range = INFINITY;
};

struct SunLamp {
  Vec3 direction;
  float one_minus_cos = 0.0f;  // of half the angle; 0 = a single direction
  Rgb emission;                // radiance, or for a single direction the irradiance
  float irradiance = 0.0f;     // magnitude, on a plane facing the sun
};

struct AreaLamp {
  Vec3 center, axis_u, axis_v, normal;  // unit axes along the edges
  float length_u = 0.0f, length_v = 0.0f;
  float area = 0.0f;
  bool is_ellipse = false;
  bool is_rectangular = true;  // the edges are orthogonal; otherwise sampled by area
  bool is_collimated = false;  // spread 0: light leaves along the normal only
  Rgb radiance;                // before the spread factor
  float tan_half_spread = INFINITY;
  float spread_scale = 0.0f;  // 1 / (tan(h) - h) with h half the spread
  float peak = 1.0f;          // intensity along the normal, over that of a Lambertian emitter of the same flux
};

using Lamp = std::variant<BallLamp, SunLamp, AreaLamp>;

/// A point of a lamp as seen from a receiver: fields as in IncidentLight.
struct LampSample {
  Vec3 wi;
  float distance = 0.0f;
  Rgb radiance;
  float pdf = 0.0f;
  bool is_delta = false;
};

Lamp make_lamp(const Light& light);

/// The point `uv` of the lamp seen from `receiver`; empty where it sends nothing there.
std::optional<LampSample> sample_lamp(const Lamp& lamp, Vec2 uv, Vec3 receiver);
/// Where `ray` crosses a lamp between its ends; `pdf` is that of `sample_lamp` from the ray's origin for its direction.
/// Empty for lamps without extent. Suns count only for rays without end.
std::optional<LampSample> intersect_lamp(const Lamp& lamp, const Ray& ray);

/// Whether a scattered ray can meet the lamp.
bool has_extent(const Lamp& lamp);
bool is_sun(const Lamp& lamp);
/// Magnitude of the flux in watts; a sun's through a disk of `scene_radius` metres facing it.
float lamp_power(const Lamp& lamp, float scene_radius);
/// Where a point of the lamp is on it: of an area lamp, 0 to 1 along its edges; (0, 0) of others, which have no UV map.
Vec2 lamp_uv(const Lamp& lamp, Vec3 position);
/// The unit normal there that materials see; `wi` leads from the receiver to the point. Round lamps face who sees them.
Vec3 lamp_normal(const Lamp& lamp, Vec3 wi);
/// Of a lamp that is not a sun.
LightBounds lamp_bounds(const Lamp& lamp);

}  // namespace cistern
