#pragma once

#include "shading/bsdf.h"
#include "transport/caustic_guide.h"
#include "transport/guide_table.h"
#include "transport/path_context.h"

namespace cistern {

/// Guided bounces: lobes that are not narrow take a part of their directions from where light came from in earlier
/// frames, as far as the cell of the point knows; and a small one towards caustics (caustic_guide.h). Cells are told
/// apart by the side that the normal looks to, so that their densities spend little below the horizon. The mixture is
/// the density of BSDF sampling (bsdf.h) to all who ask for that.
class PathGuide {
 public:
  explicit PathGuide(const NestedCells& cells) : cells_(cells) {}

  /// A table for the frames that follow; must not be learned from paths that it will guide.
  void set_table(GuideTable table) { table_ = std::move(table); }
  const GuideTable& table() const { return table_; }

  NestedCellKey cell(const SurfacePoint& point) const { return cells_.key(point.position, point.ns); }

 private:
  NestedCells cells_;
  GuideTable table_;
};

/// Whether a BSDF can have a guide. Where kinds of scattering matter, those with narrow lobes cannot: the share of a
/// kind in a direction must be what it is without a guide.
bool takes_guide(const PathContext& context, const Bsdf& bsdf);

/// Whether any bounce may have a guide.
bool guides_bounces(const PathContext& context);

/// The cells of a point for `guide_bounce`; none where paths are not guided. Better asked for some time before, since
/// what is known of them is then fetched meanwhile.
struct GuideCells {
  NestedCellKey of_table = kNoNestedCell, of_caustics = kNoNestedCell;
  Vec3 position;
  bool is_any() const { return of_table != kNoNestedCell || of_caustics != kNoNestedCell; }
};
GuideCells guide_cells(const PathContext& context, const SurfacePoint& point);

/// What guides diffuse bounces from points of these cells.
DirectionGuide find_guide(const PathContext& context, const GuideCells& cells);

/// Sets the guide of a BSDF at a point of these cells: a function of the point and its BSDF alone, within a frame.
void guide_bounce(const PathContext& context, const GuideCells& cells, Bsdf& bsdf);

}  // namespace cistern
