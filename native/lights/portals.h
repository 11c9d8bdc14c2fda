#pragma once

#include <optional>
#include <span>
#include <vector>

#include "lights/lamp_shapes.h"

namespace cistern {

/// Openings through which the environment lights an interior: area lamps that emit nothing and show where to look.
/// Directions are sampled evenly over one of the openings that a receiver is in front of, chosen about in proportion to
/// the solid angle it is seen under. What lies in the way is for shadow rays to find.
class Portals {
 public:
  Portals() = default;
  explicit Portals(std::span<const Light> lights, std::span<const AreaLight> openings = {});

  bool is_empty() const { return portals_.empty(); }
  size_t memory_bytes() const { return portals_.capacity() * sizeof(AreaLamp); }

  /// Whether a portal faces the receiver: else there is nothing to sample.
  bool can_light(Vec3 receiver) const;
  /// About how much of a hemisphere the portals in front of the receiver fill, [0, 1]; 0 where none is.
  float seen_share(Vec3 receiver) const;
  /// Unit direction from the receiver, away from the scene. Empty where rounding puts the receiver into the portal.
  std::optional<Vec3> sample(Vec2 uv, Vec3 receiver) const;
  /// Density of `sample` per solid angle.
  float pdf(Vec3 direction, Vec3 receiver) const;

 private:
  void add(AreaLight shape);

  std::vector<AreaLamp> portals_;
};

}  // namespace cistern
