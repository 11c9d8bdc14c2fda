#include "restir/path_merge.h"

#include "resampling/resample.h"
#include "shading/material.h"

namespace cistern {
namespace {

/// Whether paths from the point may find the sample. Targets guess that by its Receiver: a sample that has a target and
/// no density is taken from those who find it and given to nobody.
bool can_find(const PathContext& context, const VisiblePoint& point, const PathSample& sample) {
  const std::optional<PathConnection> way = connect(point, sample);
  if (!way) return false;
  if (point.is_lambertian) return dot(point.receiver.n, way->wi) > 0.0f && dot(point.ns, way->wi) > 0.0f;
  const BsdfEvaluation f =
      evaluate_kind(context, evaluate_material(context.scene, point, &context.accel), way->wi, sample.kind);
  return f.pdf > 0.0f && !is_black(f.rough_cos);
}

}  // namespace

PathReservoir keep_one_direction(const VisiblePoint& finder, const PathReservoir& found, const PathMergeRules& rules,
                                 Rng& rng) {
  if (rules.reflection == Reflection::AS_FOUND || found.W == 0.0f) return found;
  PathReservoir light = found, continuation = found;
  light.sample.continuation.radiance = continuation.sample.light.radiance = Rgb();
  const float of_light = path_target(finder, light.sample, rules.target, rules.reflection);
  const float of_continuation = path_target(finder, continuation.sample, rules.target, rules.reflection);
  const float sum = of_light + of_continuation;
  if (!(sum > 0.0f)) return found;
  const bool keeps_light = rng.next_float() * sum < of_light;
  PathReservoir& kept = keeps_light ? light : continuation;
  kept.W *= sum / (keeps_light ? of_light : of_continuation);
  return kept;
}

PathReference PathCandidates::merge(const PathContext& context, const PathMergeRules& rules, Rng& rng,
                                    uint64_t& non_finite) const {
  const MisWeight weights = mis_weight_for(rules.bias, static_cast<int>(count_));
  const bool needs_visibility = weights != MisWeight::CONSTANT;
  const auto p_hat = [&](size_t i, const PathSample* sample) {
    const float target = path_target(*points_[i], *sample, rules.target, rules.reflection);
    if (!(target > 0.0f) || !needs_visibility) return target;
    if (!can_find(context, *points_[i], *sample)) return 0.0f;
    return reaches_as_found(context, *points_[i], *sample) ? target : 0.0f;
  };
  return resample<const PathSample*>({reservoirs_.data(), count_}, p_hat, weights, rng, non_finite);
}

PathReservoir copy_of(const PathReference& reference) {
  PathReservoir reservoir{{}, reference.W, reference.c};
  if (reference.sample) reservoir.sample = *reference.sample;
  return reservoir;
}

}  // namespace cistern
