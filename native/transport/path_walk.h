#pragma once

#include <type_traits>
#include <utility>
#include <variant>

#include "base/warp.h"
#include "shading/material.h"
#include "transport/camera_ray.h"
#include "transport/guide_lesson.h"
#include "transport/learned_light_sample.h"
#include "transport/path_guide.h"
#include "transport/path_throughput.h"
#include "transport/path_tracer.h"
#include "transport/path_walk_state.h"

namespace cistern {

/// trace_path for a context with learned lights or guided bounces.
PathRecord trace_learned_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                              PathCapture* capture);

/// One path on its way. The steps of `trace_path` in the order they happen. `capture` is null unless the kind captures.
template <class Kind>
class Walk {
 public:
  Walk(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch, PathCapture* capture)
      : context_(context), ray_(ray), sampler_(sampler), scratch_(scratch), vertex_origin_(ray.origin) {
    features_done_ = !context.record_surfaces;
    if constexpr (Kind::captures) {
      capture_.out = capture;
      capture->clear();
    }
  }

  PathRecord run() {
    while (step()) {
    }
    if constexpr (Kind::learns) teach_directions(learning_.gathered, scratch_);
    return record_;
  }

 private:
  /// Follows one segment; false when the path has ended.
  bool step() {
    const std::optional<Hit> hit = context_.accel.intersect(ray_, state_.ray_kind);
    if (context_.lights.has_visible_lamps()) add_lamps(hit);
    if (!hit) {
      add_environment();
      return false;
    }
    path_length_ += hit->t;
    state_.ray_length = travelled_ + hit->t;
    SurfacePoint point = make_surface_point(context_.scene, ray_, *hit);
    point.footprint = context_.pixel.size + context_.pixel.angle * path_length_;
    if (sees_film_ && context_.scene.instances[hit->instance].is_holdout) {
      hold_out(1.0f);
      return false;
    }
    Bsdf bsdf = evaluate_material(context_.scene, point, state_);
    if constexpr (Kind::captures) {
      if (can_be_visible_point(bsdf)) bsdf.rough_sampling = capture_.out->rough_sampling;
    }
    const bool is_seen = average(bsdf.transparency) <= kMostTransparency;
    if (context_.record_surfaces && !record_.hit && state_.depth == 0 && is_seen) record_first_hit(point, bsdf);
    if (bsdf.holdout > 0.0f) hold_out(bsdf.holdout);
    if (!is_black(bsdf.emission)) add_surface_emission(point, bsdf.emission);
    record_features(bsdf);
    if constexpr (Kind::captures) {
      if (std::exchange(capture_.only_deep_link_next, false)) throughput_.keep_only_link(1);
      capture_.vertex = {};
    }
    const bool is_vertex = !last_segment_ && bsdf.scatters();
    if constexpr (Kind::learns) {
      if (is_vertex) guide_bounce(context_, point, bsdf);
    }
    float p_scatter = scatter_probability(bsdf);
    if constexpr (Kind::captures) {
      if (is_vertex && capture_.open_link && p_scatter < 1.0f) {
        // A sample point either reflects or is passed: decided before its light is gathered.
        if (sampler_.next_float() >= p_scatter) return pass_through(point, bsdf, 1.0f - p_scatter);
        scale_by_chance(Rgb(1.0f), p_scatter);
        p_scatter = 1.0f;
      }
    }
    if (is_vertex) {
      if constexpr (Kind::captures) capture_vertex(point, bsdf);
      add_light_samples(point, bsdf, p_scatter);
    }
    return continue_path(point, bsdf, p_scatter);
  }

  void hold_out(float fraction) {
    if (sees_film_) record_.alpha -= fraction * average(throughput_.total());
  }

  void record_first_hit(const SurfacePoint& point, const Bsdf& bsdf) {
    record_.hit = true;
    record_.position = point.position;
    record_.depth = camera_depth(context_.scene.camera, point.position);
    record_.normal = bsdf.scatters() ? bsdf_normal(bsdf) : point.ns;
  }

