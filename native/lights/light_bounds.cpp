#include "lights/light_bounds.h"

namespace cistern {

namespace {

/// Cosine of the angle between the axis and the far edge of a cone: cos(a + b), or -1 beyond pi.
float cos_far_edge(float cos_a, float cos_b) {
  const float sin_a = safe_sqrt(1.0f - sqr(cos_a)), sin_b = safe_sqrt(1.0f - sqr(cos_b));
  if (sin_a * cos_b + cos_a * sin_b < 0.0f) return -1.0f;
  return cos_a * cos_b - sin_a * sin_b;
}

/// With which the whole, seen from within its box, is as strong as its parts are together.
float merged_near_distance2(const LightBounds& all, std::span<const LightBounds> parts) {
  const float radius2 = 0.25f * length_squared(all.box.diagonal());
  bool matters = false;
  float irradiance = 0.0f;
  for (const LightBounds& part : parts) {
    matters = matters || part.near_distance2 > radius2;
    irradiance += part.intensity / std::max(part.near_distance2, radius2);
  }
  return matters && irradiance > 0.0f ? all.intensity / irradiance : 0.0f;
}

}  // namespace

LightBounds merge(std::span<const LightBounds> parts) {
  LightBounds all = parts[0];
  bool all_two_sided = true;
  for (const LightBounds& part : parts) all_two_sided = all_two_sided && part.is_two_sided;
  // The normal of a two-sided emitter has no sign: turned towards the others it makes the narrower cone.
  const auto oriented = [&](const LightBounds& part) {
    return all_two_sided && dot(part.axis, parts[0].axis) < 0.0f ? -part.axis : part.axis;
  };
  Vec3 sum;
  for (const LightBounds& part : parts) sum += oriented(part);
  all.axis = normalize_or(sum, parts[0].axis);
  all.intensity = 0.0f;
  all.cos_normals = 1.0f;
  for (const LightBounds& part : parts) {
    const float cos_between = std::clamp(dot(all.axis, oriented(part)), -1.0f, 1.0f);
    all.cos_normals = std::min(all.cos_normals, cos_far_edge(cos_between, part.cos_normals));
    all.cos_emission = std::min(all.cos_emission, part.cos_emission);
    all.box.extend(part.box);
    all.intensity += part.intensity;
    all.is_two_sided = all.is_two_sided || part.is_two_sided;
  }
  all.near_distance2 = merged_near_distance2(all, parts);
  return all;
}

}  // namespace cistern
