#pragma once

#include "shading/surface_point.h"

namespace cistern {

/// Where a shadow ray towards `wi` (unit) starts, before it is moved off the surface along `side`, which is ng or -ng:
/// the one that agrees with ns about the side of wi. Where light comes from above the smooth surface but from behind
/// the flat triangle, the point is lifted to the smooth surface, so that neither the triangle nor its neighbours are in
/// the way: coarse meshes would else show their triangles where the light begins to graze. Other points stay where they
/// are. [Hanika 2021, Hacking the Shadow Terminator, Ray Tracing Gems II, ch. 4]; departure: the paper lifts for all
/// `wi`, which would also block other light than scattered rays find.
struct ShadowOrigin {
  Vec3 position, side;
};
ShadowOrigin shadow_origin(const Scene& scene, const SurfacePoint& point, const Vec3& wi);

}  // namespace cistern
