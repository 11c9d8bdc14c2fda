#pragma once

#include <array>
#include <span>

#include "base/frame.h"

namespace cistern {

/// A density over all directions: a sum of few lobes, each about an axis.
///
/// With r the distance of w from the axis on the unit sphere, that of a lobe is proportional to 1 / (1 + r^2 / a^2)^2:
/// half of it is within r = a if that is small, and it is above 0 everywhere. Circles about an axis have the area pi
/// r^2 [Archimedes], so it is the density of the slopes of GGX [Walter et al. 2007] on the sphere.
class DirectionLobes {
 public:
  static constexpr size_t kMost = 4;

  struct Lobe {
    Vec3 axis;                   // unit, as seen from `from`
    float square_radius = 0.0f;  // a^2, above 0
    float share = 0.0f;          // of the directions; all together 1
    Vec3 from{};                 // m
    float nearness = 0.0f;       // one over the distance of what the axis points to, 1/m
    float at_axis = 0.0f;        // share times the density there

    /// The axis as seen from a place.
    Vec3 axis_at(const Vec3& position) const {
      return nearness == 0.0f ? axis : normalize_or(axis + nearness * (from - position), axis);
    }
    bool operator==(const Lobe&) const = default;
  };

  /// Adds one, whose share counts beside those of the others, and is above 0; at most kMost.
  void add(const Lobe& lobe);
  /// What share of a surface's directions they are worth, in [0, 1); told by who made them.
  float worth() const { return worth_; }
  void set_worth(float worth) { worth_ = worth; }
  std::span<const Lobe> lobes() const { return {lobes_.data(), count_}; }

  /// Density of `sample`, per solid angle.
  float pdf(const Vec3& w, const Vec3& position) const;
  /// There must be a lobe.
  Vec3 sample(Vec2 u, const Vec3& position) const;

 private:
  std::array<Lobe, kMost> lobes_;
  size_t count_ = 0;
  float weight_ = 0.0f;  // of all
  float worth_ = 0.1f;
};

}  // namespace cistern