  /// Albedo and normal for a denoiser, where the path first meets something not mirror-like.
  void record_features(const Bsdf& bsdf) {
    if (features_done_ || is_black(throughput_.smooth)) return;
    const bool ends_here = !bsdf.scatters() && is_black(bsdf.transparency);
    if (!ends_here && !has_rough_lobe(bsdf)) return;
    features_done_ = true;
    const Rgb shown = ends_here ? min(bsdf.emission, Rgb(1.0f)) : bsdf_albedo(bsdf);
    record_.albedo = throughput_.smooth * shown;
    record_.denoising_normal = bsdf.scatters() ? bsdf_normal(bsdf) : bsdf.ng;
  }

  // --- what is left to others -------------------------------------------------------------------------------------

  VertexUse vertex_use() const {
    if constexpr (Kind::captures) {
      return capture_.vertex;
    } else {
      return {};
    }
  }

  VisiblePoint captured_point(const SurfacePoint& point, const Bsdf& bsdf) const {
    VisiblePoint captured = make_visible_point(context_.scene, point, bsdf);
    captured.state = state_;
    captured.scattered = scattered_state(bsdf);
    captured.throughput = throughput_.smooth;
    captured.distance = path_length_;
    return captured;
  }

  bool can_be_visible_point(const Bsdf& bsdf) const {
    return !capture_.out->visible.exists && !is_black(throughput_.smooth) && has_rough_lobe(bsdf);
  }

  void capture_vertex(const SurfacePoint& point, const Bsdf& bsdf) {
    const std::optional<int> link = std::exchange(capture_.open_link, std::nullopt);
    if (!has_rough_lobe(bsdf)) return;
    const bool is_visible_point = can_be_visible_point(bsdf);
    const bool gives_light = capture_.out->visible.exists && capture_.out->secondary_candidates > 0.0f;
    if (!is_visible_point && !gives_light && !link) return;
    const VisiblePoint captured = captured_point(point, bsdf);
    if (is_visible_point) {
      capture_.out->visible = captured;
      capture_.vertex.light_candidates = capture_.out->direct_candidates;
      if (capture_.out->link_count > 0) start_link(0, captured);
    }
    if (link) capture_sample_point(*link, captured);
    if (gives_light) capture_light_vertex(captured);
  }

  void start_link(int link, const VisiblePoint& from) {
    capture_.out->links[static_cast<size_t>(link)].from = from;
    capture_.vertex.starts = link;
  }

  void capture_sample_point(int index, const VisiblePoint& captured) {
    PathLink& link = capture_.out->links[static_cast<size_t>(index)];
    const float cosine = std::abs(dot(captured.ng, captured.receiver.wo));
    const float pdf_area = capture_.link_probability * cosine / sqr(state_.ray_length);
    if (!(pdf_area > 0.0f)) return;
    link.W = 1.0f / pdf_area;
    link.to.point = captured;
    link.to.light = link.to.continuation = {};
    link.to.light_visibility = kVisibleToAll;
    link.to.kind = found_kind(state_.ray_kind);
    link.to.origin = {};
    capture_.vertex.sample_point_of = index;
    if (index + 1 < capture_.out->link_count) start_link(index + 1, captured);
  }

  FoundKind found_kind(uint8_t kind) const { return context_.tells_kinds ? kind : FoundKind{0}; }

  void capture_light_vertex(const VisiblePoint& captured) {
    capture_.vertex.light_candidates = capture_.out->secondary_candidates;
    LightVertex vertex{
        captured, throughput_.smooth, {}, throughput_.continuation, capture_.vertex.sample_point_of.value_or(-1)};
    if (capture_.vertex.sample_point_of != 0) vertex.to_indirect = throughput_.direct + throughput_.indirect;
    if (is_left_deep()) vertex.to_continuation[0] = Rgb();
    capture_.out->vertices.push_back(vertex);
  }

  /// Whether the current vertex is the sample point of a second link whose light is left to the caller.
  bool is_left_deep() const { return capture_.vertex.sample_point_of == 1 && capture_.out->leaves_deep_link; }

  /// Light reflected at the current vertex, or other that is met, as the continuations of the captured sample points.
  void add_to_continuations(Rgb by_rough_lobes, Rgb other) {
    if constexpr (Kind::captures) {
      const auto continuation = [&](size_t i) -> Rgb& { return capture_.out->links[i].to.continuation.radiance; };
      continuation(0) += throughput_.continuation[0] * (is_left_deep() ? other : by_rough_lobes + other);
      continuation(1) += throughput_.continuation[1] * (by_rough_lobes + other);
    }
  }

  // --- light found by the path itself ---------------------------------------------------------------------------

