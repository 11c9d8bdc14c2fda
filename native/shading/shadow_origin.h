#pragma once

#include "accel/offset_origin.h"
#include "shading/surface_point.h"

namespace cistern {

/// Shadow rays to lights whose cosine to the flat triangle is below this start above it, the more so the lower they
/// are, as in Cycles by default: else a hollow mesh's next triangle, which is bent towards them, would be in the way.
/// Rays to vertices of paths do not, since the scattered rays that find such vertices start on the triangle.
inline constexpr float kGrazingCosine = 0.1f;

/// Where a ray towards `wi` (unit) starts, before it is moved off the surface along `side`, which is ng or -ng: the one
/// that agrees with ns about the side of wi. Where wi is above the smooth surface but behind the flat triangle, the
/// point is lifted to the smooth surface, so that neither the triangle nor its neighbours are in the way: coarse meshes
/// would else show their triangles where the light begins to graze. Where the cosine is between 0 and `grazing_cosine`
/// it is lifted in part; other points stay where they are.
/// [Hanika 2021, Hacking the Shadow Terminator, Ray Tracing Gems II, ch. 4]; departures: the paper lifts for all `wi`,
/// which would let more light past than the flat triangles do everywhere, and hollow meshes not at all.
struct ShadowOrigin {
  Vec3 position, side;
};
ShadowOrigin shadow_origin(const Scene& scene, const SurfacePoint& point, const Vec3& wi, float grazing_cosine);

/// The same, moved off the surface.
inline Vec3 leave_surface(const Scene& scene, const SurfacePoint& point, const Vec3& wi, float grazing_cosine) {
  const float cosine = dot(point.ng, wi);
  if (point.ns == point.ng || (std::abs(cosine) >= grazing_cosine && (dot(point.ns, wi) > 0.0f) == (cosine > 0.0f)))
    return offset_origin(point.position, point.clearance, point.ng, wi);
  const ShadowOrigin start = shadow_origin(scene, point, wi, grazing_cosine);
  return offset_origin(start.position, point.clearance, start.side, start.side);
}

}  // namespace cistern
