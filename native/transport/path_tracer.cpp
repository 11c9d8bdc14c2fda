#include "transport/path_tracer.h"

#include "base/warp.h"
#include "shading/material.h"
#include "transport/camera_ray.h"

namespace cistern {
namespace {

/// Shadow rays end this much before the light, relative to their length: a few roundings.
constexpr float kShadowEpsilon = 1e-6f;
/// Surfaces more transparent than this do not count as the first one seen: Cycles' default pass_alpha_threshold.
constexpr float kMostTransparency = 0.5f;

/// Throughput of a path split by what the light it finds will be called: `smooth` while no vertex was rough enough to
/// reconnect (the light is seen: Emission, Environment), `direct` after exactly one scattering there, `indirect` later.
struct Throughput {
  Rgb smooth{1.0f}, direct, indirect;

  Rgb total() const { return smooth + direct + indirect; }
  void scale(Rgb s) { smooth *= s, direct *= s, indirect *= s; }
  void scatter(Rgb rough_weight, Rgb smooth_weight) {
    indirect = (direct + indirect) * (rough_weight + smooth_weight);
    direct = smooth * rough_weight;
    smooth = smooth * smooth_weight;
  }
};

enum class SourceKind : uint8_t { SURFACE, ENVIRONMENT };

/// One path on its way. The steps of `trace_path` in the order they happen.
class Walk {
 public:
  Walk(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch, VisiblePoint* visible)
      : context_(context),
        ray_(ray),
        sampler_(sampler),
        scratch_(scratch),
        visible_(visible),
        vertex_origin_(ray.origin) {
    features_done_ = !context.record_surfaces;
    if (visible) visible->exists = false;
  }

  PathRecord run() {
    while (step()) {
    }
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
    const Bsdf bsdf = evaluate_material(context_.scene, point, state_);
    const bool is_seen = average(bsdf.transparency) <= kMostTransparency;
    if (context_.record_surfaces && !record_.hit && state_.depth == 0 && is_seen) record_first_hit(point, bsdf);
    if (bsdf.holdout > 0.0f) hold_out(bsdf.holdout);
    if (!is_black(bsdf.emission)) add_surface_emission(point, bsdf.emission);
    record_features(bsdf);
    at_visible_point_ = false;
    if (!last_segment_ && bsdf.scatters()) {
      if (is_visible_point(bsdf)) set_visible_point(point, bsdf);
      add_direct_light(point, bsdf);
    }
    return continue_path(point, bsdf);
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

  static bool has_rough_lobe(const Bsdf& bsdf) {
    for (int i = 0; i < bsdf.count; ++i)
      if (!is_smooth(bsdf.lobes[i])) return true;
    return false;
  }

  static bool has_smooth_lobe(const Bsdf& bsdf) {
    for (int i = 0; i < bsdf.count; ++i)
      if (is_smooth(bsdf.lobes[i])) return true;
    return false;
  }

  // --- the visible point ----------------------------------------------------------------------------------------

  bool is_visible_point(const Bsdf& bsdf) const {
    return visible_ && !visible_->exists && !is_black(throughput_.smooth) && has_rough_lobe(bsdf);
  }

  void set_visible_point(const SurfacePoint& point, const Bsdf& bsdf) {
    *visible_ = make_visible_point(point, bsdf);
    visible_->state = state_;
    visible_->scattered = scattered_state(bsdf);
    visible_->throughput = throughput_.smooth;
    visible_->distance = path_length_;
    at_visible_point_ = true;
  }

  // --- light found by the path itself ---------------------------------------------------------------------------

  /// Weights of this path against next-event estimation for an emitter that has `pdf` (per solid angle, given the
  /// emitter). Light that the visible point reflects has one of its own, against the light samples of the caller.
  struct EmitterWeight {
    float direct = 1.0f, other = 1.0f;
  };
  EmitterWeight emitter_weight(std::optional<uint32_t> emitter, float pdf) const {
    if (!emitter || !mis_receiver_) return {};
    const float pmf = context_.lights.pmf(*emitter, mis_receiver_->position, mis_receiver_->normal);
    const float other = power_heuristic(scatter_pdf_, pmf * pdf);
    return {left_visible_point_ ? 1.0f - light_sample_share(context_, *emitter, pdf, scatter_pdf_) : other, other};
  }

  void add(Rgb radiance, EmitterWeight weight, SourceKind source) {
    const PathLimits& limits = context_.limits;
    Rgb& seen = source == SourceKind::ENVIRONMENT ? record_.environment : record_.emission;
    const Rgb seen_light = throughput_.smooth * radiance * weight.other;
    seen += state_.depth == 0 ? seen_light : clamp_contribution(seen_light, limits.clamp_direct);
    record_.direct += clamp_contribution(throughput_.direct * radiance * weight.direct, limits.clamp_direct);
    record_.indirect += clamp_contribution(throughput_.indirect * radiance * weight.other, limits.clamp_indirect);
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
        add(lamp.radiance, emitter_weight(lamp.emitter, lamp.pdf), SourceKind::SURFACE);
    }
  }

