#include "restir/cell_shared_paths.h"

#include "restir/pixel_reuse.h"
#include "shading/material.h"
#include "transport/path_guide.h"

namespace cistern {
namespace {

bool sends_light(const PathLink& link) { return link.W > 0.0f && !is_black(link.to.continuation.radiance); }

/// Nearly all vertices: they need no material evaluated. No bump map bends their normal.
bool is_plain(const VisiblePoint& vertex) { return vertex.is_lambertian && vertex.receiver.n == vertex.ns; }

using Scratch = CellSharedPaths::Scratch;

/// Where a vertex of a group is among those that are taken together.
size_t block_of(size_t vertex) { return vertex / kLanes; }
size_t lane_of(size_t vertex) { return vertex % kLanes; }

/// The way from each vertex to the sample point, as `connect` has it for one, and what plain vertices make of it.
void connect_plainly(const Scratch::Vertices& vertices, const PathSample& sample, Scratch::Pairs& pairs) {
  const SurfaceLanes& points = vertices.points;
  const Vec3Lanes offset = Vec3Lanes(sample.point.receiver.position) - points.position;
  const Lanes d2 = dot(offset, offset);
  pairs.wi = offset * (1.0f / sqrt(d2));
  const Lanes cosine_there = -dot(Vec3Lanes(sample.point.ng), pairs.wi);
  const LaneMask is_connected = d2 > 0.0f && cosine_there > 0.0f;
  pairs.geometry = where_or_zero(is_connected, cosine_there / d2);
  const bool is_found_plainly = sample.kind == 0 || sample.kind == kVisibleToDiffuse;
  const Lanes cosine = dot(points.ns, pairs.wi);
  const LaneMask can_leave = is_connected && cosine > 0.0f && dot(points.ng, pairs.wi) > 0.0f;
  const LaneMask is_plain = LaneMask(is_found_plainly) && !is_black(vertices.diffuse);
  pairs.pdf = where_or_zero(can_leave && is_plain, cosine * kInvPi);
  pairs.f_cos = pairs.even_cos = vertices.diffuse * pairs.pdf;
}

/// The same of those with layers.
void evaluate_layered(const BsdfLanes& bsdfs, const DirectionGuideLanes* guides, Scratch::Pairs& pairs) {
  const LaneMask is_connected = bsdfs.is_set() && pairs.geometry > 0.0f;
  if (none_of(is_connected)) return;
  const BsdfLanes::Evaluation f = bsdfs.evaluate(pairs.wi, is_connected, guides);
  assign(is_connected, pairs.f_cos, f.rough_cos);
  assign(is_connected, pairs.even_cos, f.even_cos);
  where(is_connected, pairs.pdf) = f.pdf;
}

/// What is left of a divided sample's radiance along the connections.
Lanes sent_shares(const PathSample& sample, const Vec3Lanes& wi) {
  const VisiblePoint& point = sample.point;
  if (point.even_shade == 0.0f) return 1.0f;
  const Lanes cosines = -dot(Vec3Lanes(point.even_normal), wi);
  return Lanes([&](auto lane) { return even_transmittance(point.even_shade, cosines[lane]); });
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

/// The light below which samples are handed on by chance, in proportion to it, so that `expected` are; 0 if no more
/// than that have any. Those above are certain, and leave fewer to the others. Light that is no finite number counts
/// for nothing here. [Fearnhead and Clifford 2003]
float chance_below(std::span<const float> light, size_t expected) {
  const auto has_any = [](float l) { return l > 0.0f; };
  if (static_cast<size_t>(std::ranges::count_if(light, has_any)) <= expected) return 0.0f;
  float threshold = std::numeric_limits<float>::max();
  for (size_t certain = 0, before = 0;; before = certain) {
    float rest = 0.0f;
    for (const float l : light) rest += l < threshold ? l : 0.0f;
    threshold = rest / static_cast<float>(expected - before);
    certain = static_cast<size_t>(std::ranges::count_if(light, [=](float l) { return l >= threshold; }));
    if (certain <= before || certain >= expected) return threshold;
  }
}

/// What is left of an even sample's light on the way to its finder.
float own_share(const VisiblePoint& point) {
  return even_transmittance(point.even_shade, dot(point.even_normal, point.receiver.wo));
}

}  // namespace

uint32_t CellSharedPaths::group_class(const VisiblePoint& vertex) {
  const PathState& s = vertex.state;
  uint32_t bounces = s.depth;
  for (const uint16_t count :
       {s.diffuse_depth, s.glossy_depth, s.transmission_depth, s.transparent_depth, s.portal_depth})
    bounces = bounces * 31 + count;
  return bounces;
}

void CellSharedPaths::keep(const PathLink& link, const ReflectedPaths& deep, ReflectedPaths& reflected) {
  const Rgb own = link.response * (link.to.radiance_as_found() + deep.sum);
  reflected.sum += own;
  reflected.own += own;
}

void CellSharedPaths::divide(PathLink& link, const ReflectedPaths& deep, ReflectedPaths& reflected) {
  const Rgb found = link.to.radiance_as_found() + deep.sum, even = link.to.even_radiance() + deep.even;
  const Rgb rest = found - even * own_share(link.to.point);
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
  const float transmittance = own_share(sample.point);
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

size_t CellSharedPaths::share(Group& group, Scratch& scratch) const {
  choose_samples(group, scratch);
  if (scratch.handed_on == 0) return 0;
  prepare_vertices(group, scratch);
  for (size_t i = 0; i < group.size(); ++i)
    if (scratch.factors[i] > 0.0f) share_sample(group, i, scratch);
  for (size_t i = 0; i < group.size(); ++i) {
    const Scratch::Vertices& vertices = scratch.vertices[block_of(i)];
    group.reflected[i]->sum += vertices.sum.at(lane_of(i));
    group.reflected[i]->even += vertices.even.at(lane_of(i));
  }
  return scratch.handed_on;
}

/// A sample's light is what its own finder makes of it. Half of that is what it would be in the mean of all finders:
/// the others may make something of a sample that its finder makes nothing of.
void CellSharedPaths::choose_samples(const Group& group, Scratch& scratch) {
  std::vector<float>& factors = scratch.factors;
  factors.assign(group.size(), 0.0f);
  scratch.handed_on = 0;
  float responses = 0.0f, count = 0.0f;
  for (const PathLink* link : group.links) {
    if (!sends_light(*link)) continue;
    responses += magnitude(link->response);
    count += 1.0f;
  }
  for (size_t i = 0; i < group.size(); ++i) {
    const PathLink& link = *group.links[i];
    if (sends_light(link))
      factors[i] = (magnitude(link.response) + responses / count) * magnitude(link.to.continuation.radiance);
  }
  const float threshold = group.is_fresh ? chance_below(factors, group.handed_on) : 0.0f;
  double u = group.u_choice;
  for (size_t i = 0; i < group.size(); ++i) {
    if (!sends_light(*group.links[i])) continue;
    const bool is_certain = !(factors[i] < threshold);
    const double probability = is_certain ? 1.0 : double{factors[i]} / double{threshold};
    u += probability;
    const bool is_chosen = is_certain || (u >= 1.0 && probability > 0.0);
    if (u >= 1.0) u -= 1.0;
    factors[i] = is_chosen ? static_cast<float>(1.0 / probability) : 0.0f;
    scratch.handed_on += is_chosen;
    if (group.is_fresh) add_own(*group.links[i], *group.reflected[i]);
  }
}

/// What the finder alone makes of a divided sample that is as it found it.
void CellSharedPaths::add_own(const PathLink& link, ReflectedPaths& reflected) {
  reflected.own += link.response * link.to.continuation.radiance * own_share(link.to.point);
}

void CellSharedPaths::prepare_vertices(const Group& group, Scratch& scratch) const {
  const VisiblePoint& first = group.links.front()->from;
  scratch.bounces_agree =
      std::ranges::all_of(group.links, [&](const PathLink* link) { return has_same_bounces(link->from, first); });
  scratch.vertices.assign(blocks_of_lanes(group.size()), {});
  scratch.pairs.resize(scratch.vertices.size());
  scratch.guides.assign(guides_bounces(context_) ? scratch.vertices.size() : 0, {});
  scratch.points.resize(group.size());
  scratch.bsdfs.clear();
  scratch.bsdfs.reserve(group.size());
  scratch.layered.clear();
  scratch.others.clear();
  for (size_t k = 0; k < group.size(); ++k) {
    const VisiblePoint& from = group.links[k]->from;
    const SurfacePoint& point = scratch.points[k] = surface_point(from);
    Scratch::Vertices& vertices = scratch.vertices[block_of(k)];
    vertices.points.set(lane_of(k), point, from.state.transparent_depth);
    Bsdf& bsdf = scratch.bsdfs.emplace_back();
    const GuideCells cells = guide_cells(context_, point);
    if (is_plain(from)) {
      vertices.diffuse.set(lane_of(k), from.receiver.diffuse);
      if (cells.is_any()) scratch.guides[block_of(k)].set(lane_of(k), find_guide(context_, cells));
      continue;
    }
    bsdf = evaluate_material(context_.scene, point, from.state, &context_.accel);
    guide_bounce(context_, cells, bsdf);
    if (scratch.layered.empty() && !context_.tells_kinds) scratch.layered.resize(scratch.vertices.size());
    if (scratch.layered.empty() || !scratch.layered[block_of(k)].set(lane_of(k), bsdf)) {
      scratch.others.push_back(static_cast<uint32_t>(k));
    } else if (bsdf.guide) {
      scratch.guides[block_of(k)].set(lane_of(k), bsdf.guide);
    }
  }
}

/// Of a vertex that is none of those: what it makes of the direction. No density: no path leaves this way.
void CellSharedPaths::evaluate_pair(size_t receiver, const PathSample& sample, Scratch& scratch) const {
  const Bsdf& bsdf = scratch.bsdfs[receiver];
  Scratch::Pairs& pairs = scratch.pairs[block_of(receiver)];
  const size_t lane = lane_of(receiver);
  if (pairs.geometry[lane] == 0.0f) return;
  const Vec3 wi = pairs.wi.at(lane);
  const BsdfEvaluation f = evaluate_kind(context_, bsdf, wi, sample.kind);
  pairs.f_cos.set(lane, f.rough_cos);
  pairs.even_cos.set(lane, even_part(f.even_cos, sample.kind));
  pairs.pdf[lane] = f.pdf;
}

void CellSharedPaths::connect_pairs(const Group& group, size_t finder, Scratch& scratch) const {
  const PathSample& sample = group.links[finder]->to;
  for (size_t b = 0; b < scratch.pairs.size(); ++b) {
    Scratch::Pairs& pairs = scratch.pairs[b];
    const DirectionGuideLanes* guides = scratch.guides.empty() ? nullptr : &scratch.guides[b];
    connect_plainly(scratch.vertices[b], sample, pairs);
    if (guides && any_of(pairs.pdf > 0.0f)) pairs.pdf = guides->pdf(pairs.pdf, pairs.wi);
    if (!scratch.layered.empty()) evaluate_layered(scratch.layered[b], guides, pairs);
  }
  for (const uint32_t k : scratch.others) evaluate_pair(k, sample, scratch);
  for (Scratch::Pairs& pairs : scratch.pairs)
    pairs.density = where_or_zero(!is_black(pairs.f_cos), pairs.pdf * pairs.geometry);
  scratch.holders = group.size();
  const bool needs_targets = group.weights == PairWeights::TARGETS;
  if (scratch.bounces_agree && !needs_targets) return;
  for (size_t k = 0; k < group.size(); ++k) {
    const VisiblePoint& from = group.links[k]->from;
    Lanes& density = scratch.pairs[block_of(k)].density;
    if (k != finder && !has_same_bounces(from, group.links[finder]->from)) {
      density[lane_of(k)] = 0.0f;
      --scratch.holders;
    } else if (needs_targets && density[lane_of(k)] > 0.0f) {
      density[lane_of(k)] =
          group.confidences[k] * path_target(from, sample, PathTarget::REFLECTED, Reflection::EVALUATED);
    }
  }
}

void CellSharedPaths::trace_pairs(const Group& group, size_t finder, Scratch& scratch) const {
  // The ray of a fresh sample found it; that is no question to ask again of a shadow ray, whose ends differ a little.
  const bool own_is_seen = group.is_fresh && !context_.accel.has_transparent_surfaces();
  const VisiblePoint& sample_point = group.links[finder]->to.point;
  const SeenVertex seen{sample_point.receiver.position, sample_point.ng, sample_point.clearance};
  for (size_t b = 0; b < scratch.pairs.size(); ++b) {
    Scratch::Pairs& pairs = scratch.pairs[b];
    LaneMask is_asked = pairs.density > 0.0f;
    const bool skips_own = own_is_seen && b == block_of(finder);
    if (skips_own) is_asked[lane_of(finder)] = false;
    pairs.transmittance = any_of(is_asked) ? transmittance_as_found(context_, scratch.vertices[b].points, pairs.wi,
                                                                    is_asked, seen, sample_point.state)
                                           : RgbLanes();
    if (skips_own) pairs.transmittance.set(lane_of(finder), Rgb(1.0f));
  }
}

/// MIS weight of the vertex that found the sample.
float CellSharedPaths::finder_weight(PairWeights weights, size_t finder, const Scratch& scratch) {
  if (weights == PairWeights::EQUAL) return 1.0f / static_cast<float>(scratch.holders);
  Lanes sums = 0.0f;
  for (const Scratch::Pairs& pairs : scratch.pairs) {
    const LaneMask counts = weights == PairWeights::UNSHADOWED ? LaneMask(true) : !is_black(pairs.transmittance);
    sums += where_or_zero(counts, pairs.density);
  }
  const float sum = reduce(sums);
  return sum > 0.0f ? scratch.pairs[block_of(finder)].density[lane_of(finder)] / sum : 0.0f;
}

void CellSharedPaths::share_sample(Group& group, size_t finder, Scratch& scratch) const {
  connect_pairs(group, finder, scratch);
  const Scratch::Pairs& own = scratch.pairs[block_of(finder)];
  if (own.density[lane_of(finder)] == 0.0f) return;  // by rounding alone, for the link was made
  trace_pairs(group, finder, scratch);
  // A fresh sample never; one from the history may be hidden: then it is for others.
  if (is_black(own.transmittance.at(lane_of(finder)))) return;
  const float weight = scratch.factors[finder] * group.links[finder]->W * finder_weight(group.weights, finder, scratch);
  hand_out(group, finder, weight, scratch);
  if (!group.reflected_by_kind.empty() || !group.continuations.empty())
    hand_out_divided(group, finder, weight, scratch);
}

void CellSharedPaths::hand_out(Group& group, size_t finder, float weight, Scratch& scratch) const {
  const PathLink& found = *group.links[finder];
  for (size_t b = 0; b < scratch.pairs.size(); ++b) {
    const Scratch::Pairs& pairs = scratch.pairs[b];
    Scratch::Vertices& vertices = scratch.vertices[b];
    // Light beyond the range of numbers stays with those that it reaches.
    const LaneMask is_reached = pairs.density > 0.0f && !is_black(pairs.transmittance);
    const Lanes arriving = pairs.geometry * sent_shares(found.to, pairs.wi);
    const RgbLanes radiance =
        where_or_zero(is_reached, pairs.transmittance * (found.to.continuation.radiance * arriving));
    vertices.sum += pairs.f_cos * radiance * weight;
    vertices.even += pairs.even_cos * radiance * weight;
    if (!group.is_fresh && b == block_of(finder)) {
      const Rgb own = (pairs.f_cos * radiance).at(lane_of(finder));
      group.reflected[finder]->own += own * found.W;
    }
  }
}

/// What is handed out, by kinds of scattering and by light groups.
void CellSharedPaths::hand_out_divided(Group& group, size_t finder, float weight, const Scratch& scratch) const {
  const PathLink& found = *group.links[finder];
  for (size_t k = 0; k < group.size(); ++k) {
    const Scratch::Pairs& pairs = scratch.pairs[block_of(k)];
    const size_t lane = lane_of(k);
    const Rgb transmittance = pairs.transmittance.at(lane);
    if (is_black(transmittance)) continue;
    const float sent = sent_shares(found.to, pairs.wi)[lane] * pairs.geometry[lane];
    const Rgb factor = transmittance * (sent * weight), f_cos = pairs.f_cos.at(lane) * factor;
    if (!group.reflected_by_kind.empty())
      *group.reflected_by_kind[k] += pair_shares(k, scratch, found.to.kind) * (f_cos * found.to.continuation.radiance);
    if (group.continuations.empty()) continue;
    add_to_groups(group.reflected_groups[k].sum, group.continuations[finder], f_cos);
    add_to_groups(group.reflected_groups[k].even, group.continuations[finder], pairs.even_cos.at(lane) * factor);
  }
}

/// Of kinds of scattering in what a vertex makes of a direction.
KindColors CellSharedPaths::pair_shares(size_t receiver, const Scratch& scratch, FoundKind kind) const {
  const Bsdf& bsdf = scratch.bsdfs[receiver];
  if (!bsdf.scatters()) return all_of(PassKind::DIFFUSE);
  const Vec3 wi = scratch.pairs[block_of(receiver)].wi.at(lane_of(receiver));
  return shares_of(evaluate_kinds(bsdf, wi, lobes_of_kind(context_, kind)).rough);
}

}  // namespace cistern
