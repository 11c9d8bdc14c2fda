#include "transport/path_guide.h"

namespace cistern {

bool takes_guide(const PathContext& context, const Bsdf& bsdf) {
  int guided = 0;
  for (int i = 0; i < bsdf.count; ++i) guided += is_narrow(bsdf.lobes[static_cast<size_t>(i)]) ? 0 : 1;
  const bool kinds_matter = context.tells_kinds || context.limits.film_transparent_glass;
  return guided > 0 && (guided == bsdf.count || !kinds_matter);
}

NestedCellKey guide_cell(const PathContext& context, const SurfacePoint& point) {
  if (!context.guiding || !context.guiding->is_on) return kNoNestedCell;
  const PathGuide& guide = *context.guiding->guide;
  const NestedCellKey cell = guide.cell(point);
  guide.table().prefetch(cell);
  return cell;
}

const DirectionHistogram* find_guide(const PathContext& context, NestedCellKey cell) {
  if (cell == kNoNestedCell) return nullptr;
  const DirectionHistogram* guide = context.guiding->guide->table().find(cell);
  if (guide) guide->prefetch();
  return guide;
}

void guide_bounce(const PathContext& context, NestedCellKey cell, Bsdf& bsdf) {
  if (cell != kNoNestedCell && takes_guide(context, bsdf)) bsdf.guide = find_guide(context, cell);
}

}  // namespace cistern
