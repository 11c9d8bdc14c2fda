#include "lights/portals.h"

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

}  // namespace

Portals::Portals(std::span<const Light> lights) {
  for (const Light& light : lights) {
    if (light.removed || !is_portal(light)) continue;
    AreaLight even = std::get<AreaLight>(light.shape);
    even.radiance = Rgb(1.0f);
    even.spread = kPi;
    const AreaLamp portal = make_area_lamp(even);
    if (portal.area > 0.0f) portals_.push_back(portal);
  }
}

float Portals::total_weight(Vec3 receiver) const {
  float total = 0.0f;
  for (const AreaLamp& portal : portals_) total += weight(portal, receiver);
  return total;
}

bool Portals::can_light(Vec3 receiver) const { return total_weight(receiver) > 0.0f; }

std::optional<Vec3> Portals::sample(Vec2 uv, Vec3 receiver) const {
  float left = uv.x * total_weight(receiver);
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
