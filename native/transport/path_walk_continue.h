#pragma once

#include "transport/path_walk.h"
#include "transport/ray_portal.h"

// How a walk goes on from a vertex: through it or scattered, if roulette lets it. Included by path_walk.h.

namespace cistern {

template <class Kind>
inline bool Walk<Kind>::continue_path(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
  if (p_scatter < 1.0f && sampler_.next_float() >= p_scatter) return pass_through(point, bsdf, 1.0f - p_scatter);
  if (last_segment_ || !bsdf.scatters()) return false;
  return scatter(point, bsdf, p_scatter);
}

template <class Kind>
inline void Walk<Kind>::scale_by_chance(Rgb weight, float probability) {
  throughput_.scale(weight * (1.0f / probability));
  if constexpr (Kind::splits) {
    if (context_.splits_kinds)
      for (Throughput& part : kinds_.throughput) part.scale(weight * (1.0f / probability));
  }
  if constexpr (Kind::captures) {
    capture_.link_probability *= probability;
    capture_.response *= weight * (1.0f / probability);
    capture_.even_response *= weight * (1.0f / probability);
  }
}

template <class Kind>
inline bool Walk<Kind>::pass_through(const SurfacePoint& point, const Bsdf& bsdf, float probability) {
  if (is_on_sheet()) return false;
  const int most_surfaces = context_.limits.max_transparent_bounces;
  if (state_.transparent_depth >= most_surfaces) return false;
  last_segment_ |= ++state_.transparent_depth == most_surfaces;
  if (bsdf.portal_count > 0) return pass_portal(point, bsdf, probability);
  return go_straight(point, bsdf.transparency, probability);
}

template <class Kind>
inline bool Walk<Kind>::go_straight(const SurfacePoint& point, Rgb weight, float probability) {
  update_media(point, ray_.direction);
  scale_by_chance(weight, probability);
  ray_.t_max -= state_.ray_length - travelled_;  // clipping stays measured from the last vertex
  ray_.t_min = 0.0f;
  travelled_ = state_.ray_length;
  ray_.origin = offset_origin(point.position, point.clearance, point.ng, ray_.direction);
  ray_.passes = point.triangle_id();
  return true;
}

template <class Kind>
inline void Walk<Kind>::forget_rivals() {
  if (mis_receiver_) mis_receiver_->light_samples = 0;
  if constexpr (Kind::captures) capture_.mis_candidates = 0.0f;
  if constexpr (Kind::learns) learning_.of_ray.reset();
}

template <class Kind>
bool Walk<Kind>::pass_portal(const SurfacePoint& point, const Bsdf& bsdf, float probability) {
  if constexpr (Kind::captures) {
    capture_.open_link.reset();
    capture_.vertex = {};
    if (capture_.only_deep_link_next && !continues_deep_link()) {
      capture_.only_deep_link_next = false;
      last_segment_ = true;
    }
  }
  ++state_.portal_depth;
  const PortalChoice choice = choose_portal(bsdf, sampler_.next_float());
  if (!choice.portal) {
    forget_rivals();
    return go_straight(point, choice.weight, probability * choice.probability);
  }
  mis_receiver_.reset();
  scale_by_chance(choice.weight, probability * choice.probability);
  ray_ = portal_ray(point, *choice.portal);
  vertex_origin_ = ray_.origin;
  travelled_ = 0.0f;
  if constexpr (Kind::has_media) {
    media_.stack = context_.media->around(context_.accel, ray_.origin);
    media_.trail.clear();
  }
  return true;
}

template <class Kind>
inline bool Walk<Kind>::scatter(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
  const auto [u_lobe, u_direction] = sampler_.scattering(state_.depth);
  std::optional<BsdfSample> sample = sample_bsdf(bsdf, u_lobe, u_direction);
  if (!sample) return false;
  if (sample->subsurface) return scatter_below(point, *sample, p_scatter);
  if (context_.divides_kinds && !sample->is_delta) carry_own_kind(bsdf, *sample);
  if constexpr (Kind::learns) {
    if (scratch_.trains_guide)
      remember_direction(context_, point, bsdf, *sample, throughput_.total(), learning_.gathered, scratch_);
  }
  const Rgb rough_weight = sample->rough_weight * (1.0f / p_scatter);
  const Rgb smooth_weight = sample->smooth_weight * (1.0f / p_scatter);
  if constexpr (Kind::splits) scatter_kinds(bsdf, *sample, rough_weight, smooth_weight);
  if constexpr (Kind::captures) {
    throughput_.scatter(rough_weight, smooth_weight, capture_.vertex.sample_point_of == 0, is_left_deep());
  } else {
    throughput_.scatter(rough_weight, smooth_weight);
  }
  if (is_black(throughput_.worth())) return false;
  if constexpr (Kind::captures) {
    if (capture_.vertex.starts) throughput_.forget_color();  // that of the vertex where the link starts
    leave_captured_vertex(*sample, p_scatter);
    if (capture_.vertex.sample_point_of == 0 && !goes_on_from_sample_point()) return false;
  }
  if constexpr (Kind::is_guided) guided_.count_gain(bsdf, *sample);
  const int rivals = light_samples();
  const bool is_through_pane = sample->is_delta && goes_through_pane(point, bsdf, *sample);
  if (context_.passes_panes && !sample->is_delta) panes_.vertex = state_;
  count_bounce(*sample);
  state_.set_receiver(light_set_of(point));
  sees_film_ &= context_.limits.film_transparent_glass && sample->is_clear;
  if constexpr (Kind::learns) {
    if (!is_through_pane) learning_.of_ray = learning_.at_vertex;
  }
  panes_.faces = is_through_pane ? panes_.faces + 1 : 0;
  if (sample->is_delta) {
    if (!is_through_pane) mis_receiver_.reset();
  } else {
    MisReceiver& receiver = mis_receiver_.emplace();  // in place: a copy would wait for the stores it reads
    receiver.position = point.position;
    receiver.normal = light_side(point, bsdf);
    receiver.light_samples = rivals;
    scatter_pdf_ = sample->pdf * scatter_probability(bsdf);
    if constexpr (Kind::captures) capture_.mis_candidates = capture_.vertex.light_candidates;
  }
  update_media(point, sample->wi);
  ray_.origin = vertex_origin_ = offset_origin(point.position, point.clearance, point.ng, sample->wi);
  ray_.direction = sample->wi;
  ray_.t_min = 0.0f;
  ray_.t_max = INFINITY;
  ray_.leaves = point.triangle_id();
  ray_.passes = kNoTriangle;
  travelled_ = 0.0f;
  if (context_.passes_panes && !sample->is_delta) panes_.begin = ray_;
  return true;
}

template <class Kind>
inline bool Walk<Kind>::goes_through_pane(const SurfacePoint& point, const Bsdf& bsdf, const BsdfSample& sample) const {
  if (!context_.passes_panes || !mis_receiver_ || sample.kind != ScatterKind::TRANSMISSION) return false;
  const bool may_be_pane = context_.scene.materials[static_cast<size_t>(point.material)]->may_be_pane;
  return may_be_pane && context_.accel.may_be_pane(point.instance) && find_pane_face(point, bsdf).has_value();
}

template <class Kind>
bool Walk<Kind>::scatter_below(const SurfacePoint& entry, const BsdfSample& sample, float p_scatter) {
  const auto find_exit = sample.subsurface->is_profile() ? exit_by_profile : walk_below;
  const std::optional<SubsurfaceExit> exit =
      find_exit(context_.accel, entry, *sample.subsurface, state_.depth, sampler_);
  if (!exit) return false;
  const Rgb weight = sample.smooth_weight * exit->weight * (1.0f / p_scatter);
  if constexpr (Kind::splits) scatter_kinds({}, weight);
  if constexpr (Kind::captures) {
    throughput_.scatter({}, weight, capture_.vertex.sample_point_of == 0, is_left_deep());
    if (capture_.vertex.starts) throughput_.forget_color();
    capture_.open_link.reset();
    if (capture_.vertex.sample_point_of == 0 && !goes_on_from_sample_point()) return false;
    capture_.vertex = {};
  } else {
    throughput_.scatter({}, weight);
  }
  if (is_black(throughput_.worth())) return false;
  SurfacePoint point = make_surface_point(context_.scene, exit->ray, exit->hit);
  set_footprint(point, entry.footprint, context_.scene, state_);
  if constexpr (Kind::has_media) {  // not those where it entered
    media_.stack =
        context_.media->around(context_.accel, offset_origin(point.position, point.clearance, point.ng, point.ng));
    media_.trail.clear();
  }
  const Bsdf bsdf = evaluate_exit(context_.scene, point, state_, &context_.accel);
  if (!bsdf.scatters()) return false;
  add_light_samples(point, bsdf, 1.0f);
  return scatter(point, bsdf, 1.0f);
}

template <class Kind>
inline void Walk<Kind>::carry_own_kind(const Bsdf& bsdf, BsdfSample& sample) {
  const BsdfEvaluation f = evaluate_bsdf(bsdf, sample.wi, ray_kind(sample.kind));
  sample.rough_weight = f.rough_cos / sample.kind_pdf;
  sample.smooth_weight = f.smooth_cos / sample.kind_pdf;
}

template <class Kind>
inline void Walk<Kind>::leave_captured_vertex(const BsdfSample& sample, float p_scatter) {
  const float pdf = context_.tells_kinds ? sample.kind_pdf : sample.pdf;
  const bool by_rough_lobes = !is_black(sample.rough_weight);
  const FoundKind kind = found_kind(ray_kind(sample.kind));
  const Rgb even_cos = even_part(sample.even_cos, kind);
  if (capture_.vertex.sample_point_of && by_rough_lobes) {
    const auto link = static_cast<size_t>(*capture_.vertex.sample_point_of);
    capture_.out->links[link].to.continuation = {sample.wi, {}, sample.rough_weight * pdf, even_cos, kind};
    throughput_.continuation[link] = Rgb(1.0f / (pdf * p_scatter));
  }
  capture_.open_link = by_rough_lobes ? capture_.vertex.starts : std::nullopt;
  capture_.link_probability = pdf * p_scatter;
  capture_.response = sample.rough_weight * (1.0f / p_scatter);
  capture_.even_response = even_cos * (1.0f / (pdf * p_scatter));
}

template <class Kind>
inline bool Walk<Kind>::goes_on_from_sample_point() {
  if (!capture_.out->goes_on) return false;
  if (capture_.out->going_on_probability < 1.0f) scale_by_chance(Rgb(1.0f), capture_.out->going_on_probability);
  return true;
}

template <class Kind>
inline void Walk<Kind>::count_bounce(const BsdfSample& sample) {
  count_scattering(state_, sample.kind);
  state_.is_singular = sample.is_delta;
  limit_gloss(sample.is_delta ? INFINITY : sample.albedo_pdf);
  last_segment_ = exceeds_limits(state_, context_.limits);
  if constexpr (Kind::captures) {
    if (last_segment_ && !capture_.out->leaves_deep_link && continues_deep_link()) extend_deep_link();
  }
}

template <class Kind>
inline void Walk<Kind>::limit_gloss(float pdf) {
  if (!context_.limits.limits_gloss()) return;
  least_pdf_ = std::min(least_pdf_, pdf);
  state_.gloss = gloss_limits(context_.limits, state_.ray_kind, least_pdf_);
}

template <class Kind>
inline void Walk<Kind>::extend_deep_link() {
  // The second link stands in for one that starts at a visible point: the bounce before it does not count.
  PathState of_link = state_;
  for (const auto count :
       {&PathState::depth, &PathState::diffuse_depth, &PathState::glossy_depth, &PathState::transmission_depth}) {
    const int before = capture_.out->links[1].from.state.*count - capture_.out->visible.state.*count;
    of_link.*count = static_cast<uint16_t>(of_link.*count - before);
  }
  last_segment_ = exceeds_limits(of_link, context_.limits);
  capture_.only_deep_link_next = !last_segment_;
}

template <class Kind>
inline bool Walk<Kind>::continues_deep_link() const {
  return capture_.open_link == 1 || !is_black(throughput_.continuation[1]);
}

template <class Kind>
inline bool Walk<Kind>::plays_roulette() const {
  return state_.depth > context_.limits.min_bounces;
}

template <class Kind>
inline bool Walk<Kind>::survives_roulette() {
  if (!plays_roulette()) return true;
  float worth = max_component(throughput_.worth());
  if constexpr (Kind::has_media)
    worth = std::max(worth, max_component(-1.0f * throughput_.worth()));  // see uneven_media.h
  if constexpr (Kind::is_guided) worth *= guided_.gain();
  if (worth >= 1.0f) return true;
  const float p = std::cbrt(worth);
  if (sampler_.next_float() >= p) return false;
  scale_by_chance(Rgb(1.0f), p);
  return true;
}

}  // namespace cistern
