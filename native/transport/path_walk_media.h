#pragma once

#include "shading/phase.h"
#include "transport/free_flight.h"
#include "transport/path_walk.h"

// A walk in participating media. Included by path_walk.h.
//
// Each segment of the path gathers, before anything is left to chance, what the medium emits along it and lamps that it
// passes, dimmed by the transmittance up to them; then light that reaches the path from one light sample for one point
// of the segment. A free flight decides whether the medium scatters the path or it goes on to the surface; of media
// that only absorb the transmittance is no matter of chance. Light that was scattered once, by a medium or by a
// surface, is direct, as the phase function is rough.

namespace cistern {

template <class Kind>
inline void Walk<Kind>::enter_segment(const std::optional<Hit>& hit) {
  media_.begin = segment_begin();
  media_.length = hit ? std::max(hit->t - media_.begin, 0.0f) : INFINITY;
  media_.segment = context_.media->together(media_.stack, state_, ray_.direction, !hit);
  if (!media_.segment.may_shine || !context_.media->shine_on(media_.stack, state_.light_set)) return;
  const LightSource source{SourceKind::SURFACE, context_.media->light_group(media_.stack)};
  if (media_.segment.varies())
    add(estimate_radiance(uneven_ray(), media_.length, sampler_), source);
  else
    add(medium_radiance(media_.segment.even, media_.length), source);
}

template <class Kind>
inline UnevenRay Walk<Kind>::uneven_ray() const {
  return {*context_.media, media_.segment, state_, ray_.origin + media_.begin * ray_.direction, ray_.direction};
}

template <class Kind>
inline Rgb Walk<Kind>::segment_transmittance(float distance) const {
  if constexpr (Kind::has_media) {
    const float length = std::clamp(distance - media_.begin, 0.0f, media_.length);
    if (media_.segment.varies()) return estimate_transmittance(uneven_ray(), length, sampler_);
    return medium_transmittance(media_.segment.even, length);
  } else {
    return Rgb(1.0f);
  }
}

template <class Kind>
inline void Walk<Kind>::pass_medium(Rgb weight) {
  scale_by_chance(weight, 1.0f);
  media_.clear *= weight;
}

template <class Kind>
inline std::optional<bool> Walk<Kind>::traverse_medium() {
  if (!(media_.length > 0.0f)) return std::nullopt;
  if (media_.segment.varies()) return traverse_uneven_medium();
  const Medium& medium = media_.segment.even;
  if (is_black(medium.extinction)) return std::nullopt;
  const FreeFlight flight(medium, throughput_.total(), media_.length);
  if (last_segment_ || !flight.can_scatter()) {
    pass_medium(medium_transmittance(medium, media_.length));
    if (is_black(throughput_.total())) return false;
    return std::nullopt;
  }
  add_light_in_medium();
  PathSampler::FlightNumbers u{};
  if (media_.has_flown) {
    u.channel = sampler_.next_float();
    u.distance = sampler_.next_float();
  } else {
    u = sampler_.first_flight();
  }
  media_.has_flown = true;
  const FreeFlight::Sample sample = flight.sample(u.channel, u.distance);
  if (sample.distance) record_surface_behind();
  sample.distance ? scale_by_chance(sample.weight, 1.0f) : pass_medium(sample.weight);
  if (is_black(throughput_.total())) return false;
  if (!sample.distance) return std::nullopt;
  return scatter_in_medium(medium, *sample.distance);
}

template <class Kind>
inline std::optional<bool> Walk<Kind>::traverse_uneven_medium() {
  const UnevenRay ray = uneven_ray();
  if (last_segment_) {
    pass_medium(estimate_transmittance(ray, media_.length, sampler_));
    if (is_black(throughput_.total())) return false;
    return std::nullopt;
  }
  add_light_in_medium();
  const UnevenFlight flight = sample_flight(ray, throughput_.total(), media_.length, sampler_);
  if (flight.distance) record_surface_behind();
  flight.distance ? scale_by_chance(flight.weight, 1.0f) : pass_medium(flight.weight);
  if (is_black(throughput_.total())) return false;
  if (!flight.distance) return std::nullopt;
  return scatter_in_medium(flight.medium, *flight.distance);
}

/// One sample of a mixture of two techniques, either half the time: a distance as light is scattered, and a light
/// chosen for the point there; or a light chosen for no point in particular, and a distance by how near the ray comes
/// to it.
template <class Kind>
inline void Walk<Kind>::add_light_in_medium() {
  if (context_.media->emitters().is_empty()) return;
  if (media_.segment.varies()) {
    const UnevenRay ray = uneven_ray();
    const UnevenDistances distances(ray, media_.length);
    return add_light_in_medium([&](float, float u) { return distances.sample(u); },
                               [&](float distance) { return distances.pdf(distance); });
  }
  const FreeFlight flight(media_.segment.even, throughput_.total(), media_.length);
  if (!flight.can_scatter()) return;
  add_light_in_medium([&](float u_channel, float u) { return flight.sample_inside(u_channel, u); },
                      [&](float distance) { return flight.pdf_inside(distance); });
}

/// `sample_inside` and `pdf_inside`: of a distance as light is scattered.
template <class Kind>
template <class Sample, class Pdf>
inline void Walk<Kind>::add_light_in_medium(const Sample& sample_inside, const Pdf& pdf_inside) {
  light_samples_taken_ = 1;
  const bool varies = media_.segment.varies();
  const Vec3 origin = ray_.origin + media_.begin * ray_.direction;
  const auto [u_choice, u_light] = sampler_.light(state_.depth);
  const auto [u_technique, u_channel, u_distance] = sampler_.light_in_medium(state_.depth);
  LightSample light_sample{0, u_light};
  const uint8_t light_set = context_.media->light_set(media_.stack);
  float distance = 0.0f;
  const auto towards = [&](uint32_t emitter) -> std::optional<EquiAngular> {
    const EmitterPlace place = context_.lights.place(emitter);
    if (place.is_distant) return std::nullopt;
    const std::optional<LitPart> lit = context_.lights.lit_part_of(emitter, origin, ray_.direction, media_.length);
    if (!lit) return EquiAngular(origin, ray_.direction, 0.0f, 0.0f, place.center);
    if (EquiAngular::is_far(origin, lit->begin, lit->end, place.center)) return std::nullopt;
    return EquiAngular(origin, ray_.direction, lit->begin, lit->end, place.center);
  };
  if (u_technique < 0.5f) {
    distance = sample_inside(u_channel, u_distance);
    const auto choice = context_.lights.choose(origin + distance * ray_.direction, {}, u_choice, u_light, light_set);
    if (!choice) return;
    light_sample = choice->sample;
  } else {
    light_sample.emitter = context_.media->emitters().sample(u_choice);
    const std::optional<EquiAngular> near = towards(light_sample.emitter);
    distance = near ? near->sample(u_distance) : sample_inside(u_channel, u_distance);
    if (near && !(near->pdf(distance) > 0.0f)) return;  // no angle is left: the other technique finds it all
  }
  const Vec3 position = origin + distance * ray_.direction;
  const float pmf = context_.lights.pmf(light_sample.emitter, position, {}, light_set);
  const std::optional<EquiAngular> near = towards(light_sample.emitter);
  const float pdf_flight = pdf_inside(distance);
  const float pdf_near = near ? near->pdf(distance) : pdf_flight;
  const float free_pmf = context_.media->emitters().pmf(light_sample.emitter);
  const float density = 0.5f * (pmf * pdf_flight + free_pmf * pdf_near);
  if (!(density > 0.0f) || !std::isfinite(density)) return;

  PathState scattered = state_;
  ++scattered.depth;
  scattered.ray_kind = kVisibleToVolume;
  scattered.is_singular = false;
  scattered.set_receiver(light_set);
  const float footprint = context_.pixel.size + context_.pixel.angle * (path_length_ + media_.begin + distance);
  const auto light =
      context_.lights.evaluate(light_sample, position, scattered, {footprint, context_.pixel.angle}, &context_.accel);
  if (!light || !(light->visibility & kVisibleToVolume)) return;
  const Medium medium =
      varies ? context_.media->at(media_.segment, state_, ray_.direction, position) : media_.segment.even;
  if (!medium.scatters()) return;
  const float phase = evaluate_phase(medium, dot(ray_.direction, light->wi));
  const bool has_rival = !light->is_delta && light->use_mis;
  const float weight = has_rival ? power_heuristic(pmf * light->pdf, phase) : 1.0f;
  Rgb radiance = light->radiance * (weight / (density * light->pdf));
  if (light->casts_shadow)
    radiance *= transmittance(context_, position, kNoTriangle, footprint, *light, state_, media_.stack, sampler_);
  if (is_black(radiance)) return;
  const Rgb passed =
      varies ? estimate_transmittance(uneven_ray(), distance, sampler_) : medium_transmittance(medium, distance);
  if constexpr (Kind::splits) split_scattered_light(passed * medium.scattering * phase, radiance);
  add_reflected_light(passed * medium.scattering * phase, {}, radiance, source_of(light_sample.emitter));
}

template <class Kind>
inline bool Walk<Kind>::scatter_in_medium(const Medium& medium, float distance) {
  if (!survives_roulette()) return false;
  const auto [u_lobe, u_direction] = sampler_.scattering(state_.depth);
  const PhaseSample sample = sample_phase(medium, ray_.direction, u_lobe, u_direction);
  if (!features_done_) {  // of a fog, the denoiser is told no more than its colour
    features_done_ = true;
    record_.albedo = min(throughput_.smooth, Rgb(1.0f));
  }
  if constexpr (Kind::splits) scatter_kinds_in_medium();
  throughput_.scatter(Rgb(1.0f), {});
  const Vec3 position = ray_.origin + (media_.begin + distance) * ray_.direction;
  path_length_ += media_.begin + distance;
  ++state_.depth;
  state_.ray_kind = kVisibleToVolume;
  state_.is_singular = false;
  limit_gloss(sample.pdf);
  state_.set_receiver(context_.media->light_set(media_.stack));
  ++media_.volume_depth;
  last_segment_ = exceeds_limits(state_, context_.limits) || media_.volume_depth > context_.limits.max_volume_bounces;
  sees_film_ = false;
  MisReceiver& receiver = mis_receiver_.emplace();
  receiver.position = position;
  receiver.normal = {};
  receiver.light_samples = 1;
  scatter_pdf_ = sample.pdf;
  ray_ = {position, sample.direction};
  media_.trail.clear();
  vertex_origin_ = position;
  travelled_ = 0.0f;
  return true;
}

template <class Kind>
inline void Walk<Kind>::record_surface_behind() {
  if (!context_.record_surfaces || record_.hit || state_.depth > 0) return;
  Ray ray = ray_;
  PathState state = state_;
  float length = path_length_;
  std::optional<Hit> hit = context_.accel.intersect_surface(ray, state.ray_kind);
  for (int passed = 0; hit && passed <= kMostBoundaries; ++passed) {
    length += hit->t;
    state.ray_length = length;
    SurfacePoint point = make_surface_point(context_.scene, ray, *hit);
    set_footprint(point, context_.pixel.size + context_.pixel.angle * length, context_.scene, state);
    const Bsdf bsdf = evaluate_material(context_.scene, point, state, &context_.accel);
    const bool is_held_out = context_.scene.instances[hit->instance].is_holdout;
    if (bsdf.holdout >= 1.0f || (is_held_out && is_black(bsdf.transparency))) return;
    if (!is_held_out && average(bsdf.transparency) <= kMostTransparency) return record_first_hit(point, bsdf);
    ray = ray_behind(ray, hit->t, point, bsdf, state);
    hit = context_.accel.intersect_surface(ray, state.ray_kind);
  }
}

template <class Kind>
inline std::optional<Hit> Walk<Kind>::find_hit() const {
  if constexpr (Kind::splits) {
    if (scratch_.known_hit) return std::exchange(scratch_.known_hit, std::nullopt);
  }
  if constexpr (Kind::has_media) {
    return context_.accel.intersect_or_medium(ray_, state_.ray_kind, media_.trail.passed());
  } else {
    return context_.accel.intersect(ray_, state_.ray_kind);
  }
}

template <class Kind>
inline float Walk<Kind>::segment_begin() const {
  if constexpr (Kind::has_media) return std::max(ray_.t_min, media_.trail.begin());  // where cameras clip, as in Cycles
  return ray_.t_min;
}

template <class Kind>
inline bool Walk<Kind>::cross_boundary(const SurfacePoint& point, float distance) {
  if (++media_.boundaries > kMostBoundaries) return false;
  const Instance& instance = context_.scene.instances[point.instance];
  if (sees_film_ && instance.is_shadow_catcher && record_.caught == 0.0f) catch_shadows();
  ray_ = context_.media->cross(media_.stack, media_.trail, ray_, distance, point);
  travelled_ = state_.ray_length - media_.trail.begin();
  path_length_ -= media_.trail.begin();
  return true;
}

template <class Kind>
inline void Walk<Kind>::update_media(const SurfacePoint& point, Vec3 direction) {
  if constexpr (Kind::has_media) {
    context_.media->leave(media_.stack, context_.accel, point, direction);
    media_.trail.clear();
  }
}

template <class Kind>
inline PassedLight Walk<Kind>::passed_light_to(const SurfacePoint& point, const IncidentLight& light) const {
  if (!light.casts_shadow) return {light.radiance};
  if constexpr (Kind::has_media) {
    return {light.radiance * transmittance(context_, point, light, state_, media_.stack, sampler_)};
  } else {
    return passed_light(context_, point, light, state_);
  }
}

}  // namespace cistern
