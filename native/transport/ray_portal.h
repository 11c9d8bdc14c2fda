#pragma once

#include <span>

#include "accel/accel.h"
#include "accel/offset_origin.h"
#include "shading/bsdf.h"

namespace cistern {

/// How a path goes on from a surface with ray portals that it does not scatter at: through one of these, or straight
/// (null) with what its transparency has beside them; by their mean weights.
struct PortalChoice {
  const RayPortal* portal;
  Rgb weight;
  float probability;
};

inline std::span<const RayPortal> portals_of(const Bsdf& bsdf) {
  return {bsdf.portals.data(), static_cast<size_t>(bsdf.portal_count)};
}

/// What passes beside the portals; black where that is but a rounding.
inline Rgb straight_transparency(const Bsdf& bsdf) {
  Rgb straight = bsdf.transparency;
  for (const RayPortal& portal : portals_of(bsdf)) straight = straight - portal.weight;
  straight = max(straight, Rgb(0.0f));
  constexpr float kRounding = 1e-6f;
  return average(straight) > kRounding * average(bsdf.transparency) ? straight : Rgb(0.0f);
}

/// `u` in [0, 1); the surface has at least one.
inline PortalChoice choose_portal(const Bsdf& bsdf, float u) {
  const std::span<const RayPortal> portals = portals_of(bsdf);
  const Rgb straight = straight_transparency(bsdf);
  const float of_straight = average(straight);
  float total = of_straight;
  for (const RayPortal& portal : portals) total += average(portal.weight);
  float left = u * total;
  if (left < of_straight) return {nullptr, straight, of_straight / total};
  left -= of_straight;
  size_t chosen = 0;
  while (chosen + 1 < portals.size() && left >= average(portals[chosen].weight))
    left -= average(portals[chosen++].weight);
  return {&portals[chosen], portals[chosen].weight, average(portals[chosen].weight) / total};
}

/// The ray that a portal of `point` sends on: from another place, or from the surface itself where that is the same.
/// From beyond a million kilometres it starts there: where an object is small, its space has no room for rays from
/// farther away (top_level.cpp).
inline Ray portal_ray(const SurfacePoint& point, const RayPortal& portal) {
  constexpr float kSamePlace = 1e-9f;  // square metres, as in Cycles
  constexpr float kFarthest = 1e9f;    // metres along an axis
  const Vec3 farthest{kFarthest, kFarthest, kFarthest};
  const bool moves = !(length_squared(portal.position - point.position) <= kSamePlace);
  return {moves ? max(-farthest, min(portal.position, farthest))
                : offset_origin(point.position, point.clearance, point.ng, portal.direction),
          portal.direction, 0.0f, INFINITY, moves ? kNoTriangle : point.triangle_id()};
}

/// The portal that most of what passes takes; null where most goes straight on.
inline const RayPortal* strongest_portal(const Bsdf& bsdf) {
  const RayPortal* strongest = nullptr;
  float most = average(straight_transparency(bsdf));
  for (const RayPortal& portal : portals_of(bsdf)) {
    if (average(portal.weight) <= most) continue;
    most = average(portal.weight);
    strongest = &portal;
  }
  return strongest;
}

/// The ray behind a surface `t` along `ray` that is looked through, by the way that most of what passes takes; counts
/// portals.
inline Ray ray_behind(Ray ray, float t, const SurfacePoint& point, const Bsdf& bsdf, PathState& state) {
  if (bsdf.portal_count > 0) ++state.portal_depth;
  if (const RayPortal* portal = strongest_portal(bsdf)) return portal_ray(point, *portal);
  ray.t_max -= t;
  ray.t_min = 0.0f;
  ray.origin = offset_origin(point.position, point.clearance, point.ng, ray.direction);
  ray.passes = point.triangle_id();
  return ray;
}

}  // namespace cistern
