#include "transport/path_guide.h"

namespace cistern {

bool takes_guide(const PathContext& context, const Bsdf& bsdf) {
  int guided = 0;
  for (int i = 0; i < bsdf.count; ++i) guided += is_narrow(bsdf.lobes[static_cast<size_t>(i)]) ? 0 : 1;
  const bool kinds_matter = context.tells_kinds || context.limits.film_transparent_glass;
  return guided > 0 && (guided == bsdf.count || !kinds_matter);
}

void guide_bounce(const PathContext& context, const SurfacePoint& point, Bsdf& bsdf) {
  if (!context.guiding || !context.guiding->is_on || !takes_guide(context, bsdf)) return;
  const PathGuide& guide = *context.guiding->guide;
  bsdf.guide = guide.table().find(guide.cell(point));
}

}  // namespace cistern
