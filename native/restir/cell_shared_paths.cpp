#include "restir/cell_shared_paths.h"

#include "shading/material.h"

namespace cistern {
namespace {

/// Directions whose light this vertex does not reflect to whoever found it may still be reflected to others.
constexpr float kLeastResponse = 0.02f;

bool sends_light(const PathLink& link) {
  return link.W > 0.0f && !(is_black(link.to.light.radiance) && is_black(link.to.continuation.radiance));
}

Rgb sent_along(const PathContext& context, const PathSample& sample, const PathConnection& way) {
  return sample.point.is_lambertian ? sample.radiance_as_found() : sent_radiance(context, sample, way);
}

}  // namespace

void ReflectedPaths::add(const IncidentRadiance& found, float u) {
  const Rgb reflected = found.f_cos * found.radiance;
  sum += reflected;
  const float weight = luminance(reflected) + kLeastResponse * luminance(found.radiance);
  incident_weight += weight;
  if (!(u * incident_weight < weight)) return;
  incident = found;
  incident.radiance *= 1.0f / weight;
}

uint32_t CellSharedPaths::group_class(const VisiblePoint& vertex) {
  const PathState& s = vertex.state;
  uint32_t bounces = s.depth;
  for (const uint16_t count : {s.diffuse_depth, s.glossy_depth, s.transmission_depth, s.transparent_depth})
    bounces = bounces * 31 + count;
  return bounces;
}

void CellSharedPaths::share(std::span<const PathLink* const> group, std::span<ReflectedPaths* const> reflected,
                            std::span<Rng> rngs, Scratch& scratch) const {
  if (std::ranges::none_of(group, [](const PathLink* link) { return sends_light(*link); })) return;
  scratch.bsdfs.clear();
  for (const PathLink* link : group)
    scratch.bsdfs.push_back(evaluate_material(context_.scene, surface_point(link->from), link->from.state));
  for (size_t i = 0; i < group.size(); ++i)
    if (sends_light(*group[i])) share_sample(group, i, reflected, rngs, scratch);
}

/// `density`: of finding the sample point from the receiver, per area there.
std::optional<CellSharedPaths::Scratch::Pair> CellSharedPaths::connect_pair(const PathLink& receiver, const Bsdf& bsdf,
                                                                            const PathSample& sample, bool is_own,
                                                                            float& density) const {
  const std::optional<PathConnection> way = connect(receiver.from, sample);
  if (!way) return std::nullopt;
  const BsdfEvaluation f = evaluate_bsdf(bsdf, way->wi);
  const float share = kind_share(f, sample.kind), pdf = f.pdf * share;
  if (is_black(f.rough_cos) || pdf == 0.0f) return std::nullopt;  // its BSDF sampling never makes this link
  // Its own ray found the sample; that is no question to ask again of a shadow ray, whose ends differ a little.
  const bool is_seen = is_own && !context_.accel.has_transparent_surfaces();
  const Rgb transmittance = is_seen ? Rgb(1.0f) : path_transmittance(context_, receiver.from, sample);
  if (is_black(transmittance)) {
    if (weights_ == PairWeights::UNSHADOWED) density = pdf * way->geometry;
    return std::nullopt;
  }
  density = weights_ == PairWeights::EQUAL ? 1.0f : pdf * way->geometry;
  return Scratch::Pair{*way, f.rough_cos * share, transmittance};
}

void CellSharedPaths::share_sample(std::span<const PathLink* const> group, size_t finder,
                                   std::span<ReflectedPaths* const> reflected, std::span<Rng> rngs,
                                   Scratch& scratch) const {
  const PathSample& sample = group[finder]->to;
  scratch.pairs.assign(group.size(), {});
  float own_density = 0.0f, sum = 0.0f;
  for (size_t k = 0; k < group.size(); ++k) {
    float density = 0.0f;
    const bool is_own = k == finder;
    const auto pair = connect_pair(*group[k], scratch.bsdfs[k], sample, is_own, density);
    if (pair) scratch.pairs[k] = *pair;
    sum += weights_ == PairWeights::EQUAL ? 1.0f : density;
    if (is_own) own_density = density;
  }
  if (!(own_density > 0.0f)) return;  // only by rounding: the link was made
  const float weight = group[finder]->W * own_density / sum;
  for (size_t k = 0; k < group.size(); ++k) {
    const Scratch::Pair& pair = scratch.pairs[k];
    if (pair.way.geometry == 0.0f) continue;
    const Rgb radiance = sent_along(context_, sample, pair.way) * pair.transmittance * pair.way.geometry;
    if (k == finder) reflected[k]->own += pair.f_cos * radiance * group[finder]->W;
    reflected[k]->add({pair.way.wi, radiance * weight, pair.f_cos, sample.kind}, rngs[k].next_float());
  }
}

void CellSharedPaths::add_to_sample(PathSample& sample, const ReflectedPaths& reflected, float u) {
  IncidentRadiance& continuation = sample.continuation;
  const Rgb found = continuation.f_cos * continuation.radiance;
  if (sample.point.is_lambertian) {  // it matters to nobody where the light came from
    continuation.f_cos = Rgb(1.0f);
    continuation.radiance = found + reflected.sum;
    return;
  }
  const float weight = luminance(found) + kLeastResponse * luminance(continuation.radiance);
  const float total = weight + reflected.incident_weight;
  if (!(total > 0.0f)) return;
  if (u * total < weight) {
    continuation.radiance *= total / weight;
  } else {
    continuation = reflected.incident;
    continuation.radiance *= total;
  }
}

}  // namespace cistern
