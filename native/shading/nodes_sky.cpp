#include "shading/nodes_sky.h"

#include <algorithm>

namespace cistern {

namespace {

constexpr float kLimbDarkening = 0.6f;

/// Between unit vectors, accurate for small angles too.
float angle_between(Vec3 a, Vec3 b) { return 2.0f * std::asin(std::min(0.5f * length(a - b), 1.0f)); }

}  // namespace

Vec3 sun_disc_node(const SunDisc& disc, Vec3 direction, Vec3 sky, bool hides_sky) {
  const Vec3 d = normalize_or(direction, {});
  if (!(length_squared(d - disc.direction) < sqr(disc.half_angle))) return sky;  // a chord is no longer than its arc
  const float r = angle_between(d, disc.direction) / disc.half_angle;
  const float elevation = std::asin(std::clamp(d.z, -1.0f, 1.0f));
  if (!(r < 1.0f) || elevation <= disc.horizon) return sky;
  const float limb = 1.0f - kLimbDarkening * (1.0f - safe_sqrt(1.0f - r * r));
  const float height = (elevation - disc.bottom_elevation) / (disc.top_elevation - disc.bottom_elevation);
  const Vec3 sun = lerp(disc.bottom, disc.top, clamp01(height)) * limb;
  return hides_sky ? sun : sky + sun;
}

}  // namespace cistern
