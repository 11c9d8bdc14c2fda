#include "lights/lit_part.h"

#include <algorithm>
#include <array>

namespace cistern {
namespace {

/// Before a plane through `center`.
std::optional<LitPart> in_front(const Vec3& center, const Vec3& normal, const Vec3& origin, const Vec3& direction,
                                float length) {
  const float height = dot(origin - center, normal), slope = dot(direction, normal);
  LitPart part{0.0f, length};
  if (slope != 0.0f) (slope > 0.0f ? part.begin : part.end) = std::clamp(-height / slope, 0.0f, length);
  const bool is_lit = slope != 0.0f ? part.begin < part.end : height > 0.0f;
  return is_lit ? std::optional(part) : std::nullopt;
}

/// In a cone about -z whose tip is the origin; the ray need not have unit direction.
std::optional<LitPart> in_cone(float cosine, const Vec3& o, const Vec3& d, float length) {
  const float c2 = sqr(cosine);
  const float a = sqr(d.z) - c2 * length_squared(d), b = o.z * d.z - c2 * dot(o, d),
              c = sqr(o.z) - c2 * length_squared(o);
  std::array<float, 4> edges{0.0f, 0.0f, 0.0f, length};
  const float discriminant = b * b - a * c;
  if (a != 0.0f && discriminant > 0.0f) {
    const float root = std::sqrt(discriminant);
    edges[1] = std::clamp((-b - root) / a, 0.0f, length);
    edges[2] = std::clamp((-b + root) / a, 0.0f, length);
    if (edges[1] > edges[2]) std::swap(edges[1], edges[2]);
  }
  std::optional<LitPart> part;
  for (size_t i = 0; i + 1 < edges.size(); ++i) {
    if (!(edges[i] < edges[i + 1])) continue;
    const float middle = std::isfinite(edges[i + 1]) ? 0.5f * (edges[i] + edges[i + 1]) : 2.0f * edges[i] + 1.0f;
    const Vec3 p = o + middle * d;
    if (!(-p.z > cosine * cistern::length(p))) continue;
    part = {part ? part->begin : edges[i], edges[i + 1]};
  }
  return part;
}

}  // namespace

std::optional<LitPart> lit_part(const Lamp& lamp, const Vec3& origin, const Vec3& direction, float length) {
  if (const auto* area = std::get_if<AreaLamp>(&lamp))
    return in_front(area->center, area->normal, origin, direction, length);
  const auto* ball = std::get_if<BallLamp>(&lamp);
  if (!ball || !ball->has_cone || ball->cos_half_angle <= 0.0f) return LitPart{0.0f, length};
  const Transform& to_local = ball->world_to_local;
  // Light from the ball's rim leaves a cone whose tip lies that much farther back.
  const float sine = safe_sqrt(1.0f - sqr(ball->cos_half_angle));
  const Vec3 axis = to_local.vector(ball->position - origin);
  const float back = sine > 0.0f ? ball->radius / sine * cistern::length(axis) /
                                       std::max(cistern::length(ball->position - origin), 1e-20f)
                                 : 0.0f;
  return in_cone(ball->cos_half_angle, -axis - Vec3{0.0f, 0.0f, back}, to_local.vector(direction), length);
}

}  // namespace cistern
