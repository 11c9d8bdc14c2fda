#include "restir/light_target.h"

#include "shading/material.h"
#include "transport/path_guide.h"

namespace cistern {
namespace {

std::optional<IncidentLight> evaluate_light(const PathContext& context, const VisiblePoint& visible,
                                            const LightSample& sample) {
  const RayCone cone{visible.footprint, context.pixel.angle};
  return context.lights.evaluate(sample, visible.receiver.position, visible.scattered, cone, &context.accel);
}

/// light_sample_share, or all for light that scattered rays never meet.
float share_of_light_samples(const PathContext& context, float candidates, const LightSample& sample,
                             const IncidentLight& light, float bsdf_pdf) {
  if (light.is_delta || !light.use_mis) return 1.0f;
  return light_sample_share(context, candidates, sample.emitter, light.pdf, bsdf_pdf);
}

}  // namespace

float light_target(const PathContext& context, float candidates, const VisiblePoint& visible,
                   const LightSample& sample) {
  const auto light = evaluate_light(context, visible, sample);
  if (!light) return 0.0f;
  const Response response = respond(visible.receiver, light->wi);
  const float reflected = magnitude(response.f_cos * light->radiance);
  return reflected / light->pdf * share_of_light_samples(context, candidates, sample, *light, response.pdf);
}

bool is_visible(const PathContext& context, const VisiblePoint& visible, const LightSample& sample) {
  const auto light = evaluate_light(context, visible, sample);
  if (!light) return false;
  if (!light->casts_shadow) return true;
  return !is_black(transmittance(context, surface_point(visible), *light, visible.state));
}

std::optional<ArrivingLight> arriving_light(const PathContext& context, float candidates, const VisiblePoint& visible,
                                            const LightSample& sample) {
  const auto light = evaluate_light(context, visible, sample);
  if (!light) return std::nullopt;
  Bsdf bsdf = evaluate_material(context.scene, visible, &context.accel);
  guide_bounce(context, guide_cells(context, surface_point(visible)), bsdf);
  const BsdfEvaluation f = evaluate_bsdf(bsdf, light->wi, light->visibility);
  if (is_black(f.rough_cos)) return std::nullopt;
  const float share = share_of_light_samples(context, candidates, sample, *light, f.pdf * scatter_probability(bsdf));
  Rgb radiance = light->radiance * (share / light->pdf);
  if (light->casts_shadow) radiance *= transmittance(context, surface_point(visible), *light, visible.state);
  if (is_black(radiance)) return std::nullopt;
  return ArrivingLight{light->wi, f.rough_cos, f.even_cos, radiance, light->visibility};
}

Rgb reflected_light(const PathContext& context, float candidates, const VisiblePoint& visible,
                    const LightSample& sample) {
  const auto light = arriving_light(context, candidates, visible, sample);
  return light ? visible.throughput * light->f_cos * light->radiance : Rgb();
}

KindColors reflected_shares(const PathContext& context, const VisiblePoint& visible, const LightSample& sample) {
  const auto light = evaluate_light(context, visible, sample);
  return light ? rough_shares(context.scene, visible, light->wi, light->visibility, &context.accel) : KindColors();
}

}  // namespace cistern
