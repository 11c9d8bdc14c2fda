#pragma once

#include "scene/mesh.h"

namespace cistern {

/// Four keys of a segment of a strand: those of its ends are the middle ones. Where a strand ends, its last key counts
/// twice, as in Cycles. [Catmull and Rom 1974]
struct StrandSegment {
  std::array<Vec3, 4> positions;
  std::array<float, 4> radii;
  bool is_straight = false;

  /// Weights of the keys at `u` in [0, 1].
  std::array<float, 4> weights(float u) const {
    if (is_straight) return {0.0f, 1.0f - u, u, 0.0f};
    const float u2 = u * u, u3 = u2 * u;
    return {0.5f * (-u + 2.0f * u2 - u3), 0.5f * (2.0f - 5.0f * u2 + 3.0f * u3), 0.5f * (u + 4.0f * u2 - 3.0f * u3),
            0.5f * (u3 - u2)};
  }
  /// Of the middle of the strand, in object space.
  Vec3 center(float u) const {
    const std::array<float, 4> w = weights(u);
    return w[0] * positions[0] + w[1] * positions[1] + w[2] * positions[2] + w[3] * positions[3];
  }
  /// In which the middle of the strand goes on, in object space, not normalised.
  Vec3 direction(float u) const {
    if (is_straight) return positions[2] - positions[1];
    const float u2 = u * u;
    return 0.5f * ((-1.0f + 4.0f * u - 3.0f * u2) * positions[0] + (-10.0f * u + 9.0f * u2) * positions[1] +
                   (1.0f + 8.0f * u - 9.0f * u2) * positions[2] + (-2.0f * u + 3.0f * u2) * positions[3]);
  }
  /// At least 0.
  float radius(float u) const {
    const std::array<float, 4> w = weights(u);
    return std::max(w[0] * radii[0] + w[1] * radii[1] + w[2] * radii[2] + w[3] * radii[3], 0.0f);
  }
};

/// Segment number `segment` of a mesh of strands.
inline StrandSegment strand_segment(const Mesh& mesh, size_t segment) {
  const uint32_t first = mesh.vertices[segment][0], second = mesh.vertices[segment][1];
  const uint32_t strand = mesh.polygons[segment];
  const bool is_straight = mesh.strand_shape != StrandShape::SPLINES;
  const uint32_t before = segment > 0 && mesh.polygons[segment - 1] == strand ? first - 1 : first;
  const bool goes_on = segment + 1 < mesh.polygons.size() && mesh.polygons[segment + 1] == strand;
  const uint32_t after = goes_on ? second + 1 : second;
  return {{mesh.positions[before], mesh.positions[first], mesh.positions[second], mesh.positions[after]},
          {mesh.radii[before], mesh.radii[first], mesh.radii[second], mesh.radii[after]},
          is_straight};
}

}  // namespace cistern
