#include "transport/path_guide.h"

namespace cistern {

bool takes_guide(const PathContext& context, const Bsdf& bsdf) {
  int guided = 0;
  for (int i = 0; i < bsdf.count; ++i) guided += is_narrow(bsdf.lobes[static_cast<size_t>(i)]) ? 0 : 1;
  return guided > 0 && (guided == bsdf.count || !context.tells_kinds);
}

void guide_bounce(const PathContext& context, const SurfacePoint& point, Bsdf& bsdf) {
  if (!context.guiding || !context.guiding->is_on || !takes_guide(context, bsdf)) return;
  const PathGuide& guide = *context.guiding->guide;
  bsdf.guide = guide.table().find(guide.cell(point));
}

}  // namespace cistern
