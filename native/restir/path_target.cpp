#include "restir/path_target.h"

#include "shading/material.h"

namespace cistern {
namespace {

uint8_t kinds_towards(const VisiblePoint& point, bool is_below) {
  if (point.turns_away) return kVisibleToTransmitted | kVisibleToReflected;
  return is_below ? kVisibleToTransmitted : kVisibleToReflected;
}

/// Guess of it, which knows the rough lobes only: zero where it is zero, and nowhere else.
float kind_share_guess(const VisiblePoint& point, const Response& response, Vec3 wi, FoundKind kind) {
  constexpr float kSmallestShare = 0.1f;
  if (kind == 0) return 1.0f;
  const bool is_below = dot(point.ng, wi) < 0.0f;
  const uint8_t kinds_there = point.scattered_kinds & kinds_towards(point, is_below);
  if ((kinds_there & kind) == 0) return 0.0f;
  if (kinds_there == kind) return 1.0f;
  if (is_below || point.turns_away) return 0.5f;
  const float glossy = response.pdf > 0.0f ? response.glossy_pdf / response.pdf : 0.0f;
  return std::max(kind == kVisibleToGlossy ? glossy : 1.0f - glossy, kSmallestShare);
}

/// What targets know of a sample point. MIS weights are shares of targets, and those of all who may find the point only
/// sum to one if they describe it alike: so of what depends on the finder's view there is but a common factor, the
/// albedo. How that is divided, and towards where microfacets' normals were bent, is left out.
Receiver describe_alike(const VisiblePoint& point) {
  Receiver description = point.receiver;
  if (point.is_lambertian) return description;
  const Receiver& seen = point.receiver;
  const float albedo = luminance(seen.diffuse + seen.glossy) + seen.transmission;
  const auto share = [&](bool exists) { return exists ? albedo : 0.0f; };
  description.n = point.ns;
  description.diffuse = Rgb(share(!is_black(seen.diffuse)));
  description.glossy = Rgb(share(!is_black(seen.glossy)));
  description.transmission = share(seen.transmission > 0.0f);
  description.alpha = point.mean_alpha;
  return description;
}

/// By that description.
Rgb sent_radiance_guess(const PathSample& sample, Vec3 wo) {
  Receiver point = describe_alike(sample.point);
  point.wo = wo;
  const IncidentRadiance &light = sample.light, &continuation = sample.continuation;
  Rgb sent;
  if (!is_black(light.radiance)) sent += respond(point, light.wi).f_cos * light.radiance;
  if (is_black(continuation.radiance)) return sent;
  const Response response = respond(point, continuation.wi);
  const float share = kind_share_guess(sample.point, response, continuation.wi, continuation.kind);
  return sent + response.f_cos * continuation.radiance * share;
}

/// Of a kind of scattering in the density of a direction.
float kind_share(const BsdfEvaluation& evaluation, FoundKind kind) {
  if (kind == 0) return 1.0f;
  float pdf = 0.0f;
  for (size_t k = 0; k < kScatterKinds; ++k)
    if (ray_kind(static_cast<ScatterKind>(k)) == kind) pdf = evaluation.pdf_by_kind[k];
  return evaluation.pdf > 0.0f ? pdf / evaluation.pdf : 0.0f;
}

}  // namespace

BsdfEvaluation evaluate_kind(const PathContext& context, const Bsdf& bsdf, const Vec3& wi, FoundKind kind) {
  const bool is_divided = kind != 0 && context.divides_kinds;
  BsdfEvaluation evaluation = evaluate_bsdf(bsdf, wi, lobes_of_kind(context, kind));
  const float share = kind_share(evaluation, kind);
  evaluation.pdf *= share;
  if (!is_divided) evaluation.rough_cos *= share;
  return evaluation;
}

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

Rgb sent_radiance(const PathContext& context, const PathSample& sample, const PathConnection& way) {
  if (sample.point.is_lambertian) return sample.radiance_as_found();
  SurfacePoint point = surface_point(sample.point);
  point.wo = -way.wi;
  PathState state = sample.point.state;
  state.ray_length = way.distance;
  const Bsdf bsdf = evaluate_material(context.scene, point, state, &context.accel);
  const IncidentRadiance &light = sample.light, &continuation = sample.continuation;
  Rgb sent;
  if (!is_black(light.radiance))
    sent += evaluate_bsdf(bsdf, light.wi, sample.light_visibility).rough_cos * light.radiance;
  if (is_black(continuation.radiance)) return sent;
  return sent + evaluate_kind(context, bsdf, continuation.wi, continuation.kind).rough_cos * continuation.radiance;
}

float path_target(const VisiblePoint& visible, const PathSample& sample, PathTarget target, Reflection reflection) {
  const std::optional<PathConnection> way = connect(visible, sample);
  if (!way) return 0.0f;
  // Paths do not leave a smooth-shaded surface through its flat triangles.
  const bool is_one_sided = visible.receiver.side != Vec3{}, is_below = dot(visible.ng, way->wi) < 0.0f;
  if (is_one_sided && !(dot(visible.ng, way->wi) > 0.0f)) return 0.0f;
  if ((visible.scattered_kinds & kinds_towards(visible, is_below)) == 0) return 0.0f;
  const Response response = respond(visible.receiver, way->wi);
  const float share = kind_share_guess(visible, response, way->wi, sample.kind);
  if (share == 0.0f || is_black(response.f_cos)) return 0.0f;
  const Rgb sent =
      reflection == Reflection::AS_FOUND ? sample.radiance_as_found() : sent_radiance_guess(sample, -way->wi);
  const float reflected = target == PathTarget::RADIANCE ? 1.0f : magnitude(response.f_cos);
  return reflected * magnitude(sent) * share * way->geometry;
}

Rgb path_transmittance(const PathContext& context, const VisiblePoint& visible, const PathSample& sample) {
  const std::optional<PathConnection> way = connect(visible, sample);
  if (!way) return {};
  IncidentLight end;
  end.wi = way->wi;
  end.distance = way->distance;
  end.normal = sample.point.ng;
  end.clearance = sample.point.clearance;
  PathState scattered = sample.point.state;
  scattered.transparent_depth = visible.state.transparent_depth;
  return transmittance_to_vertex(context, surface_point(visible), end, scattered);
}

bool reaches_as_found(const PathContext& context, const VisiblePoint& visible, const PathSample& sample) {
  const std::optional<PathConnection> way = connect(visible, sample);
  if (!way) return false;
  const SurfacePoint receiver = surface_point(visible);
  const VisiblePoint& vertex = sample.point;
  SurfaceLanes receivers;
  receivers.set(0, receiver, visible.state.transparent_depth);
  LaneMask is_first(false);
  is_first[0] = true;
  const SeenVertex seen{vertex.receiver.position, vertex.ng, vertex.clearance};
  return !is_black(transmittance_as_found(context, receivers, Vec3Lanes(way->wi), is_first, seen, vertex.state).at(0));
}

Rgb reflected_path(const PathContext& context, const VisiblePoint& visible, const PathSample& sample,
                   Reflection reflection) {
  const std::optional<PathConnection> way = connect(visible, sample);
  if (!way) return {};
  const Bsdf bsdf = evaluate_material(context.scene, visible, &context.accel);
  const BsdfEvaluation f = evaluate_kind(context, bsdf, way->wi, sample.kind);
  if (is_black(f.rough_cos) || f.pdf == 0.0f) return {};  // no path leaves where BSDF sampling has no density
  const Rgb sent =
      reflection == Reflection::AS_FOUND ? sample.radiance_as_found() : sent_radiance(context, sample, *way);
  const Rgb reflected = visible.throughput * f.rough_cos * sent * way->geometry;
  return is_black(reflected) ? reflected : reflected * path_transmittance(context, visible, sample);
}

KindColors reflected_shares(const PathContext& context, const VisiblePoint& visible, const PathSample& sample) {
  const std::optional<PathConnection> way = connect(visible, sample);
  return way ? rough_shares(context.scene, visible, way->wi, lobes_of_kind(context, sample.kind), &context.accel)
             : KindColors();
}

/// By the reflected light of each of the two directions alone, for which a ray each is traced, whatever groups there
/// are.
void add_reflected_groups(const PathContext& context, const VisiblePoint& visible, const PathSample& sample,
                          Reflection reflection, std::span<const Rgb> continuation, Rgb factor, std::span<Rgb> sums) {
  PathSample alone = sample;
  if (!is_black(sample.light.radiance)) {
    alone.continuation.radiance = Rgb();
    add_to_group(sums, sample.light_group, factor * reflected_path(context, visible, alone, reflection));
  }
  if (continuation.empty()) return;
  alone.light.radiance = Rgb();
  alone.continuation.radiance = Rgb(1.0f);
  add_to_groups(sums, continuation, factor * reflected_path(context, visible, alone, reflection));
}

}  // namespace cistern
