#include "lights/lamp_shapes.h"

#include <limits>
#include <tuple>

#include "base/frame.h"
#include "base/warp.h"
#include "lights/area_lamp.h"

namespace cistern {

namespace {

/// 1 - cos(x) from sin(x)^2, without cancellation, for x up to 90 degrees.
float one_minus_cos_of(float sin_squared) { return sin_squared / (1.0f + safe_sqrt(1.0f - sin_squared)); }

float cone_pdf(float one_minus_cos) { return 1.0f / (2.0f * kPi * one_minus_cos); }

BallLamp make_ball(const PointLight& light) {
  BallLamp lamp;
  lamp.position = light.position;
  lamp.radius = light.radius;
  lamp.is_disk = light.soft;
  lamp.emission = light.radius > 0.0f ? light.intensity * (1.0f / (kPi * sqr(light.radius))) : light.intensity;
  return lamp;
}

BallLamp make_spot(const SpotLight& light) {
  BallLamp lamp = make_ball(light.emitter);
  lamp.has_cone = true;
  lamp.world_to_local = light.world_to_local;
  lamp.cos_half_angle = light.cos_half_angle;
  lamp.inverse_blend_range = 1.0f / ((1.0f - light.cos_half_angle) * light.blend);
  return lamp;
}

SunLamp make_sun(const SunLight& light) {
  SunLamp lamp;
  const float half = std::min(0.5f * light.angle, kPi / 2.0f);
  lamp.direction = normalize(light.direction);
  lamp.one_minus_cos = 2.0f * sqr(std::sin(0.5f * half));
  lamp.irradiance = magnitude(light.irradiance);
  lamp.emission = half > 0.0f ? light.irradiance * (1.0f / (kPi * sqr(std::sin(half)))) : light.irradiance;
  return lamp;
}

/// Share of a spot's light that leaves along -wi.
float cone_factor(const BallLamp& lamp, Vec3 wi) {
  if (!lamp.has_cone) return 1.0f;
  const Vec3 local = normalize_or(lamp.world_to_local.vector(-wi), {0.0f, 0.0f, 1.0f});
  const float above = -local.z - lamp.cos_half_angle;
  if (above <= 0.0f) return 0.0f;
  const float x = std::min(above * lamp.inverse_blend_range, 1.0f);
  return x * x * (3.0f - 2.0f * x);
}

/// The directions in which a ball of some radius is seen: sampling them uniformly has less noise than sampling its
/// area, for the disk as for the sphere.
struct BallView {
  Vec3 axis;              // towards the centre
  float distance = 0.0f;  // to the centre
  bool is_inside = false;
  float one_minus_cos = 2.0f;  // of the half angle; 2 = every direction
  float pdf() const { return cone_pdf(one_minus_cos); }
};

BallView view_ball(const BallLamp& lamp, Vec3 receiver) {
  const Vec3 to_center = lamp.position - receiver;
  const float d2 = length_squared(to_center), r2 = sqr(lamp.radius);
  BallView view{normalize_or(to_center, {0.0f, 0.0f, 1.0f}), std::sqrt(d2)};
  view.is_inside = !lamp.is_disk && d2 <= r2;
  if (!view.is_inside) view.one_minus_cos = one_minus_cos_of(lamp.is_disk ? r2 / (d2 + r2) : r2 / d2);
  return view;
}

/// Distance to the ball in a direction at an angle to the axis that lies within the view.
float distance_to_ball(const BallLamp& lamp, const BallView& view, float cos_theta, float sin2_theta) {
  if (lamp.is_disk) return view.distance / std::max(cos_theta, std::numeric_limits<float>::min());
  const float half_chord = safe_sqrt(sqr(lamp.radius) - sqr(view.distance) * sin2_theta);
  return view.distance * cos_theta + (view.is_inside ? half_chord : -half_chord);
}

std::optional<LampSample> sample_ball(const BallLamp& lamp, Vec2 uv, Vec3 receiver) {
  const BallView view = view_ball(lamp, receiver);
  if (lamp.radius == 0.0f) {
    if (view.distance == 0.0f) return std::nullopt;
    const float factor = cone_factor(lamp, view.axis) / sqr(view.distance);
    if (factor == 0.0f) return std::nullopt;
    return LampSample{view.axis, view.distance, lamp.emission * factor, 1.0f, true};
  }
  const Vec3 local = square_to_cone(uv, view.one_minus_cos);
  const Vec3 wi = Frame(view.axis).to_world(local);
  // As in Cycles a spot's cone does not darken the inside of its sphere.
  const float factor = view.is_inside ? 1.0f : cone_factor(lamp, wi);
  if (factor == 0.0f) return std::nullopt;
  const float distance = distance_to_ball(lamp, view, local.z, sqr(local.x) + sqr(local.y));
  return LampSample{wi, distance, lamp.emission * factor, view.pdf(), false};
}

std::optional<LampSample> intersect_ball(const BallLamp& lamp, const Ray& ray) {
  const BallView view = view_ball(lamp, ray.origin);
  // The sine of the angle by a cross product and not by the cosine: cones of distant lamps are tiny.
  const float cos_theta = dot(view.axis, ray.direction);
  const float sin2_theta = length_squared(cross(view.axis, ray.direction));
  if (!view.is_inside) {
    const float sin2_max = view.one_minus_cos * (2.0f - view.one_minus_cos);
    if (cos_theta <= 0.0f || sin2_theta > sin2_max) return std::nullopt;
  }
  const float distance = distance_to_ball(lamp, view, cos_theta, sin2_theta);
  if (distance <= ray.t_min || distance >= ray.t_max) return std::nullopt;
  const float factor = view.is_inside ? 1.0f : cone_factor(lamp, ray.direction);
  if (factor == 0.0f) return std::nullopt;
  return LampSample{ray.direction, distance, lamp.emission * factor, view.pdf(), false};
}

LampSample sample_sun(const SunLamp& lamp, Vec2 uv) {
  if (lamp.one_minus_cos == 0.0f) return {lamp.direction, INFINITY, lamp.emission, 1.0f, true};
  const Vec3 wi = Frame(lamp.direction).to_world(square_to_cone(uv, lamp.one_minus_cos));
  return {wi, INFINITY, lamp.emission, cone_pdf(lamp.one_minus_cos), false};
}

std::optional<LampSample> intersect_sun(const SunLamp& lamp, const Ray& ray) {
  const float cos_theta = dot(lamp.direction, ray.direction);
  const float sin2_max = lamp.one_minus_cos * (2.0f - lamp.one_minus_cos);
  if (std::isfinite(ray.t_max) || cos_theta <= 0.0f) return std::nullopt;
  if (length_squared(cross(lamp.direction, ray.direction)) > sin2_max) return std::nullopt;
  return LampSample{ray.direction, INFINITY, lamp.emission, cone_pdf(lamp.one_minus_cos), false};
}

/// Cosine of the widest angle between the spot's axis and its light in world space, where a scaled lamp has an
/// elliptical cone; and that axis.
std::pair<Vec3, float> world_cone(const BallLamp& lamp) {
  constexpr int kEdgeSamples = 64;
  constexpr float kBetweenSamples = 0.01f;  // the edge is smooth: between two samples it bulges by less
  const Transform to_world = inverse(lamp.world_to_local);
  const Vec3 axis = normalize_or(to_world.vector({0.0f, 0.0f, -1.0f}), {0.0f, 0.0f, -1.0f});
  if (lamp.cos_half_angle <= 0.0f) return {axis, -1.0f};
  const float sine = safe_sqrt(1.0f - sqr(lamp.cos_half_angle));
  float cos_widest = 1.0f;
  for (int i = 0; i < kEdgeSamples; ++i) {
    const float angle = 2.0f * kPi * static_cast<float>(i) / kEdgeSamples;
    const Vec3 edge = to_world.vector({sine * std::cos(angle), sine * std::sin(angle), -lamp.cos_half_angle});
    cos_widest = std::min(cos_widest, dot(axis, normalize_or(edge, axis)));
  }
  return {axis, std::max(cos_widest - kBetweenSamples, -1.0f)};
}

/// Intensity seen from far away.
float ball_intensity(const BallLamp& lamp) {
  return magnitude(lamp.emission) * (lamp.radius > 0.0f ? kPi * sqr(lamp.radius) : 1.0f);
}

LightBounds ball_bounds(const BallLamp& lamp) {
  LightBounds bounds;
  const Vec3 r{lamp.radius, lamp.radius, lamp.radius};
  bounds.box = {lamp.position - r, lamp.position + r};
  bounds.intensity = ball_intensity(lamp);
  if (lamp.has_cone) {
    std::tie(bounds.axis, bounds.cos_normals) = world_cone(lamp);
    bounds.cos_emission = 1.0f;  // the cone of normals holds all its light
  }
  // Nobody receives more than from a lamp that fills the hemisphere or, of a spot, its cone.
  const float filled = bounds.cos_normals > 0.0f ? 1.0f - sqr(bounds.cos_normals) : 1.0f;
  if (lamp.radius > 0.0f && filled > 0.0f) bounds.near_distance2 = sqr(lamp.radius) / filled;
  return bounds;
}

LightBounds area_bounds(const AreaLamp& lamp) {
  LightBounds bounds;
  const Vec3 u = lamp.axis_u * (0.5f * lamp.length_u), v = lamp.axis_v * (0.5f * lamp.length_v);
  for (const Vec3 corner : {u + v, u - v, -u + v, -u - v}) bounds.box.extend(lamp.center + corner);
  bounds.axis = lamp.normal;
  bounds.cos_normals = 1.0f;
  const float tan_h = lamp.tan_half_spread;
  bounds.cos_emission = lamp.is_collimated ? 1.0f : (std::isinf(tan_h) ? 0.0f : 1.0f / std::sqrt(1.0f + sqr(tan_h)));
  bounds.intensity = magnitude(lamp.radiance) * lamp.area * lamp.peak;
  bounds.near_distance2 = lamp.area * lamp.peak * kInvPi;  // nobody receives more than the lamp sends from each point
  return bounds;
}

}  // namespace

Lamp make_lamp(const Light& light) {
  if (const auto* point = std::get_if<PointLight>(&light.shape)) return make_ball(*point);
  if (const auto* spot = std::get_if<SpotLight>(&light.shape)) return make_spot(*spot);
  if (const auto* sun = std::get_if<SunLight>(&light.shape)) return make_sun(*sun);
  return make_area_lamp(std::get<AreaLight>(light.shape));
}

std::optional<LampSample> sample_lamp(const Lamp& lamp, Vec2 uv, Vec3 receiver) {
  if (const auto* ball = std::get_if<BallLamp>(&lamp)) return sample_ball(*ball, uv, receiver);
  if (const auto* sun = std::get_if<SunLamp>(&lamp)) return sample_sun(*sun, uv);
  return sample_area_lamp(*std::get_if<AreaLamp>(&lamp), uv, receiver);
}

std::optional<LampSample> intersect_lamp(const Lamp& lamp, const Ray& ray) {
  if (!has_extent(lamp)) return std::nullopt;
  if (const auto* ball = std::get_if<BallLamp>(&lamp)) return intersect_ball(*ball, ray);
  if (const auto* sun = std::get_if<SunLamp>(&lamp)) return intersect_sun(*sun, ray);
  return intersect_area_lamp(*std::get_if<AreaLamp>(&lamp), ray);
}

Vec2 lamp_uv(const Lamp& lamp, Vec3 position) {
  const auto* area = std::get_if<AreaLamp>(&lamp);
  return area != nullptr ? area_lamp_uv(*area, position) : Vec2{};
}

Vec3 lamp_normal(const Lamp& lamp, Vec3 wi) {
  const auto* area = std::get_if<AreaLamp>(&lamp);
  return area != nullptr ? area->normal : -wi;
}

bool has_extent(const Lamp& lamp) {
  if (const auto* ball = std::get_if<BallLamp>(&lamp)) return ball->radius > 0.0f;
  if (const auto* sun = std::get_if<SunLamp>(&lamp)) return sun->one_minus_cos > 0.0f;
  const AreaLamp& area = *std::get_if<AreaLamp>(&lamp);
  return !area.is_collimated && area.area > 0.0f;
}

bool is_sun(const Lamp& lamp) { return std::holds_alternative<SunLamp>(lamp); }

float lamp_power(const Lamp& lamp, float scene_radius) {
  if (const auto* sun = std::get_if<SunLamp>(&lamp)) return kPi * sqr(scene_radius) * sun->irradiance;
  if (const auto* area = std::get_if<AreaLamp>(&lamp)) return kPi * area->area * magnitude(area->radiance);
  const BallLamp& ball = std::get<BallLamp>(lamp);
  const float solid_angle = 2.0f * kPi * (ball.has_cone ? 1.0f - ball.cos_half_angle : 2.0f);
  return ball_intensity(ball) * solid_angle;
}

LightBounds lamp_bounds(const Lamp& lamp) {
  if (const auto* area = std::get_if<AreaLamp>(&lamp)) return area_bounds(*area);
  return ball_bounds(std::get<BallLamp>(lamp));
}

}  // namespace cistern
