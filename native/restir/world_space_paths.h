#pragma once

#include <span>

#include "base/lazy_vector.h"
#include "grid/hash_grid.h"
#include "restir/path_merge.h"
#include "restir/pixel_reuse.h"

namespace cistern {

/// What world-space path reuse can be told. Numbers are those of [Zhang and Wang 2023] §5.
struct WorldPathReuse {
  PathMergeRules rules;
  bool temporal_reuse = true;
  bool spatial_reuse = true;
  float temporal_cap = 30.0f;  // of the temporal reservoir's history, in frames
  int max_count = 3;           // reservoirs drawn from a cell
  bool deep_points = true;     // the vertices after the visible points lie in cells too
  friend bool operator==(const WorldPathReuse&, const WorldPathReuse&) = default;
};

/// The paths of a frame: entry 2 i is the visible point of pixel i and its temporal reservoir, entry 2 i + 1 the vertex
/// after it with the sample it found. `cells` holds the entries that exist.
struct PathCells {
  EarlierView view;
  GridLayout layout;
  HashGrid cells;
  std::span<const VisiblePoint> visible_points;  // by pixel; empty: there is no such frame
  LazyVector<VisiblePoint> deep_points;          // by pixel
  LazyVector<PathReservoir> reservoirs;          // by entry

  const VisiblePoint& point(size_t entry) const {
    return entry % 2 == 0 ? visible_points[entry / 2] : deep_points[entry / 2];
  }
};

/// World-space path resampling.
///
/// [Zhang and Wang 2023] H. Zhang, B. Wang: World-Space Spatiotemporal Path Resampling for Path Tracing. Computer
/// Graphics Forum 42(7).
///
/// As in ReSTIR GI each visible point finds a sample point and merges it with the history of its pixel. Then it takes
/// in reservoirs that lie in its cell of the previous frame's grid: those of visible points, and those of the next
/// vertices of paths, which lie anywhere. Cells are divided by the direction of the surface.
///
/// Departures: weights per area at the sample point (path_target.h); sample points are evaluated anew towards each
/// receiver (FAST: as found); UNBIASED merges by pairwise MIS with a visibility ray in each target, FAST by 1/M,
/// without the visibility ray before a merge (§4.3);
/// R_sp starts from the temporal reservoir (Alg. 2; the text says the previous spatial one); the target at deep
/// vertices uses their own direction to the eye, which is stored; cell sizes by [Boissé 2021] Alg. 4, since Eq. (11)
/// exchanges width and height; bins of signed normals centred on the axes instead of Eq. (10); smallest cell 1 % of the
/// diagonal instead of the shortest side, which may be zero.
///
/// Members are pure functions of their arguments. `others` counts the reservoirs that were merged besides the point's
/// own of this frame.
class WorldSpacePaths {
 public:
  WorldSpacePaths(const PathContext& context, const WorldPathReuse& reuse, const ImageRegion& image, uint64_t seed)
      : context_(context), reuse_(reuse), image_(image), seed_(seed) {}

  static PathReservoir initial_sample(const PathLink& link) { return {link.to, link.W, 1.0f}; }

  /// The same once all its light is known, ready to be merged; see path_merge.h.
  PathReservoir keep_one_direction(const VisiblePoint& point, const PathReservoir& found, uint32_t pixel,
                                   uint32_t frame, bool is_deep) const;

  /// §5.3: in screen space, as in ReSTIR GI.
  PathReservoir reuse_in_time(const VisiblePoint& visible, const PathReservoir& initial, const PathCells& previous,
                              uint32_t pixel, uint32_t frame, uint64_t& non_finite, uint32_t& others) const;

  /// The cell an entry is put into: displaced in its tangent plane.
  CellKey key(const GridLayout& layout, const VisiblePoint& point, uint32_t pixel, uint32_t frame, bool is_deep) const;

  /// Alg. 2, from the previous frame's grid. The sample stays where it is, in `temporal` or `previous`.
  PathReference reuse_in_cells(const VisiblePoint& visible, const PathReservoir& temporal, const PathCells& previous,
                               uint32_t pixel, uint32_t frame, uint64_t& non_finite, uint32_t& others) const;

  /// Radiance at the camera; traces the ray to the sample point.
  Rgb shade(const VisiblePoint& visible, const PathReference& reservoir) const;
  /// Shares that kinds of scattering have in it, where it is not black.
  KindColors shares(const VisiblePoint& visible, const PathReference& reservoir) const {
    return reflected_shares(context_, visible, *reservoir.sample);
  }
  /// Adds `factor` times it to light groups.
  void add_groups(const VisiblePoint& visible, const PathReference& reservoir, std::span<const Rgb> continuation,
                  float factor, std::span<Rgb> sums) const {
    add_reflected_groups(context_, visible, *reservoir.sample, reuse_.rules.reflection, continuation,
                         Rgb(factor * reservoir.W), sums);
  }

 private:
  const PathContext& context_;
  WorldPathReuse reuse_;
  ImageRegion image_;
  uint64_t seed_;
};

}  // namespace cistern
