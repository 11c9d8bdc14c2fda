#pragma once

#include "transport/path_walk.h"

// Light that a walk finds: what it meets, and next-event estimation. Included by path_walk.h.

namespace cistern {

template <class Kind>
inline float Walk<Kind>::emitter_weight(std::optional<uint32_t> emitter, float pdf) const {
  if (!emitter || !mis_receiver_) return 1.0f;
  if constexpr (Kind::captures) {
    if (capture_.mis_candidates > 0.0f) return captured_emitter_weight(*emitter, pdf);
  }
  if constexpr (Kind::learns) {
    if (learning_.of_ray) return learned_emitter_weight(*emitter, pdf);
  }
  const float pmf = context_.lights.pmf(*emitter, mis_receiver_->position, mis_receiver_->normal, state_.light_set);
  return power_heuristic(scatter_pdf_, static_cast<float>(mis_receiver_->light_samples) * pmf * pdf);
}

template <class Kind>
inline float Walk<Kind>::sought_pdf(const LampHit& lamp) const {
  if (panes_.faces == 0) return lamp.pdf;
  const Ray& begin = panes_.begin;
  if (!is_parallel(begin.direction, ray_.direction)) return 0.0f;
  if (!may_pass_faces(panes_.vertex, panes_.faces, context_.limits)) return 0.0f;
  if (std::isinf(lamp.distance)) return context_.accel.occluded_but_for_panes(begin) ? 0.0f : lamp.pdf;
  const std::optional<LampHit> aim = context_.lights.intersect_lamp(lamp.emitter, begin, state_);
  if (!aim || is_black(aim->radiance)) return 0.0f;
  IncidentLight straight;
  straight.wi = begin.direction;
  straight.distance = aim->distance;
  return is_behind_panes(context_, begin.origin, straight) ? aim->pdf : 0.0f;
}

template <class Kind>
inline float Walk<Kind>::sought_pdf(const SurfacePoint& point, uint32_t emitter) const {
  if (!mis_receiver_) return 0.0f;
  if (panes_.faces == 0) return context_.lights.surface_pdf(point, mis_receiver_->position);
  const Ray& begin = panes_.begin;
  if (!is_parallel(begin.direction, ray_.direction)) return 0.0f;
  if (!may_pass_faces(panes_.vertex, panes_.faces, context_.limits)) return 0.0f;
  const RayCone cone{point.footprint, context_.pixel.angle};
  const auto aim =
      context_.lights.evaluate_along(emitter, begin.direction, mis_receiver_->position, state_, cone, &context_.accel);
  return aim && is_behind_panes(context_, begin.origin, *aim) ? aim->pdf : 0.0f;
}

template <class Kind>
inline float Walk<Kind>::sought_environment_pdf() const {
  if (!mis_receiver_) return 0.0f;
  if (panes_.faces == 0) return context_.lights.environment_pdf(ray_.direction, mis_receiver_->position);
  const Ray& begin = panes_.begin;
  if (!may_pass_faces(panes_.vertex, panes_.faces, context_.limits)) return 0.0f;
  // No light sample is taken where the sky is black.
  const bool has_turned = !is_parallel(begin.direction, ray_.direction);
  if (has_turned && is_black(evaluate_environment(context_.scene, begin.direction, state_))) return 0.0f;
  if (context_.accel.occluded_but_for_panes(begin)) return 0.0f;
  return context_.lights.environment_pdf(begin.direction, mis_receiver_->position);
}

template <class Kind>
inline float Walk<Kind>::captured_emitter_weight(uint32_t emitter, float pdf) const {
  const Vec3 side = mis_receiver_->normal;  // reservoirs know nothing of what comes from behind it
  if (side != Vec3{} && !(dot(side, ray_.direction) > 0.0f)) return 1.0f;
  return 1.0f - light_sample_share(context_, capture_.mis_candidates, emitter, pdf, scatter_pdf_);
}

template <class Kind>
inline void Walk<Kind>::add(Rgb radiance, const LightSource& source) {
  const float limit = context_.limits.clamp_after(state_.depth);
  const Rgb seen = tinted(clamp_contribution(throughput_.smooth * radiance, limit));
  const Rgb direct = tinted(clamp_contribution(throughput_.direct * radiance, limit));
  const Rgb indirect = tinted(clamp_contribution(throughput_.indirect * radiance, limit));
  (source.kind == SourceKind::ENVIRONMENT ? record_.environment : record_.emission) += seen;
  record_.direct += direct;
  record_.indirect += indirect;
  if constexpr (Kind::splits) {
    split_met_light(radiance, source.kind);
    add_to_group_of(source, seen + direct + indirect);
  }
  add_to_continuations({}, radiance, source.group);
  if constexpr (Kind::learns) gather(radiance);
}

template <class Kind>
inline void Walk<Kind>::add_lamps(const std::optional<Hit>& hit) {
  // Soft lamps turn towards the point they are seen from: the last vertex, not a transparent surface on the way.
  // Like the sky, suns are seen beyond where the camera clips.
  const float t_max = hit ? travelled_ + hit->t : INFINITY, clip = travelled_ + ray_.t_max;
  // Rays that compete with light samples meet lamps without shadows as those do, wherever surfaces are: on their first
  // segment, all the way.
  const bool passes_surfaces = mis_receiver_ && context_.lights.has_visible_lamps_without_shadow();
  const Ray segment{vertex_origin_, ray_.direction, travelled_ + segment_begin(), passes_surfaces ? INFINITY : t_max};
  scratch_.lamp_hits.clear();
  context_.lights.intersect_lamps(segment, state_, scratch_.lamp_hits);
  for (const LampHit& lamp : scratch_.lamp_hits) {
    const bool is_clipped = lamp.distance >= clip && std::isfinite(lamp.distance);
    const bool is_elsewhere =
        passes_surfaces && (lamp.casts_shadow ? hit && lamp.distance >= t_max : travelled_ > 0.0f);
    if (is_met_past_blockers(lamp.blockers)) continue;
    if (!is_clipped && !is_elsewhere && state_.depth - 1 <= lamp.max_bounces) {
      Rgb radiance = lamp.radiance * emitter_weight(lamp.emitter, sought_pdf(lamp));
      // Light samples of lamps without shadows are dimmed by nothing either.
      if (Kind::has_media && !(passes_surfaces && !lamp.casts_shadow))
        radiance *= segment_transmittance(lamp.distance - travelled_);
      add(radiance, source_of(lamp.emitter));
    }
  }
}

template <class Kind>
inline void Walk<Kind>::add_surface_emission(const SurfacePoint& point, Rgb emission) {
  const Instance& instance = context_.scene.instances[point.instance];
  const LightLinks& links = instance.links;
  if (!has_set(links.lit, state_.light_set) || is_met_past_blockers(links.blockers)) return;
  const std::optional<uint32_t> emitter = context_.lights.emitter_of(point.instance, point.triangle);
  const float pdf = emitter ? sought_pdf(point, *emitter) : 0.0f;
  add(emission * emitter_weight(emitter, pdf), source_of(instance));
}

template <class Kind>
inline void Walk<Kind>::add_past_blockers() {
  PathState receiver = state_;
  --receiver.depth;
  if (context_.lights.has_visible_lamps()) add_lamps_past_blockers(receiver);
  add_surfaces_past_blockers(receiver);
}

template <class Kind>
inline void Walk<Kind>::add_lamps_past_blockers(PathState receiver) {
  scratch_.lamp_hits.clear();
  context_.lights.intersect_lamps({vertex_origin_, ray_.direction}, state_, scratch_.lamp_hits);
  for (const LampHit& lamp : scratch_.lamp_hits) {
    if (lamp.blockers == kAllSets || receiver.depth > lamp.max_bounces) continue;
    Rgb radiance = lamp.radiance * emitter_weight(lamp.emitter, lamp.pdf);
    if (is_black(radiance)) continue;
    IncidentLight light;
    light.wi = ray_.direction;
    light.distance = lamp.distance;
    light.blockers = lamp.blockers;
    if (lamp.casts_shadow) radiance *= transmittance_ahead(light, receiver);
    add(radiance, source_of(lamp.emitter));
  }
}

template <class Kind>
inline void Walk<Kind>::add_surfaces_past_blockers(PathState receiver) {
  Ray ray{vertex_origin_, ray_.direction, 0.0f, INFINITY, ray_.leaves};
  PathState arriving = state_;
  for (int i = 0; i < kMostEmittersAhead; ++i) {
    const std::optional<Hit> hit = context_.accel.intersect_shadow_linked(ray, state_.ray_kind);
    if (!hit) return;
    ray.t_min = std::nextafter(hit->t, INFINITY);
    const Instance& instance = context_.scene.instances[hit->instance];
    const LightLinks& links = instance.links;
    if (!has_set(links.lit, state_.light_set)) continue;
    SurfacePoint point = make_surface_point(context_.scene, ray, *hit);
    point.footprint = context_.pixel.size + context_.pixel.angle * (path_length_ + hit->t);
    arriving.ray_length = hit->t;
    const Rgb emission = evaluate_emission(context_.scene, point, arriving, &context_.accel);
    if (is_black(emission)) continue;
    const std::optional<uint32_t> emitter = context_.lights.emitter_of(point.instance, point.triangle);
    const float pdf = emitter && mis_receiver_ ? context_.lights.surface_pdf(point, mis_receiver_->position) : 0.0f;
    IncidentLight light;
    light.wi = ray_.direction;
    light.distance = hit->t;
    light.normal = point.ng;
    light.clearance = point.clearance;
    light.blockers = links.blockers;
    add(emission * emitter_weight(emitter, pdf) * transmittance_ahead(light, receiver), source_of(instance));
  }
}

template <class Kind>
inline Rgb Walk<Kind>::transmittance_ahead(const IncidentLight& light, const PathState& receiver) const {
  const float footprint = context_.pixel.size + context_.pixel.angle * path_length_;
  if constexpr (Kind::has_media) {
    return transmittance(context_, vertex_origin_, ray_.leaves, footprint, light, receiver, media_.stack, sampler_);
  } else {
    return transmittance(context_, vertex_origin_, ray_.leaves, footprint, light, receiver);
  }
}

template <class Kind>
inline void Walk<Kind>::add_environment() {
  if (context_.limits.film_transparent && sees_film_) {
    record_.alpha -= average(throughput_.total());
    if constexpr (Kind::splits) {
      split_environment_behind_film();
      add_environment_behind_film_to_group();
    }
    return;
  }
  if ((context_.scene.environment.visibility & state_.ray_kind) == 0) return;
  if (context_.record_seen && sees_film_) see_environment();
  const std::optional<uint32_t> emitter = context_.lights.environment_emitter();
  // Asked for first: it comes from far away in memory, and is needed last.
  const float pdf = emitter ? sought_environment_pdf() : 0.0f;
  const Rgb radiance = evaluate_environment(context_.scene, ray_.direction, state_);
  if (is_black(radiance)) return;
  if (!features_done_ && state_.depth > 0) record_.albedo = throughput_.smooth * min(radiance, Rgb(1.0f));
  add(radiance * emitter_weight(emitter, pdf), {SourceKind::ENVIRONMENT, context_.scene.environment.light_group});
}

template <class Kind>
inline PathState Walk<Kind>::scattered_state(const SurfacePoint& point, const Bsdf& bsdf) const {
  PathState next = state_;
  count_scattering(next, strongest_kind(bsdf));
  next.is_singular = false;
  next.set_receiver(light_set_of(point));
  return next;
}

template <class Kind>
inline void Walk<Kind>::add_light_samples(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
  if constexpr (Kind::learns) {
    if (choose_by_learning(point, bsdf)) return add_learned_light(point, bsdf, p_scatter);
  }
  const int count = light_samples_taken_ = light_samples();
  for (int i = 0; i < count; ++i) add_direct_light(point, bsdf, p_scatter, i);
}

template <class Kind>
inline int Walk<Kind>::light_samples() const {
  return state_.depth == 0 ? context_.light_samples : 1;
}

template <class Kind>
inline void Walk<Kind>::add_direct_light(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter, int index) {
  const VertexUse use = vertex_use();
  const bool leaves_rough = use.light_candidates > 0.0f;
  if (leaves_rough && !has_smooth_lobe(bsdf) && !teaches_directions()) return;
  const auto count = static_cast<uint32_t>(light_samples());
  const auto [u_choice, u_light] = sampler_.light(state_.depth, static_cast<uint32_t>(index), count);
  const PathState scattered = scattered_state(point, bsdf);
  const auto choice =
      context_.lights.choose(point.position, light_side(point, bsdf), u_choice, u_light, scattered.light_set);
  if (!choice) return;
  const RayCone cone{point.footprint, context_.pixel.angle};
  // Of what panes turn aside another part of the sky arrives.
  const SkyRadiance sky = context_.passes_panes ? SkyRadiance::NOW : SkyRadiance::LATER;
  const auto light = context_.lights.evaluate(choice->sample, point.position, scattered, cone, &context_.accel, sky);
  if (!light) return;
  const BsdfEvaluation f = evaluate_bsdf(bsdf, light->wi, light->visibility);
  const bool keeps_light = use.sample_point_of && !leaves_rough;  // others may reflect what this path does not
  if (is_black(f.total_cos()) && !keeps_light) return;
  const float pdf = static_cast<float>(count) * choice->pmf * light->pdf;  // of any of the samples
  float weight = 1.0f;
  if (!light->is_delta && light->use_mis) {
    const float bsdf_pdf = f.pdf * p_scatter;
    weight = leaves_rough
                 ? light_sample_share(context_, use.light_candidates, choice->sample.emitter, light->pdf, bsdf_pdf)
                 : power_heuristic(pdf, bsdf_pdf);
  }
  PassedLight passed = passed_light_to(point, *light);
  if (is_black(passed.radiance)) return;
  if (light->awaits_radiance) passed.radiance *= evaluate_environment(context_.scene, light->wi, scattered);
  const Rgb radiance = passed.radiance * (weight / pdf);
  if (is_black(radiance)) return;
  const LightSource source = source_of(choice->sample.emitter);
  if constexpr (Kind::captures) {
    if (keeps_light) keep_incident_light(*light, radiance, f, source);
  }
  if constexpr (Kind::learns) gather(f.total_cos() * radiance);
  if constexpr (Kind::splits) {
    if (context_.splits_kinds)
      split_reflected_light(evaluate_kinds(bsdf, light->wi, light->visibility), leaves_rough ? Rgb() : f.rough_cos,
                            f.smooth_cos, radiance, passed.faces);
  }
  add_reflected_light(leaves_rough ? Rgb() : f.rough_cos, f.smooth_cos, radiance, source, passed.faces);
}

template <class Kind>
inline void Walk<Kind>::keep_incident_light(const IncidentLight& light, Rgb radiance, const BsdfEvaluation& f,
                                            const LightSource& source) {
  PathSample& sample = capture_.out->links[static_cast<size_t>(*capture_.vertex.sample_point_of)].to;
  sample.light = {light.wi, radiance, f.rough_cos, f.even_cos};
  sample.light_visibility = light.visibility;
  sample.light_group = source.group;
}

template <class Kind>
inline float Walk<Kind>::clamp_of_reflected(int faces) const {
  const float limit = context_.limits.clamp_after(state_.depth + 1 + (faces > 0 ? 1 : 0));
  return limit / static_cast<float>(light_samples_taken_);
}

template <class Kind>
inline void Walk<Kind>::add_reflected_light(Rgb rough_cos, Rgb smooth_cos, Rgb radiance, const LightSource& source,
                                            int faces) {
  const Rgb total_cos = rough_cos + smooth_cos;
  const float limit = clamp_of_reflected(faces);
  const bool is_captured = vertex_use().sample_point_of == 0;
  const Rgb once = throughput_.smooth * rough_cos;
  const Rgb again = (throughput_.direct + throughput_.indirect) * (is_captured ? smooth_cos : total_cos);
  const Rgb seen = tinted(clamp_contribution(throughput_.smooth * smooth_cos * radiance, limit));
  const Rgb direct = faces > 0 ? Rgb() : tinted(clamp_contribution(once * radiance, limit));
  const Rgb indirect = tinted(clamp_contribution((faces > 0 ? once + again : again) * radiance, limit));
  (source.kind == SourceKind::ENVIRONMENT ? record_.environment : record_.emission) += seen;
  record_.direct += direct;
  record_.indirect += indirect;
  if constexpr (Kind::splits) add_to_group_of(source, seen + direct + indirect);
  add_to_continuations(rough_cos * radiance, smooth_cos * radiance, source.group);
}

template <class Kind>
inline bool Walk<Kind>::choose_by_learning(const SurfacePoint& point, const Bsdf& bsdf) {
  if (!context_.learned) return false;
  const LearnedLightUse& use = *context_.learned;
  const bool applies = learning_.met_visible_point ? use.at_later_vertices : use.at_visible_point;
  learning_.met_visible_point |= has_rough_lobe(bsdf);
  learning_.at_vertex.reset();
  if (!applies || vertex_use().light_candidates > 0.0f) return false;
  learning_.at_vertex = use.lights->chooser(point.position, light_side(point, bsdf), light_set_of(point));
  return true;
}

template <class Kind>
inline float Walk<Kind>::learned_emitter_weight(uint32_t emitter, float pdf) const {
  const LearnedLights::Chooser& chooser = *learning_.of_ray;
  const float pmf = context_.learned->lights->pmf(chooser, emitter);
  return power_heuristic(scatter_pdf_, static_cast<float>(chooser.candidates) * pmf * pdf);
}

template <class Kind>
inline void Walk<Kind>::add_learned_light(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter) {
  const LearnedLightVertex vertex{point, bsdf, scattered_state(point, bsdf), p_scatter,
                                  vertex_use().sample_point_of.has_value()};
  light_samples_taken_ = 1;
  const auto [u_choice, u_light] = sampler_.light(state_.depth);
  const auto sample = sample_learned_light(context_, *learning_.at_vertex, vertex, u_choice, u_light, sampler_);
  if (!sample) return;
  const PassedLight passed = passed_light_to(point, sample->light);
  const Rgb radiance = passed.radiance * sample->weight;
  if (scratch_.trains_lights) {
    const auto record = light_record(context_, *learning_.at_vertex, vertex, *sample, radiance, throughput_.total());
    if (record) scratch_.light_records.push_back(*record);
  }
  if (is_black(radiance)) return;
  const LightSource source = source_of(sample->emitter);
  if constexpr (Kind::captures) {
    if (vertex.keeps_light) keep_incident_light(sample->light, radiance, sample->f, source);
  }
  gather(sample->f.total_cos() * radiance);
  if constexpr (Kind::splits) {
    if (context_.splits_kinds)
      split_reflected_light(evaluate_kinds(bsdf, sample->light.wi, sample->light.visibility), sample->f.rough_cos,
                            sample->f.smooth_cos, radiance, passed.faces);
  }
  add_reflected_light(sample->f.rough_cos, sample->f.smooth_cos, radiance, source, passed.faces);
}

template <class Kind>
inline bool Walk<Kind>::teaches_directions() const {
  if constexpr (Kind::learns) return scratch_.trains_guide;
  return false;
}

template <class Kind>
inline void Walk<Kind>::gather(Rgb radiance) {
  if (scratch_.trains_guide) learning_.gathered += magnitude(throughput_.total() * radiance);
}

}  // namespace cistern
