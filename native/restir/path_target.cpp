#include "restir/path_target.h"

#include "shading/material.h"

namespace cistern {
namespace {

/// By the sample point's Receiver.
Rgb sent_radiance_guess(const PathSample& sample, Vec3 wo) {
  Receiver point = sample.point.receiver;
  point.wo = wo;
  Rgb sent;
  for (const IncidentRadiance* incident : {&sample.light, &sample.continuation})
    if (!is_black(incident->radiance)) sent += respond(point, incident->wi).f_cos * incident->radiance;
  return sent;
}

}  // namespace

std::optional<PathConnection> connect(const VisiblePoint& visible, const PathSample& sample) {
  const Vec3 offset = sample.point.receiver.position - visible.receiver.position;
  const float d2 = length_squared(offset);
  if (!(d2 > 0.0f)) return std::nullopt;
  const float distance = std::sqrt(d2);
  const Vec3 wi = offset / distance;
  const float cosine = -dot(sample.point.ng, wi);
  if (!(cosine > 0.0f)) return std::nullopt;
  return PathConnection{wi, distance, cosine / d2};
}

Rgb sent_radiance(const PathContext& context, const PathSample& sample, Vec3 wo) {
  SurfacePoint point = surface_point(sample.point);
  point.wo = wo;
  const Bsdf bsdf = evaluate_material(context.scene, point, sample.point.state);
  const Rgb light = evaluate_bsdf(bsdf, sample.light.wi, sample.light_visibility).rough_cos * sample.light.radiance;
  return light + evaluate_bsdf(bsdf, sample.continuation.wi).rough_cos * sample.continuation.radiance;
}

float path_target(const VisiblePoint& visible, const PathSample& sample, PathTarget target, Reflection reflection) {
  const std::optional<PathConnection> way = connect(visible, sample);
  if (!way) return 0.0f;
  // Paths do not leave a smooth-shaded surface through its flat triangles.
  const bool is_one_sided = visible.receiver.side != Vec3{};
  if (is_one_sided && !(dot(visible.ng, way->wi) > 0.0f)) return 0.0f;
  const Rgb response = respond(visible.receiver, way->wi).f_cos;
  if (is_black(response)) return 0.0f;
  const Rgb sent =
      reflection == Reflection::AS_FOUND ? sample.radiance_as_found() : sent_radiance_guess(sample, -way->wi);
  return luminance(target == PathTarget::RADIANCE ? sent : response * sent) * way->geometry;
}

Rgb path_transmittance(const PathContext& context, const VisiblePoint& visible, const PathSample& sample) {
  const std::optional<PathConnection> way = connect(visible, sample);
  if (!way) return {};
  IncidentLight end;
  end.wi = way->wi;
  end.distance = way->distance;
  end.normal = sample.point.ng;
  return transmittance(context, surface_point(visible), end, visible.state);
}

Rgb reflected_path(const PathContext& context, const VisiblePoint& visible, const PathSample& sample,
                   Reflection reflection) {
  const std::optional<PathConnection> way = connect(visible, sample);
  if (!way) return {};
  const Bsdf bsdf = evaluate_material(context.scene, surface_point(visible), visible.state);
  const BsdfEvaluation evaluation = evaluate_bsdf(bsdf, way->wi);
  const Rgb response = evaluation.rough_cos;
  if (is_black(response) || evaluation.pdf == 0.0f) return {};  // no path leaves where BSDF sampling has no density
  const Rgb sent =
      reflection == Reflection::AS_FOUND ? sample.radiance_as_found() : sent_radiance(context, sample, -way->wi);
  const Rgb reflected = visible.throughput * response * sent * way->geometry;
  return is_black(reflected) ? reflected : reflected * path_transmittance(context, visible, sample);
}

}  // namespace cistern
