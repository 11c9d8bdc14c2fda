#include "lights/portals.h"

#include <algorithm>

#include "lights/area_lamp.h"

namespace cistern {
namespace {

/// About the solid angle: that of a small opening, and a hemisphere for a receiver that lies in it. 0 from behind.
float weight(const AreaLamp& portal, Vec3 receiver) {
  const Vec3 offset = receiver - portal.center;
  const float height = dot(offset, portal.normal);
  if (!(height > 0.0f)) return 0.0f;
  const float d2 = length_squared(offset), shown = portal.area * height;
  return shown / (d2 * std::sqrt(d2) + shown / (2.0f * kPi));
}

float total_weight(std::span<const AreaLamp> portals, Vec3 receiver) {
  float total = 0.0f;
  for (const AreaLamp& portal : portals) total += weight(portal, receiver);
  return total;
}

}  // namespace

Portals::Portals(std::span<const Light> lights, std::span<const AreaLight> openings) {
  for (const Light& light : lights)
    if (!light.removed && is_portal(light)) add(std::get<AreaLight>(light.shape));
  for (const AreaLight& opening : openings) add(opening);
}

void Portals::add(AreaLight shape) {
  shape.radiance = Rgb(1.0f);
  shape.spread = kPi;
  const AreaLamp portal = make_area_lamp(shape);
  if (portal.area > 0.0f) portals_.push_back(portal);
}

bool Portals::can_light(Vec3 receiver) const {
  return std::ranges::any_of(portals_, [&](const AreaLamp& portal) { return weight(portal, receiver) > 0.0f; });
}

float Portals::seen_share(Vec3 receiver) const {
  return std::min(total_weight(portals_, receiver) / (2.0f * kPi), 1.0f);
}

std::optional<Vec3> Portals::sample(Vec2 uv, Vec3 receiver) const {
  float left = uv.x * total_weight(portals_, receiver);
  const AreaLamp* chosen = nullptr;
  float chosen_weight = 1.0f;
  for (const AreaLamp& portal : portals_) {
    const float w = weight(portal, receiver);
    if (!(w > 0.0f)) continue;
    if (chosen) left -= chosen_weight;
    chosen = &portal;
    chosen_weight = w;
    if (left < w) break;
  }
  if (!chosen) return std::nullopt;
  const float rest = std::clamp(left / chosen_weight, 0.0f, kOneMinusEpsilon);
  const std::optional<LampSample> sample = sample_area_lamp(*chosen, {rest, uv.y}, receiver);
  return sample ? std::optional(sample->wi) : std::nullopt;
}

float Portals::pdf(Vec3 direction, Vec3 receiver) const {
  float sum = 0.0f, total = 0.0f;
  for (const AreaLamp& portal : portals_) {
    const float w = weight(portal, receiver);
    if (!(w > 0.0f)) continue;
    total += w;
    if (const std::optional<LampSample> met = intersect_area_lamp(portal, Ray{receiver, direction}))
      sum += w * met->pdf;
  }
  return total > 0.0f ? sum / total : 0.0f;
}

}  // namespace cistern