  /// Weight of this path against light samples of an emitter that has `pdf` (per solid angle, given the emitter).
  float emitter_weight(std::optional<uint32_t> emitter, float pdf) const {
    if (!emitter || !mis_receiver_) return 1.0f;
    if constexpr (Kind::captures) {
      if (capture_.mis_candidates > 0.0f) return captured_emitter_weight(*emitter, pdf);
    }
    if constexpr (Kind::learns) {
      if (learning_.of_ray) return learned_emitter_weight(*emitter, pdf);
    }
    const float pmf = context_.lights.pmf(*emitter, mis_receiver_->position, mis_receiver_->normal);
    return power_heuristic(scatter_pdf_, pmf * pdf);
  }

  /// The same where reservoirs take the light samples.
  float captured_emitter_weight(uint32_t emitter, float pdf) const {
    const Vec3 side = mis_receiver_->normal;  // reservoirs know nothing of what comes from behind it
    if (side != Vec3{} && !(dot(side, ray_.direction) > 0.0f)) return 1.0f;
    return 1.0f - light_sample_share(context_, capture_.mis_candidates, emitter, pdf, scatter_pdf_);
  }

  void add(Rgb radiance, SourceKind source) {
    const PathLimits& limits = context_.limits;
    Rgb& seen = source == SourceKind::ENVIRONMENT ? record_.environment : record_.emission;
    const Rgb seen_light = throughput_.smooth * radiance;
    seen += state_.depth == 0 ? seen_light : clamp_contribution(seen_light, limits.clamp_direct);
    record_.direct += clamp_contribution(throughput_.direct * radiance, limits.clamp_direct);
    record_.indirect += clamp_contribution(throughput_.indirect * radiance, limits.clamp_indirect);
    add_to_continuations({}, radiance);
    if constexpr (Kind::learns) gather(radiance);
  }

  void add_lamps(const std::optional<Hit>& hit) {
    // Soft lamps turn towards the point they are seen from: the last vertex, not a transparent surface on the way.
    // Like the sky, suns are seen beyond where the camera clips.
    const float t_max = hit ? travelled_ + hit->t : INFINITY, clip = travelled_ + ray_.t_max;
    const Ray segment{vertex_origin_, ray_.direction, travelled_ + ray_.t_min, t_max};
    scratch_.lamp_hits.clear();
    context_.lights.intersect_lamps(segment, state_, scratch_.lamp_hits);
    for (const LampHit& lamp : scratch_.lamp_hits) {
      const bool is_clipped = lamp.distance >= clip && std::isfinite(lamp.distance);
      if (!is_clipped && state_.depth - 1 <= lamp.max_bounces)
        add(lamp.radiance * emitter_weight(lamp.emitter, lamp.pdf), SourceKind::SURFACE);
    }
  }

  void add_surface_emission(const SurfacePoint& point, Rgb emission) {
    const std::optional<uint32_t> emitter = context_.lights.emitter_of(point.instance, point.triangle);
    const float pdf = emitter && mis_receiver_ ? context_.lights.surface_pdf(point, mis_receiver_->position) : 0.0f;
    add(emission * emitter_weight(emitter, pdf), SourceKind::SURFACE);
  }

  void add_environment() {
    if (context_.limits.film_transparent && sees_film_) {
      record_.alpha -= average(throughput_.total());
      return;
    }
    if ((context_.scene.environment.visibility & state_.ray_kind) == 0) return;
    const Rgb radiance = evaluate_environment(context_.scene, ray_.direction, state_);
    if (is_black(radiance)) return;
    if (!features_done_ && state_.depth > 0) record_.albedo = throughput_.smooth * min(radiance, Rgb(1.0f));
    const std::optional<uint32_t> emitter = context_.lights.environment_emitter();
    const float pdf = emitter && mis_receiver_ ? context_.lights.environment_pdf(ray_.direction) : 0.0f;
    add(radiance * emitter_weight(emitter, pdf), SourceKind::ENVIRONMENT);
  }

  // --- next-event estimation --------------------------------------------------------------------------------------

  /// State of the ray towards a light. Of several kinds of scattering the strongest stands for all: a light that tells
  /// diffuse from glossy rays is then seen a little differently by next-event estimation than by scattered rays.
  PathState scattered_state(const Bsdf& bsdf) const {
    PathState next = state_;
    count_scattering(next, strongest_kind(bsdf));
    next.is_singular = false;
    return next;
  }

