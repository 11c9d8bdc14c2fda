#include "lights/area_lamp.h"

#include <limits>

#include "base/warp.h"

namespace cistern {

namespace {

/// Below this solid angle (sr) a rectangle is sampled by area: single precision no longer resolves its spherical
/// angles, and the density per solid angle hardly varies over it.
constexpr float kSmallestSolidAngle = 1e-3f;
/// Spreads below this many radians count as parallel light.
constexpr float kCollimatedSpread = 1e-4f;
/// Edges whose cosine stays below this count as orthogonal.
constexpr float kOrthogonal = 1e-4f;

/// A rectangle seen from the origin of a frame along its edges, at depth `z` < 0, with its solid angle.
/// [Ureña, Fajardo and King 2013, An Area-Preserving Parametrization for Spherical Rectangles]. The internal angles
/// g_i = acos(-n_i n_i+1) of the paper are kept as pi/2 + asin(n_i n_i+1), so that small solid angles do not cancel.
template <class Real>
struct SphericalRectangle {
  Real x0, x1, y0, y1, z;
  Real b0, b1;  // z components of the edge planes' normals at y0 and y1
  Real rest;    // asin terms 2 and 3
  Real solid_angle;
  static constexpr Real square(Real v) { return v * v; }

  SphericalRectangle(Real left, Real right, Real bottom, Real top, Real depth)
      : x0(left), x1(right), y0(bottom), y1(top), z(depth) {
    const Real z2 = square(z);
    const Real n0 = -y0 / std::sqrt(z2 + square(y0)), n1 = x1 / std::sqrt(z2 + square(x1));
    const Real n2 = y1 / std::sqrt(z2 + square(y1)), n3 = -x0 / std::sqrt(z2 + square(x0));
    rest = std::asin(n2 * n3) + std::asin(n3 * n0);
    solid_angle = std::asin(n0 * n1) + std::asin(n1 * n2) + rest;
    b0 = n0;
    b1 = n2;
  }

