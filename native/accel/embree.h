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

/// Decides for hits on instances, by their indices, whether they count. Works in scenes that were made for filters.
struct InstanceFilter {
  bool (*counts)(const void* subject, unsigned instance);
  const void* subject;
};

namespace embree_detail {

#if RTC_VERSION_MAJOR >= 4
using Context = RTCRayQueryContext;
#else
using Context = RTCIntersectContext;
#endif

struct FilterContext {
  Context context;  // first: Embree hands back a pointer to it
  const InstanceFilter* filter;
};

inline void refuse_hits(const RTCFilterFunctionNArguments* arguments) {
  const InstanceFilter& filter = *reinterpret_cast<const FilterContext*>(arguments->context)->filter;
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned instance = RTCHitN_instID(arguments->hit, arguments->N, i, 0);
    const unsigned hit =
        instance == RTC_INVALID_GEOMETRY_ID ? RTCHitN_geomID(arguments->hit, arguments->N, i) : instance;
    if (!filter.counts(filter.subject, hit)) arguments->valid[i] = 0;
  }
}

inline FilterContext make_context(const InstanceFilter& filter) {
  FilterContext context;
  context.filter = &filter;
#if RTC_VERSION_MAJOR >= 4
  rtcInitRayQueryContext(&context.context);
#else
  rtcInitIntersectContext(&context.context);
  context.context.filter = refuse_hits;
#endif
  return context;
}

}  // namespace embree_detail

inline void embree_intersect(RTCScene scene, RTCRayHit& ray_hit, const InstanceFilter& filter) {
  embree_detail::FilterContext context = embree_detail::make_context(filter);
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context.context;
  arguments.filter = embree_detail::refuse_hits;
  arguments.flags = static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  rtcIntersect1(scene, &ray_hit, &arguments);
#else
  rtcIntersect1(scene, &context.context, &ray_hit);
#endif
}

inline void embree_occluded(RTCScene scene, RTCRay& ray, const InstanceFilter& filter) {
  embree_detail::FilterContext context = embree_detail::make_context(filter);
#if RTC_VERSION_MAJOR >= 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.context = &context.context;
  arguments.filter = embree_detail::refuse_hits;
  arguments.flags = static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  rtcOccluded1(scene, &ray, &arguments);
#else
  rtcOccluded1(scene, &context.context, &ray);
#endif
}

/// Of a scene that an InstanceFilter can work in.
#if RTC_VERSION_MAJOR >= 4
inline constexpr RTCSceneFlags kFilteredScene = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
inline constexpr RTCSceneFlags kFilteredScene = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif

}  // namespace cistern