  void add_light_samples(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
    if constexpr (Kind::learns) {
      if (choose_by_learning(point, bsdf)) return add_learned_light(point, bsdf, p_scatter);
    }
    add_direct_light(point, bsdf, p_scatter);
  }

  void add_direct_light(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
    const VertexUse use = vertex_use();
    const bool leaves_rough = use.light_candidates > 0.0f;
    if (leaves_rough && !has_smooth_lobe(bsdf) && !teaches_directions()) return;
    const double u_choice = sampler_.next_double();
    const Vec2 u_light = sampler_.light_position(state_.depth);
    const auto choice = context_.lights.choose(point.position, light_side(point, bsdf), u_choice, u_light);
    if (!choice) return;
    const auto light = context_.lights.evaluate(choice->sample, point.position, scattered_state(bsdf));
    if (!light) return;
    const BsdfEvaluation f = evaluate_bsdf(bsdf, light->wi, light->visibility);
    const bool keeps_light = use.sample_point_of && !leaves_rough;  // others may reflect what this path does not
    if (is_black(f.total_cos()) && !keeps_light) return;
    const float pdf = choice->pmf * light->pdf;
    float weight = 1.0f;
    if (!light->is_delta && light->use_mis) {
      const float bsdf_pdf = f.pdf * p_scatter;
      weight = leaves_rough
                   ? light_sample_share(context_, use.light_candidates, choice->sample.emitter, light->pdf, bsdf_pdf)
                   : power_heuristic(pdf, bsdf_pdf);
    }
    Rgb radiance = light->radiance * (weight / pdf);
    if (light->casts_shadow) radiance *= transmittance(context_, point, *light, state_);
    if (is_black(radiance)) return;
    if constexpr (Kind::captures) {
      if (keeps_light) keep_incident_light(*light, radiance, f.rough_cos);
    }
    if constexpr (Kind::learns) gather(f.total_cos() * radiance);
    const bool is_environment = choice->sample.emitter == context_.lights.environment_emitter();
    add_reflected_light(leaves_rough ? Rgb() : f.rough_cos, f.smooth_cos, radiance,
                        is_environment ? SourceKind::ENVIRONMENT : SourceKind::SURFACE);
  }

  void keep_incident_light(const IncidentLight& light, Rgb radiance, Rgb f_cos) {
    PathSample& sample = capture_.out->links[static_cast<size_t>(*capture_.vertex.sample_point_of)].to;
    sample.light = {light.wi, radiance, f_cos};
    sample.light_visibility = light.visibility;
  }

  /// Adds what the current vertex reflects of a light sample.
  void add_reflected_light(Rgb rough_cos, Rgb smooth_cos, Rgb radiance, SourceKind source) {
    Rgb& seen = source == SourceKind::ENVIRONMENT ? record_.environment : record_.emission;
    const PathLimits& limits = context_.limits;
    const Rgb total_cos = rough_cos + smooth_cos;
    const bool is_captured = vertex_use().sample_point_of == 0;
    seen += clamp_contribution(throughput_.smooth * smooth_cos * radiance, limits.clamp_direct);
    record_.direct += clamp_contribution(throughput_.smooth * rough_cos * radiance, limits.clamp_direct);
    const Rgb indirect_cos = is_captured ? smooth_cos : total_cos;
    record_.indirect += clamp_contribution((throughput_.direct + throughput_.indirect) * indirect_cos * radiance,
                                           limits.clamp_indirect);
    add_to_continuations(rough_cos * radiance, smooth_cos * radiance);
  }

  // --- the same with learned lights ------------------------------------------------------------------------------

  /// Sets the chooser of the current vertex; false where the light set chooses.
  bool choose_by_learning(const SurfacePoint& point, const Bsdf& bsdf) {
    if (!context_.learned) return false;
    const LearnedLightUse& use = *context_.learned;
    const bool applies = learning_.met_visible_point ? use.at_later_vertices : use.at_visible_point;
    learning_.met_visible_point |= has_rough_lobe(bsdf);
    learning_.at_vertex.reset();
    if (!applies || vertex_use().light_candidates > 0.0f) return false;
    learning_.at_vertex = use.lights->chooser(point.position, light_side(point, bsdf));
    return true;
  }

