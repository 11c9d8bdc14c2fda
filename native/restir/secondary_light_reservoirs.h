#pragma once

#include <span>

#include "base/lazy_vector.h"
#include "base/rng.h"
#include "grid/hash_grid.h"
#include "resampling/mis_weight.h"
#include "restir/earlier_world.h"

namespace cistern {

/// Largest SecondaryReuse::max_count.
inline constexpr int kMaxCellCount = 32;

/// What the reservoir systems for light at later path vertices can be told. Numbers are those of [Boissé 2021] §5.
struct SecondaryReuse {
  int light_candidates = 16;    // light samples per vertex
  bool cell_reuse = true;       // false: RIS alone
  bool temporal_reuse = true;   // one pass over the cells of the frame before
  int spatial_passes = 4;       // over the cells of this frame
  int max_count = 4;            // reservoirs of a cell that one pass draws
  float confidence_cap = 4.0f;  // of all history in a merge, in frames: more makes cells share one sample for long
  Bias bias = Bias::UNBIASED;
  friend bool operator==(const SecondaryReuse&, const SecondaryReuse&) = default;
};

/// The vertices of a frame and the cells they lie in.
struct VertexCells {
  GridLayout layout;
  HashGrid grid;  // of indices into `points`
  LazyVector<VisiblePoint> points;
  LazyVector<LightReservoir> reservoirs;  // by point
  const EarlierWorld* world = nullptr;    // that these are of; null: light is as it was
};

/// World-space light reservoirs at the vertices of paths beyond the visible point.
///
/// [Boissé 2021] G. Boissé: World-Space Spatiotemporal Reservoir Reuse for Ray-Traced Global Illumination. SIGGRAPH
/// Asia Technical Communications.
///
/// Each vertex resamples its light candidates (Alg. 1), is put into a grid cell, and is merged with up to max_count
/// reservoirs of the cell it then looks up, once in the previous frame's grid and several times in this frame's
/// (Alg. 3). One shadow ray per vertex. With `cell_reuse` off it is RIS.
///
/// Departures: vertices of any depth instead of the first alone; cells are exact keys, sorted (grid/hash_grid.h), so
/// none overflows; weights in the emitters' own coordinates (light_target.h); the frame's cells are displaced and
/// turned at random besides the jitter. FAST merges by 1/M as printed; UNBIASED by pairwise MIS over the reservoirs
/// that were drawn, each with its own vertex, which needs no further rays.
///
/// Members are pure functions of their arguments.
class SecondaryLightReservoirs {
 public:
  SecondaryLightReservoirs(const PathContext& context, const SecondaryReuse& reuse)
      : context_(context), reuse_(reuse) {}

  /// Alg. 1.
  LightReservoir initial_candidates(const VisiblePoint& vertex, Rng& rng, uint64_t& non_finite) const;

  /// The cell a vertex is put into, or looked up in: displaced in its tangent plane. [Boissé 2021] §4
  static CellKey jittered_key(const GridLayout& layout, const VisiblePoint& vertex, Rng& rng);

  /// Alg. 3 for one vertex: `own` merged with up to max_count of the reservoirs in its cell. `self` is its index among
  /// the points of `cells`, which is not drawn, or none for the cells of another frame, whose confidence is capped.
  /// Adds the number of those merged to `others`.
  LightReservoir reuse(const VisiblePoint& vertex, const LightReservoir& own, const VertexCells& cells,
                       std::optional<uint32_t> self, Rng& rng, uint64_t& non_finite, uint32_t& others) const;

  /// What is left of the light: traces the shadow ray. W is in `radiance`.
  std::optional<ArrivingLight> shade(const VisiblePoint& vertex, const LightReservoir& reservoir) const;

 private:
  float candidate_count() const { return static_cast<float>(reuse_.light_candidates); }

  const PathContext& context_;
  SecondaryReuse reuse_;
};

}  // namespace cistern
