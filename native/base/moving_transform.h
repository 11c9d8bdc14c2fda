#pragma once

#include <array>
#include <optional>

#include "base/transform.h"

namespace cistern {

/// From one transform to another and back in even steps: the rotation turns about one axis, what stretches and the
/// translation go straight. [Shoemake and Duff 1992, Matrix Animation and Polar Decomposition; Shoemake 1985, Animating
/// Rotation with Quaternion Curves] Where one end is flat or mirrors and the other does not, matrices are mixed number
/// by number: what shrinks to nothing, or passes through a plane, does so straight.
class MovingTransform {
 public:
  MovingTransform(const Transform& start, const Transform& end);

  /// At t in [0, 1]; at the ends exactly those given.
  Transform at(float t) const;

 private:
  using Matrix = std::array<std::array<double, 3>, 3>;  // rows
  using Quaternion = std::array<double, 4>;             // x, y, z, w
  struct Parts {
    Quaternion rotation;
    Matrix stretch;  // symmetric up to rounding; mirrors where the transform does
  };
  struct Turn {
    Parts start, end;
  };
  static Parts decompose(const Transform& transform);
  static std::optional<Turn> turn(const Transform& start, const Transform& end);

  Transform start_, end_;
  std::optional<Turn> turn_;  // none: matrices are mixed
};

}  // namespace cistern