  /// Like emitter_weight, against `candidates` samples of the chooser of the vertex that scattered the ray.
  float learned_emitter_weight(uint32_t emitter, float pdf) const {
    const LearnedLights::Chooser& chooser = *learning_.of_ray;
    const float pmf = context_.learned->lights->pmf(chooser, emitter);
    return power_heuristic(scatter_pdf_, static_cast<float>(chooser.candidates) * pmf * pdf);
  }

  /// Next-event estimation with the light sample that learned lights offer.
  void add_learned_light(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
    const LearnedLightVertex vertex{point, bsdf, scattered_state(bsdf), p_scatter,
                                    vertex_use().sample_point_of.has_value()};
    const Vec2 u_light = sampler_.light_position(state_.depth);
    const auto sample = sample_learned_light(context_, *learning_.at_vertex, vertex, u_light, sampler_);
    if (!sample) return;
    Rgb radiance = sample->unshadowed;
    if (sample->light.casts_shadow) radiance *= transmittance(context_, point, sample->light, state_);
    if (scratch_.trains_lights) {
      const auto record = light_record(context_, *learning_.at_vertex, vertex, *sample, radiance, throughput_.total());
      if (record) scratch_.light_records.push_back(*record);
    }
    if (is_black(radiance)) return;
    if constexpr (Kind::captures) {
      if (vertex.keeps_light) keep_incident_light(sample->light, radiance, sample->f.rough_cos);
    }
    gather(sample->f.total_cos() * radiance);
    const bool is_environment = sample->emitter == context_.lights.environment_emitter();
    add_reflected_light(sample->f.rough_cos, sample->f.smooth_cos, radiance,
                        is_environment ? SourceKind::ENVIRONMENT : SourceKind::SURFACE);
  }

  // --- what directions bring -------------------------------------------------------------------------------------

  bool teaches_directions() const {
    if constexpr (Kind::learns) return scratch_.trains_guide;
    return false;
  }

  void gather(Rgb radiance) {
    if (scratch_.trains_guide) learning_.gathered += luminance(throughput_.total() * radiance);
  }

  // --- continuing ---------------------------------------------------------------------------------------------------

  bool continue_path(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
    if (p_scatter < 1.0f && sampler_.next_float() >= p_scatter) return pass_through(point, bsdf, 1.0f - p_scatter);
    if (last_segment_ || !bsdf.scatters()) return false;
    return scatter(point, bsdf, p_scatter);
  }

  /// After an event that the path took with `probability`.
  void scale_by_chance(Rgb weight, float probability) {
    throughput_.scale(weight * (1.0f / probability));
    if constexpr (Kind::captures) capture_.link_probability *= probability;
  }

  bool pass_through(const SurfacePoint& point, const Bsdf& bsdf, float probability) {
    const int most_surfaces = context_.limits.max_transparent_bounces;
    if (state_.transparent_depth >= most_surfaces) return false;
    last_segment_ |= ++state_.transparent_depth == most_surfaces;
    scale_by_chance(bsdf.transparency, probability);
    ray_.t_max -= state_.ray_length - travelled_;  // clipping stays measured from the last vertex
    ray_.t_min = 0.0f;
    travelled_ = state_.ray_length;
    ray_.origin = offset_origin(point.position, point.ng, ray_.direction);
    return survives_roulette();
  }

