#include "transport/path_guide.h"

namespace cistern {
namespace {

bool follows_table(const PathContext& context) { return context.guiding && context.guiding->is_on; }

}  // namespace

bool guides_bounces(const PathContext& context) { return context.caustics || follows_table(context); }

bool takes_guide(const PathContext& context, const Bsdf& bsdf) {
  int guided = 0;
  for (int i = 0; i < bsdf.count; ++i) guided += is_narrow(bsdf.lobes[static_cast<size_t>(i)]) ? 0 : 1;
  const bool kinds_matter = context.tells_kinds || context.limits.film_transparent_glass;
  return guided > 0 && (guided == bsdf.count || !kinds_matter);
}

GuideCells guide_cells(const PathContext& context, const SurfacePoint& point) {
  GuideCells cells;
  cells.position = point.position;
  if (context.caustics) cells.of_caustics = context.caustics->cell(point.position, point.ns);
  if (follows_table(context)) {
    const PathGuide& guide = *context.guiding->guide;
    cells.of_table = guide.cell(point);
    guide.table().prefetch(cells.of_table);
  }
  return cells;
}

DirectionGuide find_guide(const PathContext& context, const GuideCells& cells) {
  DirectionGuide guide;
  guide.position = cells.position;
  if (cells.of_table != kNoNestedCell) guide.histogram = context.guiding->guide->table().find(cells.of_table);
  if (guide.histogram) guide.histogram->prefetch();
  if (cells.of_caustics != kNoNestedCell) guide.caustics = context.caustics->find(cells.of_caustics);
  return guide;
}

void guide_bounce(const PathContext& context, const GuideCells& cells, Bsdf& bsdf) {
  if (cells.is_any() && takes_guide(context, bsdf)) bsdf.guide = find_guide(context, cells);
}

}  // namespace cistern