  /// Coordinates of the point `uv` of the rectangle, uniform over its solid angle. Paper §4, Fig. 4.
  Vec2 sample(Vec2 uv) const {
    constexpr Real kOne = 1, kBelowOne = kOne - std::numeric_limits<Real>::epsilon() / 2;
    const Real angle = uv.x * solid_angle - rest;
    const Real f = (std::cos(angle) * b0 + b1) / std::sin(angle);
    const Real c = std::clamp(std::copysign(kOne / std::sqrt(square(f) + square(b0)), f), -kBelowOne, kBelowOne);
    const Real x = std::clamp(-c * z / std::sqrt(kOne - square(c)), x0, x1);
    const Real d2 = square(x) + square(z);
    const Real h0 = y0 / std::sqrt(d2 + square(y0)), h1 = y1 / std::sqrt(d2 + square(y1));
    const Real h = std::clamp(h0 + (h1 - h0) * uv.y, -kBelowOne, kBelowOne);
    const Real y = std::clamp(h * std::sqrt(d2 / (kOne - square(h))), y0, y1);
    return {static_cast<float>(x), static_cast<float>(y)};
  }
};

/// The part of a lamp that is sampled for one receiver. Coordinates (u, v) run along the edges from the centre.
struct VisiblePart {
  enum class Measure { RECTANGLE_SOLID_ANGLE, RECTANGLE_AREA, ELLIPSE_AREA } measure = Measure::RECTANGLE_AREA;
  float u0, u1, v0, v1;
  float height;          // of the receiver above the lamp's plane, > 0
  float foot_u, foot_v;  // foot of the receiver (rectangular lamps only)
  float density;         // per solid angle, or per square metre
};

/// visit(rectangle as the receiver sees it). Close to the lamp's plane, angles between the planes through its edges are
/// nearly 0 or pi, and single precision loses what is left of their sum.
template <class Visit>
auto see_rectangle(const VisiblePart& d, const Visit& visit) {
  constexpr float kGrazing = 0.1f;
  const float x0 = d.u0 - d.foot_u, x1 = d.u1 - d.foot_u, y0 = d.v0 - d.foot_v, y1 = d.v1 - d.foot_v;
  const float reach = std::max(std::max(std::abs(x0), std::abs(x1)), std::max(std::abs(y0), std::abs(y1)));
  if (d.height < kGrazing * reach) return visit(SphericalRectangle<double>(x0, x1, y0, y1, -d.height));
  return visit(SphericalRectangle<float>(x0, x1, y0, y1, -d.height));
}

/// Spread leaves only a circle around the receiver's foot alight: keep the rectangle around it.
bool clip_to_spread(const AreaLamp& lamp, VisiblePart& part) {
  const float reach = part.height * lamp.tan_half_spread;
  part.u0 = std::max(part.u0, part.foot_u - reach);
  part.u1 = std::min(part.u1, part.foot_u + reach);
  part.v0 = std::max(part.v0, part.foot_v - reach);
  part.v1 = std::min(part.v1, part.foot_v + reach);
  return part.u0 < part.u1 && part.v0 < part.v1;
}

/// Empty where nothing of the lamp can be seen from `receiver`.
std::optional<VisiblePart> visible_part(const AreaLamp& lamp, Vec3 receiver) {
  const Vec3 from_center = receiver - lamp.center;
  VisiblePart part;
  part.height = dot(from_center, lamp.normal);
  if (!(part.height > 0.0f) || lamp.area == 0.0f) return std::nullopt;
  part.u1 = 0.5f * lamp.length_u, part.u0 = -part.u1;
  part.v1 = 0.5f * lamp.length_v, part.v0 = -part.v1;
  part.foot_u = dot(from_center, lamp.axis_u), part.foot_v = dot(from_center, lamp.axis_v);
  part.density = 1.0f / lamp.area;
  if (lamp.is_rectangular && lamp.spread_scale > 0.0f && !clip_to_spread(lamp, part)) return std::nullopt;
  const float clipped_area = (part.u1 - part.u0) * (part.v1 - part.v0);
  if (lamp.is_ellipse && (!lamp.is_rectangular || clipped_area >= lamp.area)) {
    part.measure = VisiblePart::Measure::ELLIPSE_AREA;
  } else if (lamp.is_rectangular) {
    const float solid_angle =
        see_rectangle(part, [](const auto& seen) { return static_cast<float>(seen.solid_angle); });
    const bool is_resolved = solid_angle > kSmallestSolidAngle;
    part.measure = is_resolved ? VisiblePart::Measure::RECTANGLE_SOLID_ANGLE : VisiblePart::Measure::RECTANGLE_AREA;
    part.density = 1.0f / (is_resolved ? solid_angle : clipped_area);
  }
  return part;
}

Vec2 sample_part(const AreaLamp& lamp, const VisiblePart& part, Vec2 uv) {
  switch (part.measure) {
    case VisiblePart::Measure::RECTANGLE_SOLID_ANGLE: {
      const Vec2 seen = see_rectangle(part, [uv](const auto& rectangle) { return rectangle.sample(uv); });
      return {seen.x + part.foot_u, seen.y + part.foot_v};
    }
    case VisiblePart::Measure::ELLIPSE_AREA: {
      const Vec2 disk = square_to_disk(uv);
      return {disk.x * 0.5f * lamp.length_u, disk.y * 0.5f * lamp.length_v};
    }
    case VisiblePart::Measure::RECTANGLE_AREA:
      break;
  }
  return {lerp(part.u0, part.u1, uv.x), lerp(part.v0, part.v1, uv.y)};
}

/// Density per solid angle of a point at `distance`, seen under `cos_theta` from the lamp's normal.
float pdf_solid_angle(const VisiblePart& part, float distance, float cos_theta) {
  if (part.measure == VisiblePart::Measure::RECTANGLE_SOLID_ANGLE) return part.density;
  return part.density * sqr(distance) / cos_theta;
}

/// Light leaving along -wi, relative to a Lambertian emitter; it integrates to the same flux. (A grid of slats.)
float spread_factor(const AreaLamp& lamp, Vec3 wi, float cos_theta) {
  if (lamp.spread_scale == 0.0f) return 1.0f;
  // By the cross product: small spreads need small angles to be accurate.
  const float tan_theta = length(cross(wi, lamp.normal)) / cos_theta;
  return std::max(lamp.tan_half_spread - tan_theta, 0.0f) * lamp.spread_scale;
}

bool is_inside_ellipse(const AreaLamp& lamp, float u, float v) {
  return sqr(2.0f * u / lamp.length_u) + sqr(2.0f * v / lamp.length_v) <= 1.0f;
}

/// Coordinates along the (perhaps not orthogonal) edges of an offset in the lamp's plane.
Vec2 edge_coordinates(const AreaLamp& lamp, Vec3 offset) {
  const float a = dot(offset, lamp.axis_u), b = dot(offset, lamp.axis_v);
  if (lamp.is_rectangular) return {a, b};
  const float c = dot(lamp.axis_u, lamp.axis_v);
  const float inverse_det = 1.0f / (1.0f - sqr(c));
  return {(a - c * b) * inverse_det, (b - c * a) * inverse_det};
}

bool contains(const AreaLamp& lamp, Vec2 p) {
  if (lamp.is_ellipse) return is_inside_ellipse(lamp, p.x, p.y);
  return std::abs(p.x) <= 0.5f * lamp.length_u && std::abs(p.y) <= 0.5f * lamp.length_v;
}

/// All light leaves along the normal, so one direction reaches the receiver, with the lamp's whole exitance.
std::optional<LampSample> sample_collimated(const AreaLamp& lamp, Vec3 receiver) {
  const Vec3 from_center = receiver - lamp.center;
  const float height = dot(from_center, lamp.normal);
  if (!(height > 0.0f)) return std::nullopt;
  if (!contains(lamp, edge_coordinates(lamp, from_center - height * lamp.normal))) return std::nullopt;
  return LampSample{-lamp.normal, height, lamp.radiance * kPi, 1.0f, true};
}

}  // namespace

AreaLamp make_area_lamp(const AreaLight& light) {
  AreaLamp lamp;
  lamp.center = light.center;
  lamp.length_u = length(light.edge_u), lamp.length_v = length(light.edge_v);
  lamp.axis_u = normalize_or(light.edge_u, {1.0f, 0.0f, 0.0f});
  lamp.axis_v = normalize_or(light.edge_v, {0.0f, 1.0f, 0.0f});
  // Of the plane that the edges span, on the side that was asked for: sheared lamps come with others.
  const Vec3 side = normalize_or(light.normal, {0.0f, 0.0f, -1.0f}), across = cross(light.edge_u, light.edge_v);
  lamp.normal = normalize_or(dot(across, side) < 0.0f ? -across : across, side);
  lamp.is_ellipse = light.is_ellipse;
  lamp.is_rectangular = std::abs(dot(lamp.axis_u, lamp.axis_v)) < kOrthogonal;
  lamp.area = length(cross(light.edge_u, light.edge_v)) * (light.is_ellipse ? kPi / 4.0f : 1.0f);
  lamp.radiance = light.radiance;
  lamp.is_collimated = light.spread < kCollimatedSpread;
  if (!(light.spread < kPi)) return lamp;
  const double half = 0.5 * static_cast<double>(std::max(light.spread, kCollimatedSpread)), tangent = std::tan(half);
  lamp.peak = static_cast<float>(tangent / (tangent - half));
  if (lamp.is_collimated) return lamp;
  lamp.tan_half_spread = static_cast<float>(tangent);
  lamp.spread_scale = static_cast<float>(1.0 / (tangent - half));
  return lamp;
}

std::optional<LampSample> sample_area_lamp(const AreaLamp& lamp, Vec2 uv, Vec3 receiver) {
  if (lamp.is_collimated) return sample_collimated(lamp, receiver);
  const std::optional<VisiblePart> part = visible_part(lamp, receiver);
  if (!part) return std::nullopt;
  const Vec2 point = sample_part(lamp, *part, uv);
  const bool may_miss = lamp.is_ellipse && part->measure != VisiblePart::Measure::ELLIPSE_AREA;
  if (may_miss && !is_inside_ellipse(lamp, point.x, point.y)) return std::nullopt;

  const Vec3 offset = lamp.center + lamp.axis_u * point.x + lamp.axis_v * point.y - receiver;
  const float distance = length(offset);
  const float cos_theta = part->height / distance;
  const Vec3 wi = offset * (1.0f / distance);
  const float factor = spread_factor(lamp, wi, cos_theta);
  if (factor == 0.0f) return std::nullopt;
  const float pdf = pdf_solid_angle(*part, distance, cos_theta);
  return LampSample{wi, distance, lamp.radiance * factor, pdf, false};
}

std::optional<LampSample> intersect_area_lamp(const AreaLamp& lamp, const Ray& ray) {
  const float cos_theta = -dot(ray.direction, lamp.normal);
  const float height = dot(ray.origin - lamp.center, lamp.normal);
  if (!(cos_theta > 0.0f) || !(height > 0.0f)) return std::nullopt;
  const float distance = height / cos_theta;
  if (distance <= ray.t_min || distance >= ray.t_max) return std::nullopt;
  const Vec3 offset = ray.origin + ray.direction * distance - lamp.center;
  if (!contains(lamp, edge_coordinates(lamp, offset))) return std::nullopt;
  const float factor = spread_factor(lamp, ray.direction, cos_theta);
  if (factor == 0.0f) return std::nullopt;
  const std::optional<VisiblePart> part = visible_part(lamp, ray.origin);
  if (!part) return std::nullopt;
  return LampSample{ray.direction, distance, lamp.radiance * factor, pdf_solid_angle(*part, distance, cos_theta),
                    false};
}

Vec2 area_lamp_uv(const AreaLamp& lamp, Vec3 position) {
  const Vec2 along = edge_coordinates(lamp, position - lamp.center);
  return {along.x / lamp.length_u + 0.5f, along.y / lamp.length_v + 0.5f};
}

}  // namespace cistern
