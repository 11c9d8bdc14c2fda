#pragma once

#include <bitset>
#include <span>
#include <vector>

#include "base/direction_lobes.h"
#include "grid/nested_cell_index.h"

namespace cistern {

// Guides towards caustics: light that small lamps send by smooth surfaces, as a sun by the windows of a house. Paths
// from diffuse surfaces find it by rare directions that bring very much. Photons that were traced from the lights by
// way of smooth surfaces tell these directions, and bounces take a share of theirs from about them.
// [Jensen 1995, Importance Driven Path Tracing using the Photon Map]

/// Light that arrives at a rough surface by way of smooth ones.
struct CausticPhoton {
  NestedCellKey cell = kNoNestedCell;  // where it arrives, on the side it arrives on
  Vec3 position, direction;            // where, and unit, towards where it comes from
  float light = 0.0f;                  // luminance, as it counts beside that of others; finite, above 0
  float strength = 0.0f;               // irradiance of the beam that it is of, over that of other light, about
  float nearness = 0.0f;               // one over the length of its way from the lamp, 1/m
  float square_radius = 0.0f;  // about that of the lobe of directions it might have come from, on the unit sphere
};

/// For each cell of the world where enough photons arrived, lobes about the directions of most of their light. Lobes
/// turn with the place they are seen from as if the lamp was behind the last surface as far away as light had to go: as
/// it is by flat mirrors. Immutable.
class CausticGuide {
 public:
  /// The same for photons in the same order.
  CausticGuide(const NestedCells& cells, std::span<const CausticPhoton> photons);

  /// A cell has lobes from so many photons on.
  static constexpr size_t kLeastPhotons = 2;
  /// Cells are up to 2^kDoublings times as wide as a point's own: around a caustic guides only cost.
  static constexpr int kDoublings = 1;

  /// A point's own cell; none if it surely has no lobes. Better asked for some time before `find`, since what is known
  /// of it is then fetched meanwhile.
  NestedCellKey cell(const Vec3& position, const Vec3& normal) const;
  /// Of the finest cell around a point that has lobes, or null. `key` is the point's own cell.
  const DirectionLobes* find(NestedCellKey key) const;

  bool is_empty() const { return rows_.empty(); }
  size_t memory_bytes() const { return rows_.capacity() * sizeof(DirectionLobes) + index_.memory_bytes(); }

 private:
  static constexpr size_t kMarks = 1 << 16;

  using PlacedPhoton = std::pair<NestedCellKey, const CausticPhoton*>;  // by one of the cells around it
  void add_rows(std::span<const PlacedPhoton> sorted, std::vector<NestedCellIndex::Entry>& entries);

  NestedCells cells_;
  std::vector<DirectionLobes> rows_;
  NestedCellIndex index_;
  std::bitset<kMarks> marks_;  // of the coarsest cells around those with lobes, by their hash: most places have none
};

}  // namespace cistern
