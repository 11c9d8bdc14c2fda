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

/// Decides for hits, by instance and triangle, whether they count. Works in scenes that were made for filters.
struct HitFilter {
  bool (*counts)(const void* subject, unsigned instance, unsigned triangle);
  const void* subject;
};

/// Takes whatever a ray meets, and lets it go on. Works in the same scenes.
struct HitCollector {
  void (*add)(void* subject, const RTCHit& hit, float t);
  void* subject;
};

namespace embree_detail {

#if RTC_VERSION_MAJOR >= 4
using Context = RTCRayQueryContext;
#else
using Context = RTCIntersectContext;
#endif

struct FilterContext {
  Context context;  // first: Embree hands back a pointer to it
  const HitFilter* filter;
};
struct CollectContext {
  Context context;
  const HitCollector* collector;
};

inline void collect_hits(const RTCFilterFunctionNArguments* arguments) {
  const HitCollector& collector = *reinterpret_cast<const CollectContext*>(arguments->context)->collector;
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    collector.add(collector.subject, rtcGetHitFromHitN(arguments->hit, arguments->N, i),
                  RTCRayN_tfar(arguments->ray, arguments->N, i));
    arguments->valid[i] = 0;
  }
}

inline void refuse_hits(const RTCFilterFunctionNArguments* arguments) {
  const HitFilter& filter = *reinterpret_cast<const FilterContext*>(arguments->context)->filter;
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned instance = RTCHitN_instID(arguments->hit, arguments->N, i, 0);
    const unsigned hit =
        instance == RTC_INVALID_GEOMETRY_ID ? RTCHitN_geomID(arguments->hit, arguments->N, i) : instance;
    const unsigned triangle = RTCHitN_primID(arguments->hit, arguments->N, i);
    if (!filter.counts(filter.subject, hit, triangle)) arguments->valid[i] = 0;
  }
}

inline FilterContext make_context(const HitFilter& filter) {
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

inline void embree_intersect(RTCScene scene, RTCRayHit& ray_hit, const HitFilter& filter) {
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

inline void embree_occluded(RTCScene scene, RTCRay& ray, const HitFilter& filter) {
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

inline void embree_intersect_all(RTCScene scene, RTCRayHit& ray_hit, const HitCollector& collector) {
  embree_detail::CollectContext context;
  context.collector = &collector;
#if RTC_VERSION_MAJOR >= 4
  rtcInitRayQueryContext(&context.context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context.context;
  arguments.filter = embree_detail::collect_hits;
  arguments.flags = static_cast<RTCRayQueryFlags>(arguments.flags | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
  rtcIntersect1(scene, &ray_hit, &arguments);
#else
  rtcInitIntersectContext(&context.context);
  context.context.filter = embree_detail::collect_hits;
  rtcIntersect1(scene, &context.context, &ray_hit);
#endif
}

/// Asks the filters, if there are any, about a hit of a user geometry.
#if RTC_VERSION_MAJOR >= 4
inline void embree_filter(const RTCIntersectFunctionNArguments* asking, const RTCFilterFunctionNArguments* hit) {
  rtcInvokeIntersectFilterFromGeometry(asking, hit);
}
inline void embree_filter(const RTCOccludedFunctionNArguments* asking, const RTCFilterFunctionNArguments* hit) {
  rtcInvokeOccludedFilterFromGeometry(asking, hit);
}
#else
inline void embree_filter(const RTCIntersectFunctionNArguments* asking, const RTCFilterFunctionNArguments* hit) {
  rtcFilterIntersection(asking, hit);
}
inline void embree_filter(const RTCOccludedFunctionNArguments* asking, const RTCFilterFunctionNArguments* hit) {
  rtcFilterOcclusion(asking, hit);
}
#endif

/// Of a scene that a HitFilter can work in.
#if RTC_VERSION_MAJOR >= 4
inline constexpr RTCSceneFlags kFilteredScene = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
inline constexpr RTCSceneFlags kFilteredScene = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif

}  // namespace cistern
