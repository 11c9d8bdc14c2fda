#include "transport/learned_light_sample.h"

#include "base/sobol.h"
#include "base/warp.h"

namespace cistern {
namespace {

struct Candidate {
  uint32_t emitter = 0;
  IncidentLight light;
  BsdfEvaluation f;
  float mis_weight = 1.0f;
  float target = 0.0f;  // what it seems to bring, in the measure of the emitter's square
};

/// Draws a candidate; returns its resampling weight, 0 for none.
float draw(const PathContext& context, const LearnedLights::Chooser& chooser, const LearnedLightVertex& vertex,
           double u_cluster, double u_within, Vec2 u_light, Candidate& out) {
  const auto choice = context.learned->lights->choose(chooser, u_cluster, u_within, u_light);
  if (!choice) return 0.0f;
  const RayCone cone{vertex.point.footprint, context.pixel.angle};
  const auto light =
      context.lights.evaluate(choice->sample, vertex.point.position, vertex.scattered, cone, &context.accel);
  if (!light) return 0.0f;
  out.emitter = choice->sample.emitter;
  out.light = *light;
  out.f = evaluate_bsdf(vertex.bsdf, light->wi, light->visibility);
  if (!std::isfinite(magnitude(light->radiance))) return out.target = INFINITY;  // for the film to count
  const float expected = static_cast<float>(chooser.candidates) * choice->pmf;   // number of draws of this emitter
  const bool has_rival = !light->is_delta && light->use_mis;
  out.mis_weight = has_rival ? power_heuristic(expected * light->pdf, out.f.pdf * vertex.p_scatter) : 1.0f;
  float reflected = magnitude(out.f.total_cos() * light->radiance);
  if (vertex.keeps_light) reflected += magnitude(light->radiance) * std::abs(dot(vertex.point.ns, light->wi));
  out.target = reflected * out.mis_weight * choice->visibility / light->pdf;
  return out.target / expected;
}

}  // namespace

std::optional<LearnedLightSample> sample_learned_light(const PathContext& context,
                                                       const LearnedLights::Chooser& chooser,
                                                       const LearnedLightVertex& vertex, double u_choice, Vec2 u_light,
                                                       PathSampler& sampler) {
  Candidate candidate, chosen;
  float w_sum = 0.0f;
  for (int i = 0; i < chooser.candidates; ++i) {
    const double u_cluster = (i + u_choice) / chooser.candidates;
    const float w =
        draw(context, chooser, vertex, u_cluster, sampler.next_double(), kronecker_point(u_light, i), candidate);
    if (!(w > 0.0f)) continue;
    w_sum += w;
    if (w == w_sum || sampler.next_float() * w_sum < w) chosen = candidate;
  }
  if (w_sum == 0.0f) return std::nullopt;
  const float W = w_sum / chosen.target;
  return LearnedLightSample{chosen.emitter, chosen.light, chosen.f, chosen.mis_weight / chosen.light.pdf * W, W};
}

std::optional<LightRecord> light_record(const PathContext& context, const LearnedLights::Chooser& chooser,
                                        const LearnedLightVertex& vertex, const LearnedLightSample& sample,
                                        Rgb radiance, Rgb throughput) {
  const Rgb f_over_albedo = sample.f.total_cos() * (1.0f / vertex.bsdf.total_sample_weight);
  const float unshadowed = magnitude(f_over_albedo * sample.unshadowed());
  if (chooser.cell == kNoNestedCell || !(unshadowed > 0.0f) || !std::isfinite(unshadowed)) return std::nullopt;
  const float square = sqr(magnitude(throughput * sample.f.total_cos() * radiance));
  const float pmf = context.lights.pmf(sample.emitter, chooser.position, chooser.normal, chooser.light_set);
  return LightRecord{chooser.cell,
                     context.learned->lights->clusters().cluster_of(sample.emitter),
                     magnitude(f_over_albedo * radiance),
                     unshadowed,
                     square,
                     pmf > 0.0f ? square / (sample.W * pmf) : 0.0f};
}

}  // namespace cistern
