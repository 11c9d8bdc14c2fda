#include "restir/cell_shared_paths.h"

#include "restir/pixel_reuse.h"
#include "shading/material.h"
#include "transport/path_guide.h"

namespace cistern {
namespace {

bool sends_light(const PathLink& link) { return link.W > 0.0f && !is_black(link.to.continuation.radiance); }

/// Nearly all vertices: they need no material evaluated. No bump map bends their normal.
bool is_plain(const VisiblePoint& vertex) { return vertex.is_lambertian && vertex.receiver.n == vertex.ns; }

/// f cos by the rough lobes and by the even part, and the density of BSDF sampling per solid angle; of all the share of
/// the kind of scattering that finds a sample point. No density: no path leaves this way.
struct PairResponse {
  Rgb f_cos, even_cos;
  float pdf = 0.0f;
};

PairResponse respond_plainly(const VisiblePoint& vertex, const DirectionHistogram* guide, Vec3 wi, FoundKind kind) {
  const float cosine = dot(vertex.ns, wi);
  const bool can_leave = cosine > 0.0f && dot(vertex.ng, wi) > 0.0f;
  if (!can_leave || (kind != 0 && kind != kVisibleToDiffuse)) return {};
  const float pdf = cosine * kInvPi;
  const Rgb f_cos = vertex.receiver.diffuse * pdf;
  return {f_cos, f_cos, guide ? lerp(pdf, guide->pdf(wi), kGuideShare) : pdf};
}

PairResponse respond(const PathContext& context, const Bsdf& bsdf, Vec3 wi, FoundKind kind) {
  const BsdfEvaluation f = evaluate_kind(context, bsdf, wi, kind);
  return {f.rough_cos, even_part(f.even_cos, kind), f.pdf};
}

/// What is left of a divided sample's radiance along a connection.
float sent_share(const PathSample& sample, const PathConnection& way) {
  const VisiblePoint& point = sample.point;
  return even_transmittance(point.even_shade, -dot(point.even_normal, way.wi));
}

/// Makes it send that radiance, head-on, and the same in all directions but for layers.
void send_evenly(PathSample& sample, Rgb radiance) {
  VisiblePoint& point = sample.point;
  point.is_lambertian = true;
  point.receiver.n = point.ns;
  point.receiver.diffuse = Rgb(1.0f);
  point.receiver.glossy = Rgb();
  point.receiver.transmission = 0.0f;
  sample.light.radiance = Rgb();
  sample.continuation = {point.ns, radiance, Rgb(1.0f), Rgb(1.0f)};  // it matters to nobody where it came from
}

}  // namespace

uint32_t CellSharedPaths::group_class(const VisiblePoint& vertex) {
  const PathState& s = vertex.state;
  uint32_t bounces = s.depth;
  for (const uint16_t count : {s.diffuse_depth, s.glossy_depth, s.transmission_depth, s.transparent_depth})
    bounces = bounces * 31 + count;
  return bounces;
}

void CellSharedPaths::keep(const PathLink& link, const ReflectedPaths& deep, ReflectedPaths& reflected) {
  const Rgb own = link.response * (link.to.radiance_as_found() + deep.sum);
  reflected.sum += own;
  reflected.own += own;
}

void CellSharedPaths::divide(PathLink& link, const ReflectedPaths& deep, ReflectedPaths& reflected) {
  const VisiblePoint& point = link.to.point;
  const Rgb found = link.to.radiance_as_found() + deep.sum, even = link.to.even_radiance() + deep.even;
  const Rgb rest = found - even * even_transmittance(point.even_shade, dot(point.even_normal, point.receiver.wo));
  reflected.sum += link.response * rest;
  reflected.even += link.even_response * rest;
  reflected.own += link.response * rest;
  send_evenly(link.to, even);
}

/// The light sample of the link's sample point is of one group.
void CellSharedPaths::keep_groups(const PathLink& link, std::span<const Rgb> continuation, const ReflectedGroups& deep,
                                  const ReflectedGroups& reflected) {
  const PathSample& sample = link.to;
  add_to_group(reflected.sum, sample.light_group, link.response * sample.light.f_cos * sample.light.radiance);
  for (size_t group = 0; group < continuation.size(); ++group)
    reflected.sum[group] += link.response * (sample.continuation.f_cos * continuation[group] + deep.sum[group]);
}

void CellSharedPaths::divide_groups(const PathLink& link, std::span<Rgb> continuation, const ReflectedGroups& deep,
                                    const ReflectedGroups& reflected) {
  const PathSample& sample = link.to;
  const VisiblePoint& point = sample.point;
  const float transmittance = even_transmittance(point.even_shade, dot(point.even_normal, point.receiver.wo));
  for (size_t group = 0; group < continuation.size(); ++group) {
    const bool is_lights = static_cast<size_t>(sample.light_group) == group;
    const Rgb light = is_lights ? sample.light.radiance : Rgb();
    const Rgb found = sample.light.f_cos * light + sample.continuation.f_cos * continuation[group] + deep.sum[group];
    const Rgb even =
        sample.light.even_cos * light + sample.continuation.even_cos * continuation[group] + deep.even[group];
    const Rgb rest = found - even * transmittance;
    reflected.sum[group] += link.response * rest;
    reflected.even[group] += link.even_response * rest;
    continuation[group] = even;
  }
}

void CellSharedPaths::share(Group& group, Scratch& scratch) const {
  if (std::ranges::none_of(group.links, [](const PathLink* link) { return sends_light(*link); })) return;
  prepare_vertices(group, scratch);
  for (size_t i = 0; i < group.size(); ++i)
    if (sends_light(*group.links[i])) share_sample(group, i, scratch);
}

void CellSharedPaths::prepare_vertices(const Group& group, Scratch& scratch) const {
  const VisiblePoint& first = group.links.front()->from;
  scratch.bounces_agree =
      std::ranges::all_of(group.links, [&](const PathLink* link) { return has_same_bounces(link->from, first); });
  scratch.points.clear();
  scratch.bsdfs.clear();
  for (const PathLink* link : group.links) {
    scratch.points.push_back(surface_point(link->from));
    scratch.bsdfs.emplace_back();
    const NestedCellKey cell = guide_cell(context_, scratch.points.back());
    Bsdf& bsdf = scratch.bsdfs.back();
    if (is_plain(link->from)) {
      bsdf.guide = find_guide(context_, cell);
      continue;
    }
    bsdf = evaluate_material(context_.scene, scratch.points.back(), link->from.state, &context_.accel);
    guide_bounce(context_, cell, bsdf);
  }
}

CellSharedPaths::Scratch::Pair CellSharedPaths::connect_pair(const Group& group, size_t receiver, const Bsdf& bsdf,
                                                             const PathSample& sample) const {
  const VisiblePoint& from = group.links[receiver]->from;
  const std::optional<PathConnection> way = connect(from, sample);
  if (!way) return {};
  const PairResponse f = bsdf.scatters() ? respond(context_, bsdf, way->wi, sample.kind)
                                         : respond_plainly(from, bsdf.guide, way->wi, sample.kind);
  if (is_black(f.f_cos) || f.pdf == 0.0f) return {};  // its BSDF sampling never makes this link
  float density = f.pdf * way->geometry;
  if (group.weights == PairWeights::TARGETS)
    density = group.confidences[receiver] * path_target(from, sample, PathTarget::REFLECTED, Reflection::EVALUATED);
  return {*way, f.f_cos, f.even_cos, density, {}};
}

/// Of kinds of scattering in what a vertex makes of a direction.
KindColors CellSharedPaths::pair_shares(size_t receiver, const Scratch& scratch, FoundKind kind) const {
  const Bsdf& bsdf = scratch.bsdfs[receiver];
  if (!bsdf.scatters()) return all_of(ScatterKind::DIFFUSE);
  return shares_of(evaluate_kinds(bsdf, scratch.pairs[receiver].way.wi, lobes_of_kind(context_, kind)).rough);
}

void CellSharedPaths::trace_pairs(const Group& group, size_t finder, Scratch& scratch) const {
  scratch.rays.clear();
  scratch.ray_owners.clear();
  // The ray of a fresh sample found it; that is no question to ask again of a shadow ray, whose ends differ a little.
  const bool own_is_seen = group.is_fresh && !context_.accel.has_transparent_surfaces();
  for (size_t k = 0; k < group.size(); ++k) {
    Scratch::Pair& pair = scratch.pairs[k];
    if (pair.density == 0.0f) continue;
    if (k == finder && own_is_seen) {
      pair.transmittance = Rgb(1.0f);
      continue;
    }
    const int passed_before = group.links[k]->from.state.transparent_depth;
    scratch.rays.push_back({&scratch.points[k], pair.way.wi, passed_before});
    scratch.ray_owners.push_back(static_cast<uint32_t>(k));
  }
  const VisiblePoint& sample_point = group.links[finder]->to.point;
  trace_to_vertex(context_, {sample_point.receiver.position, sample_point.ng, sample_point.clearance},
                  sample_point.state, scratch.rays);
  for (size_t i = 0; i < scratch.rays.size(); ++i) {
    // What the sample point received may have passed as many more surfaces as were left to its path: only for vertices
    // whose paths would have as many left is it what they would have found.
    const VertexRay& ray = scratch.rays[i];
    const bool is_as_far = ray.transparent_depth + ray.surfaces == sample_point.state.transparent_depth;
    scratch.pairs[scratch.ray_owners[i]].transmittance = is_as_far ? ray.transmittance : Rgb();
  }
}

/// MIS weight of the vertex that found the sample.
float CellSharedPaths::finder_weight(PairWeights weights, size_t finder, const Scratch& scratch) {
  if (weights == PairWeights::EQUAL) return 1.0f / static_cast<float>(scratch.holders);
  float sum = 0.0f;
  for (const Scratch::Pair& pair : scratch.pairs)
    if (weights == PairWeights::UNSHADOWED || !is_black(pair.transmittance)) sum += pair.density;
  return sum > 0.0f ? scratch.pairs[finder].density / sum : 0.0f;
}

void CellSharedPaths::share_sample(Group& group, size_t finder, Scratch& scratch) const {
  const PathLink& found = *group.links[finder];
  scratch.pairs.clear();
  scratch.holders = 0;
  for (size_t k = 0; k < group.size(); ++k) {
    const bool agrees = scratch.bounces_agree || has_same_bounces(group.links[k]->from, found.from);
    const bool may_have_it = k == finder || agrees;
    scratch.pairs.push_back(may_have_it ? connect_pair(group, k, scratch.bsdfs[k], found.to) : Scratch::Pair{});
    scratch.holders += may_have_it;
  }
  trace_pairs(group, finder, scratch);
  // Of a fresh sample only by rounding, for the link was made; one from the history may be hidden: then it is for
  // others.
  if (is_black(scratch.pairs[finder].transmittance)) return;
  const float weight = found.W * finder_weight(group.weights, finder, scratch);
  for (size_t k = 0; k < group.size(); ++k) {
    const Scratch::Pair& pair = scratch.pairs[k];
    if (is_black(pair.transmittance)) continue;
    const float sent = sent_share(found.to, pair.way);
    const Rgb radiance = found.to.continuation.radiance * sent * pair.transmittance * pair.way.geometry;
    ReflectedPaths& reflected = *group.reflected[k];
    reflected.sum += pair.f_cos * radiance * weight;
    if (!group.reflected_by_kind.empty())
      *group.reflected_by_kind[k] += pair_shares(k, scratch, found.to.kind) * (pair.f_cos * radiance * weight);
    reflected.even += pair.even_cos * radiance * weight;
    if (!group.continuations.empty()) {
      const Rgb factor = pair.transmittance * (sent * pair.way.geometry * weight);
      add_to_groups(group.reflected_groups[k].sum, group.continuations[finder], pair.f_cos * factor);
      add_to_groups(group.reflected_groups[k].even, group.continuations[finder], pair.even_cos * factor);
    }
    if (k == finder) reflected.own += pair.f_cos * radiance * found.W;
  }
}

}  // namespace cistern
