#include "lights/spherical_triangle.h"

#include "base/angle.h"

namespace cistern {
namespace {

/// Triangles whose centre is farther than so many of their longest edge are sampled by area.
constexpr float kNearEdges = 1.0f;
/// And those that take less than this of all directions (turns of half a solid angle): nearly edge-on, or slivers.
constexpr float kLeastHalfTurns = 1e-4f;

/// Where a ray meets the plane of a triangle, in its barycentric coordinates.
struct PlanePoint {
  float b1, b2, distance;
};
/// Empty where they are parallel. [Moeller and Trumbore 1997]
std::optional<PlanePoint> meet_plane(const EmissiveTriangle& triangle, Vec3 origin, Vec3 direction) {
  const Vec3 from_corner = origin - triangle.p0;
  const Vec3 p = cross(direction, triangle.edge_2), q = cross(from_corner, triangle.edge_1);
  const float scale = 1.0f / dot(p, triangle.edge_1);
  if (!std::isfinite(scale)) return std::nullopt;
  return PlanePoint{dot(p, from_corner) * scale, dot(q, direction) * scale, dot(q, triangle.edge_2) * scale};
}

}  // namespace

std::optional<SphericalTriangle> SphericalTriangle::of(const EmissiveTriangle& triangle, Vec3 receiver) {
  const Vec3 to_corner = triangle.p0 - receiver;
  const Vec3 to_center = to_corner + (triangle.edge_1 + triangle.edge_2) * (1.0f / 3.0f);
  const float longest = std::max(std::max(length_squared(triangle.edge_1), length_squared(triangle.edge_2)),
                                 length_squared(triangle.edge_2 - triangle.edge_1));
  if (!(length_squared(to_center) < sqr(kNearEdges) * longest)) return std::nullopt;
  SphericalTriangle seen;
  seen.a_ = normalize(to_corner);
  seen.b_ = normalize(to_corner + triangle.edge_1);
  seen.c_ = normalize(to_corner + triangle.edge_2);
  const float volume = std::abs(dot(seen.a_, cross(seen.b_, seen.c_)));
  const float sum = 1.0f + dot(seen.a_, seen.b_) + dot(seen.b_, seen.c_) + dot(seen.c_, seen.a_);
  seen.half_turns_ = azimuth_turns(volume, sum);
  if (!(seen.half_turns_ > kLeastHalfTurns)) return std::nullopt;  // also where a corner is the receiver
  seen.pdf_ = 1.0f / (4.0f * kPi * seen.half_turns_);
  return seen;
}

/// Arvo's two steps: a corner c' on the arc from a to c, so that the triangle a b c' has the share u.x of the area, and
/// then the point of the arc from b to c' that has u.y of the height. With t the angle from a to c', the tangent of
/// half the area of a b c' is tan(t/2) volume / (1 + a b + tan(t/2) b t_a), t_a being the tangent at a. Next to an edge
/// a and b are nearly opposite: what matters of b is then its sum with a, which t_a is at right angles to.
Vec3 SphericalTriangle::direction(Vec2 u) const {
  const Vec3 tangent = normalize(c_ - dot(a_, c_) * a_), middle = a_ + b_;
  const float volume = std::abs(dot(middle, cross(b_, tangent)));
  const SineCosine half_area = sine_cosine_of_turns(u.x * half_turns_);
  const float along = half_area.sine * 0.5f * length_squared(middle);
  const float across = half_area.cosine * volume - half_area.sine * dot(middle, tangent);
  const float scale = 1.0f / (sqr(along) + sqr(across));
  const Vec3 corner = ((sqr(across) - sqr(along)) * scale) * a_ + (2.0f * along * across * scale) * tangent;
  const Vec3 from_b = corner - b_;
  const float height = u.y * 0.5f * length_squared(from_b);  // 1 - cosine of the angle from b
  const Vec3 upwards = normalize_or(corner - dot(corner, b_) * b_, {});
  return normalize((1.0f - height) * b_ + safe_sqrt(height * (2.0f - height)) * upwards);
}

Vec2 barycentric_along(const EmissiveTriangle& triangle, Vec3 receiver, Vec3 direction) {
  const std::optional<PlanePoint> point = meet_plane(triangle, receiver, direction);
  const float b1 = point ? clamp01(point->b1) : 0.0f, b2 = point ? clamp01(point->b2) : 0.0f;
  const float outside = std::max(b1 + b2, 1.0f);
  return {b1 / outside, b2 / outside};
}

std::optional<Vec2> find_barycentric(const EmissiveTriangle& triangle, Vec3 receiver, Vec3 direction) {
  const std::optional<PlanePoint> point = meet_plane(triangle, receiver, direction);
  const bool is_met = point && point->b1 >= 0.0f && point->b2 >= 0.0f && point->b1 + point->b2 <= 1.0f;
  return is_met && point->distance > 0.0f ? std::optional(Vec2{point->b1, point->b2}) : std::nullopt;
}

}  // namespace cistern
