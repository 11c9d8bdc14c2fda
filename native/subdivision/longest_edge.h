#pragma once

#include "scene/pixel_footprint.h"
#include "scene/subdivision_cage.h"

namespace cistern {

/// How long the edges of an object's surface may be for a picture. Of an edge only its ends are asked for, so that
/// whatever shares it is told the same.
class LongestEdge {
 public:
  /// `coarsening` multiplies all lengths.
  LongestEdge(const DicingView& view, const SubdivisionCage& cage, const Transform& object_to_world, float coarsening);

  /// Ends in object space.
  bool is_exceeded(Vec3 a, Vec3 b) const;

 private:
  float pixel_size(Vec3 a, Vec3 b) const;

  const DicingView& view_;
  Transform object_to_world_, world_to_camera_;
  PixelFootprint pixel_;
  float pixels_, length_;
};

/// How many pixels a unit of an object's space takes at the most, where it is nearest, less beyond the sides of the
/// picture; by its bounds.
float seen_size(const DicingView& view, const Bounds3& bounds, const Transform& object_to_world);

}  // namespace cistern