  void add_surface_emission(const SurfacePoint& point, Rgb emission) {
    const std::optional<uint32_t> emitter = context_.lights.emitter_of(point.instance, point.triangle);
    const float pdf = emitter && mis_receiver_ ? context_.lights.surface_pdf(point, mis_receiver_->position) : 0.0f;
    add(emission, emitter_weight(emitter, pdf), SourceKind::SURFACE);
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
    add(radiance, emitter_weight(emitter, pdf), SourceKind::ENVIRONMENT);
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

  void add_direct_light(const SurfacePoint& point, const Bsdf& bsdf) {
    if (at_visible_point_ && !has_smooth_lobe(bsdf)) return;  // all of it is the caller's
    const double u_choice = sampler_.next_double();
    const Vec2 u_light = sampler_.light_position(state_.depth);
    const auto choice = context_.lights.choose(point.position, light_side(point, bsdf), u_choice, u_light);
    if (!choice) return;
    const auto light = context_.lights.evaluate(choice->sample, point.position, scattered_state(bsdf));
    if (!light) return;
    const BsdfEvaluation f = evaluate_bsdf(bsdf, light->wi, light->visibility);
    if (is_black(f.total_cos())) return;
    const float pdf = choice->pmf * light->pdf;
    const bool needs_mis = !light->is_delta && light->use_mis;
    const float weight = needs_mis ? power_heuristic(pdf, f.pdf * scatter_probability(bsdf)) : 1.0f;
    Rgb radiance = light->radiance * (weight / pdf);
    if (light->casts_shadow) radiance *= transmittance(context_, point.position, point.ng, *light, state_);
    if (is_black(radiance)) return;
    const bool is_environment = choice->sample.emitter == context_.lights.environment_emitter();
    Rgb& seen = is_environment ? record_.environment : record_.emission;
    const PathLimits& limits = context_.limits;
    seen += clamp_contribution(throughput_.smooth * f.smooth_cos * radiance, limits.clamp_direct);
    if (!at_visible_point_)
      record_.direct += clamp_contribution(throughput_.smooth * f.rough_cos * radiance, limits.clamp_direct);
    record_.indirect += clamp_contribution((throughput_.direct + throughput_.indirect) * f.total_cos() * radiance,
                                           limits.clamp_indirect);
  }

  // --- continuing ---------------------------------------------------------------------------------------------------

  bool continue_path(const SurfacePoint& point, const Bsdf& bsdf) {
    const float p_scatter = scatter_probability(bsdf);
    if (p_scatter < 1.0f && sampler_.next_float() >= p_scatter) return pass_through(point, bsdf, 1.0f - p_scatter);
    if (last_segment_ || !bsdf.scatters()) return false;
    return scatter(point, bsdf, p_scatter);
  }

  bool pass_through(const SurfacePoint& point, const Bsdf& bsdf, float probability) {
    const int most_surfaces = context_.limits.max_transparent_bounces;
    if (state_.transparent_depth >= most_surfaces) return false;
    last_segment_ |= ++state_.transparent_depth == most_surfaces;
    throughput_.scale(bsdf.transparency * (1.0f / probability));
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
    throughput_.scatter(sample->rough_weight * (1.0f / p_scatter), sample->smooth_weight * (1.0f / p_scatter));
    if (is_black(throughput_.total())) return false;
    left_visible_point_ = at_visible_point_;
    count_bounce(*sample);
    sees_film_ &= context_.limits.film_transparent_glass && sample->is_clear;
    if (sample->is_delta) {
      mis_receiver_.reset();
    } else {
      mis_receiver_ = Receiver{point.position, light_side(point, bsdf)};
      scatter_pdf_ = sample->pdf * p_scatter;
    }
    ray_ = Ray{offset_origin(point.position, point.ng, sample->wi), sample->wi};
    vertex_origin_ = ray_.origin;
    travelled_ = 0.0f;
    return survives_roulette();
  }

  static void count_scattering(PathState& state, ScatterKind kind) {
    ++state.depth;
    switch (kind) {
      case ScatterKind::DIFFUSE:
        state.ray_kind = kVisibleToDiffuse;
        ++state.diffuse_depth;
        break;
      case ScatterKind::GLOSSY:
        state.ray_kind = kVisibleToGlossy;
        ++state.glossy_depth;
        break;
      case ScatterKind::TRANSMISSION:
        state.ray_kind = kVisibleToTransmission;
        ++state.transmission_depth;
        break;
    }
  }

  void count_bounce(const BsdfSample& sample) {
    count_scattering(state_, sample.kind);
    state_.is_singular = sample.is_delta;
    // The limits of the other kinds were kept when those were counted.
    const PathLimits& limits = context_.limits;
    last_segment_ = state_.depth > limits.max_bounces || state_.diffuse_depth > limits.max_diffuse_bounces ||
                    state_.glossy_depth > limits.max_glossy_bounces ||
                    state_.transmission_depth > limits.max_transmission_bounces;
  }

  bool survives_roulette() {
    if (state_.depth <= context_.limits.min_bounces) return true;
    const float p = std::min(1.0f, max_component(throughput_.total()));
    if (p >= 1.0f) return true;
    if (sampler_.next_float() >= p) return false;
    throughput_.scale(Rgb(1.0f / p));
    return true;
  }

  struct Receiver {
    Vec3 position, normal;
  };

  const PathContext& context_;
  Ray ray_;
  PathSampler& sampler_;
  PathScratch& scratch_;
  VisiblePoint* visible_;  // null: nobody shares the direct light
  bool at_visible_point_ = false, left_visible_point_ = false;
  PathState state_;
  PathRecord record_;
  Throughput throughput_;
  std::optional<Receiver>
      mis_receiver_;          // last vertex that next-event estimation could have lit; none after a delta lobe
  float scatter_pdf_ = 0.0f;  // of the current direction, per solid angle
  float path_length_ = 0.0f;
  Vec3 vertex_origin_;         // where the ray left the last vertex: transparent surfaces are no vertices
  float travelled_ = 0.0f;     // from there to the ray's origin
  bool last_segment_ = false;  // a bounce limit is reached: only light met directly still counts
  bool features_done_ = false;
  bool sees_film_ = true;  // the film may be transparent for this ray: from the camera, or through clear glass
};

/// Both ends are moved off their surfaces, and the ray joins the moved ends: one end alone would let light at grazing
/// angles occlude itself.
Ray shadow_ray(Vec3 position, Vec3 ng, const IncidentLight& light) {
  const Vec3 origin = offset_origin(position, ng, light.wi);
  if (!std::isfinite(light.distance)) return {origin, light.wi};
  Vec3 target = position + light.wi * light.distance;
  if (light.normal != Vec3{}) target = offset_origin(target, light.normal, -light.wi);
  const Vec3 segment = target - origin;
  const float distance = length(segment);
  return {origin, segment / distance, 0.0f, distance * (1.0f - kShadowEpsilon)};
}

}  // namespace

Rgb transmittance(const PathContext& context, Vec3 position, Vec3 ng, const IncidentLight& light,
                  const PathState& path) {
  Ray ray = shadow_ray(position, ng, light);
  if (context.accel.occluded(ray)) return Rgb(0.0f);
  Rgb passed(1.0f);
  if (!context.accel.has_transparent_surfaces()) return passed;
  PathState shadow_state = path;
  shadow_state.ray_kind = kVisibleToShadow;
  ++shadow_state.depth;  // as a ray scattered towards the light
  float travelled = 0.0f;
  const int most_surfaces = context.limits.max_transparent_bounces - path.transparent_depth;
  for (int i = 0; i <= most_surfaces; ++i) {
    const std::optional<Hit> hit = context.accel.intersect_transparent(ray);
    if (!hit) return passed;
    const SurfacePoint point = make_surface_point(context.scene, ray, *hit);
    travelled += hit->t;
    shadow_state.ray_length = travelled;
    passed *= evaluate_transparency(context.scene, point, shadow_state);
    if (is_black(passed)) return passed;
    ++shadow_state.transparent_depth;
    ray.t_max -= hit->t;
    ray.origin = offset_origin(point.position, point.ng, ray.direction);
  }
  return Rgb(0.0f);
}

Rgb clamp_contribution(Rgb contribution, float limit) {
  const float mean = average(contribution);
  return limit > 0.0f && mean > limit ? contribution * (limit / mean) : contribution;
}

float scatter_probability(const Bsdf& bsdf) {
  const float straight = average(bsdf.transparency);
  return straight > 0.0f ? bsdf.total_sample_weight / (bsdf.total_sample_weight + straight) : 1.0f;
}

float light_sample_share(const PathContext& context, uint32_t emitter, float light_pdf, float bsdf_pdf) {
  const float light = context.light_candidates * context.lights.receiver_free_pmf(emitter) * light_pdf;
  return light > 0.0f ? light / (light + bsdf_pdf) : 0.0f;
}

PathRecord trace_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                      VisiblePoint* visible) {
  return Walk(context, ray, sampler, scratch, visible).run();
}

}  // namespace cistern
