#include "transport/path_tracer.h"

#include "transport/camera_ray.h"
#include "transport/path_walk.h"

namespace cistern {

float clamp_factor(Rgb contribution, float limit) {
  const float mean = std::abs(average(contribution));  // what is left of a shared sample may be less than nothing
  return limit > 0.0f && mean > limit ? limit / mean : 1.0f;
}

Rgb clamp_contribution(Rgb contribution, float limit) { return contribution * clamp_factor(contribution, limit); }

float scatter_probability(const Bsdf& bsdf) {
  const float straight = average(bsdf.transparency);
  return straight > 0.0f ? bsdf.total_sample_weight / (bsdf.total_sample_weight + straight) : 1.0f;
}

float light_sample_share(const PathContext& context, float candidates, uint32_t emitter, float light_pdf,
                         float bsdf_pdf) {
  const float light = candidates * context.lights.receiver_free_pmf(emitter) * light_pdf;
  return light > 0.0f ? light / (light + bsdf_pdf) : 0.0f;
}

PathRecord trace_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                      PathCapture* capture) {
  if (sees_nothing(ray)) {
    if (context.record_surfaces) scratch.seen_surfaces.clear();
    if (capture) capture->clear();
    PathRecord nothing;
    if (context.limits.film_transparent) nothing.alpha = 0.0f;
    scratch.light_by_kind = {};
    scratch.light_by_group.assign(context.light_groups, Rgb());
    return nothing;
  }
  if (context.splits() || scratch.known_hit) return trace_split_path(context, ray, sampler, scratch, capture);
  if (context.media && !capture) return trace_media_path(context, ray, sampler, scratch);
  if (knowledge_of(context, scratch) != Knowledge::NONE)
    return trace_learned_path(context, ray, sampler, scratch, capture);
  if (capture) return Walk<CapturingWalk>(context, ray, sampler, scratch, capture).run();
  return Walk<ReferenceWalk>(context, ray, sampler, scratch, nullptr).run();
}

}  // namespace cistern
