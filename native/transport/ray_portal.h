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

/// `u` in [0, 1); the surface has at least one.
inline PortalChoice choose_portal(const Bsdf& bsdf, float u) {
  const std::span<const RayPortal> portals(bsdf.portals.data(), static_cast<size_t>(bsdf.portal_count));
  Rgb straight = bsdf.transparency;
  float total = 0.0f;
  for (const RayPortal& portal : portals) {
    straight = straight - portal.weight;
    total += average(portal.weight);
  }
  straight = max(straight, Rgb(0.0f));  // roundings
  constexpr float kRounding = 1e-6f;
  const float of_straight = average(straight) > kRounding * total ? average(straight) : 0.0f;
  total += of_straight;
  float left = u * total;
  if (left < of_straight) return {nullptr, straight, of_straight / total};
  left -= of_straight;
  size_t chosen = 0;
  while (chosen + 1 < portals.size() && left >= average(portals[chosen].weight))
    left -= average(portals[chosen++].weight);
  return {&portals[chosen], portals[chosen].weight, average(portals[chosen].weight) / total};
}

/// The ray that a portal of `point` sends on: from another place, or from the surface itself where that is the same.
/// From places that are so far away that Embree ends the process it starts nearer, where there is nothing either.
inline Ray portal_ray(const SurfacePoint& point, const RayPortal& portal) {
  constexpr float kSamePlace = 1e-9f;  // square metres, as in Cycles
  constexpr float kFarthest = 1e18f;   // metres along an axis
  const Vec3 farthest{kFarthest, kFarthest, kFarthest};
  const bool moves = !(length_squared(portal.position - point.position) <= kSamePlace);
  return {moves ? max(-farthest, min(portal.position, farthest))
                : offset_origin(point.position, point.clearance, point.ng, portal.direction),
          portal.direction};
}

}  // namespace cistern
