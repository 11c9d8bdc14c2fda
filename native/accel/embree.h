#pragma once

// The one place that knows which Embree this is: 3.13, or 4 with the same results.
#if __has_include(<embree4/rtcore.h>) && defined(CISTERN_EMBREE_4)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace cistern {

inline void embree_intersect(RTCScene scene, RTCRayHit& ray_hit) {
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(scene, &ray_hit, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray_hit);
#endif
}

/// Sets ray.tfar to -infinity when something is hit.
inline void embree_occluded(RTCScene scene, RTCRay& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

/// The same for the rays of a packet that `valid` marks with -1, traced together.
inline void embree_occluded(const int* valid, RTCScene scene, RTCRay8& rays) {
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded8(valid, scene, &rays, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &context, &rays);
#endif
}

}  // namespace cistern