  bool scatter(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
    const float u_lobe = sampler_.next_float();
    const std::optional<BsdfSample> sample = sample_bsdf(bsdf, u_lobe, sampler_.bsdf_direction(state_.depth));
    if (!sample) return false;
    if constexpr (Kind::learns) {
      if (scratch_.trains_guide)
        remember_direction(context_, point, bsdf, *sample, throughput_.total(), learning_.gathered, scratch_);
    }
    const Rgb rough_weight = sample->rough_weight * (1.0f / p_scatter);
    const Rgb smooth_weight = sample->smooth_weight * (1.0f / p_scatter);
    if constexpr (Kind::captures) {
      throughput_.scatter(rough_weight, smooth_weight, capture_.vertex.sample_point_of == 0, is_left_deep());
    } else {
      throughput_.scatter(rough_weight, smooth_weight);
    }
    if (is_black(throughput_.total())) return false;
    if constexpr (Kind::captures) {
      leave_captured_vertex(*sample, p_scatter);
      if (capture_.vertex.sample_point_of == 0 && !goes_on_from_sample_point()) return false;
    }
    if constexpr (Kind::learns) learning_.guide_gain *= sample->guide_gain;
    count_bounce(*sample);
    sees_film_ &= context_.limits.film_transparent_glass && sample->is_clear;
    if constexpr (Kind::learns) learning_.of_ray = learning_.at_vertex;
    if (sample->is_delta) {
      mis_receiver_.reset();
    } else {
      MisReceiver& receiver = mis_receiver_.emplace();  // in place: a copy would wait for the stores it reads
      receiver.position = point.position;
      receiver.normal = light_side(point, bsdf);
      scatter_pdf_ = sample->pdf * p_scatter;
      if constexpr (Kind::captures) capture_.mis_candidates = capture_.vertex.light_candidates;
    }
    ray_.origin = vertex_origin_ = offset_origin(point.position, point.ng, sample->wi);
    ray_.direction = sample->wi;
    ray_.t_min = 0.0f;
    ray_.t_max = INFINITY;
    travelled_ = 0.0f;
    return survives_roulette();
  }

  void leave_captured_vertex(const BsdfSample& sample, float p_scatter) {
    const float pdf = context_.tells_kinds ? sample.kind_pdf : sample.pdf;
    const bool by_rough_lobes = !is_black(sample.rough_weight);
    if (capture_.vertex.sample_point_of && by_rough_lobes) {
      const auto link = static_cast<size_t>(*capture_.vertex.sample_point_of);
      const FoundKind kind = found_kind(ray_kind(sample.kind));
      capture_.out->links[link].to.continuation = {sample.wi, {}, sample.rough_weight * pdf, kind};
      throughput_.continuation[link] = Rgb(1.0f / (pdf * p_scatter));
    }
    capture_.open_link = by_rough_lobes ? capture_.vertex.starts : std::nullopt;
    capture_.link_probability = pdf * p_scatter;
  }

  bool goes_on_from_sample_point() {
    if (!capture_.out->goes_on) return false;
    if (capture_.out->going_on_probability < 1.0f) scale_by_chance(Rgb(1.0f), capture_.out->going_on_probability);
    return true;
  }

  void count_bounce(const BsdfSample& sample) {
    count_scattering(state_, sample.kind);
    state_.is_singular = sample.is_delta;
    last_segment_ = exceeds_limits(state_, context_.limits);
    if constexpr (Kind::captures) {
      if (last_segment_ && !capture_.out->leaves_deep_link && continues_deep_link()) extend_deep_link();
    }
  }

  /// Of a path that has ended but for its second link: whether that goes on.
  void extend_deep_link() {
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

  /// Whether the second link is under way, towards its sample point or beyond.
  bool continues_deep_link() const { return capture_.open_link == 1 || !is_black(throughput_.continuation[1]); }

  bool survives_roulette() {
    if (state_.depth <= context_.limits.min_bounces) return true;
    float p = max_component(throughput_.total());
    if constexpr (Kind::learns) p *= learning_.guide_gain;
    p = std::min(p, 1.0f);
    if (p >= 1.0f) return true;
    if (sampler_.next_float() >= p) return false;
    scale_by_chance(Rgb(1.0f), p);
    return true;
  }

  const PathContext& context_;
  Ray ray_;
  PathSampler& sampler_;
  PathScratch& scratch_;
  [[no_unique_address]] std::conditional_t<Kind::captures, CaptureState, std::monostate> capture_;
  [[no_unique_address]] std::conditional_t<Kind::learns, LearningState, std::monostate> learning_;
  PathState state_;
  PathRecord record_;
  std::conditional_t<Kind::captures, CapturedThroughput, Throughput> throughput_;
  std::optional<MisReceiver>
      mis_receiver_;          // last vertex that next-event estimation could have lit; none after a delta lobe
  float scatter_pdf_ = 0.0f;  // of the current direction, per solid angle
  float path_length_ = 0.0f;
  Vec3 vertex_origin_;         // where the ray left the last vertex: transparent surfaces are no vertices
  float travelled_ = 0.0f;     // from there to the ray's origin
  bool last_segment_ = false;  // a bounce limit is reached: only light met directly still counts
  bool features_done_ = false;
  bool sees_film_ = true;  // the film may be transparent for this ray: from the camera, or through clear glass
};

}  // namespace cistern
