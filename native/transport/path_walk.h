#pragma once

#include <cmath>
#include <type_traits>
#include <utility>
#include <variant>

#include "base/warp.h"
#include "lights/emissive_triangles.h"
#include "shading/dispersion.h"
#include "shading/displaced_normal.h"
#include "shading/material.h"
#include "transport/camera_ray.h"
#include "transport/guide_lesson.h"
#include "transport/learned_light_sample.h"
#include "transport/path_guide.h"
#include "transport/path_throughput.h"
#include "transport/path_tracer.h"
#include "transport/path_walk_state.h"
#include "transport/subsurface_profile.h"
#include "transport/subsurface_walk.h"
#include "transport/uneven_media.h"

namespace cistern {

/// trace_path for a context with learned lights or guided bounces: whatever its walks know.
PathRecord trace_learned_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                              PathCapture* capture);

/// trace_path for a context with media.
PathRecord trace_media_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch);

/// trace_path for a context that splits, or a camera ray whose hit is known: pictures pay for neither.
PathRecord trace_split_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                            PathCapture* capture);

/// Of paths that leave records for what is learned, all.
inline Knowledge knowledge_of(const PathContext& context, const PathScratch& scratch) {
  const bool follows_directions = context.guiding && (context.guiding->is_on || scratch.trains_guide);
  if (context.learned || follows_directions) return Knowledge::LEARNED;
  return context.caustics ? Knowledge::CAUSTICS : Knowledge::NONE;
}

/// One path on its way. The steps of `trace_path` in the order they happen. `capture` is null unless the kind captures.
template <class Kind>
class Walk {
 public:
  Walk(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch, PathCapture* capture)
      : context_(context), ray_(ray), sampler_(sampler), scratch_(scratch), vertex_origin_(ray.origin) {
    features_done_ = !context.record_surfaces;
    if (context.record_surfaces) scratch.seen_surfaces.clear();
    if constexpr (Kind::captures) {
      capture_.out = capture;
      capture->clear();
    }
    if (context.disperses) {
      wavelength_ = sample_wavelength(sampler.wavelength());
      state_.wavelength = wavelength_.micrometres;
    }
    if constexpr (Kind::splits) start_parts();
    if constexpr (Kind::has_media)
      media_.stack = context.media->around(context.accel, ray.origin + ray.t_min * ray.direction);
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
    const std::optional<Hit> hit = find_hit();
    if constexpr (Kind::has_media) enter_segment(hit);
    if (context_.lights.has_visible_lamps()) add_lamps(hit);
    if (context_.has_shadow_links && state_.depth > 0 && travelled_ == 0.0f) add_past_blockers();
    if constexpr (Kind::has_media) {
      if (const std::optional<bool> goes_on = traverse_medium()) return *goes_on;
    }
    if (!hit) {
      add_environment();
      return false;
    }
    // What is met without a surface has cost no more than this ray. What emits is seen before roulette.
    const bool emits_first = plays_roulette() && is_emitter(*hit);
    if (!emits_first && !survives_roulette()) return false;
    path_length_ += hit->t;
    state_.ray_length = travelled_ + hit->t;
    SurfacePoint point = make_surface_point(context_.scene, ray_, *hit);
    if constexpr (Kind::has_media) {
      if (context_.media->is_boundary(point, state_.ray_kind)) {
        if (is_on_sheet()) record_.alpha = 0.0f;
        return !is_on_sheet() && cross_boundary(point, hit->t);
      }
    }
    set_footprint(point, context_.pixel.size + context_.pixel.angle * path_length_, context_.scene, state_);
    GuideCells cells;
    if constexpr (Kind::is_guided) cells = guide_cells(context_, point);
    Bsdf bsdf = evaluate_material(context_.scene, point, state_, &context_.accel);
    has_one_wavelength_ |= bsdf.disperses;
    if constexpr (Kind::captures) {
      if (can_be_visible_point(bsdf)) bsdf.rough_sampling = capture_.out->rough_sampling;
    }
    if (sees_film_) {
      const Instance& instance = context_.scene.instances[hit->instance];
      if (instance.is_holdout) return pass_held_out(point, bsdf);
      if (instance.is_shadow_catcher && record_.caught == 0.0f) catch_shadows();
    }
    if (context_.record_surfaces) record_surface(point, bsdf);
    if (bsdf.holdout > 0.0f && !hold_out(bsdf.holdout)) return false;
    if (is_on_sheet()) record_.alpha -= average(bsdf.transparency);
    if (!is_black(bsdf.emission)) add_surface_emission(point, bsdf.emission);
    record_features(bsdf);
    if (emits_first && !survives_roulette()) return false;
    if constexpr (Kind::splits) add_color(bsdf);
    if constexpr (Kind::captures) capture_.vertex = {};
    const bool is_vertex = !last_segment_ && bsdf.scatters();
    if constexpr (Kind::is_guided) {
      if (is_vertex) guide_bounce(context_, cells, bsdf);
    }
    float p_scatter = scatter_probability(bsdf);
    const float p_of_mis = p_scatter;  // whenever it is decided
    if constexpr (Kind::captures) {
      if (is_vertex && (capture_.open_link || capture_.only_deep_link_next) && p_scatter < 1.0f) {
        // A sample point either reflects or is passed, and so does what only one link goes on from: decided before
        // light is gathered.
        if (sampler_.next_float() >= p_scatter) return pass_through(point, bsdf, 1.0f - p_scatter);
        scale_by_chance(Rgb(1.0f), p_scatter);
        p_scatter = 1.0f;
      }
    }
    if (is_vertex) {
      if constexpr (Kind::captures) {
        if (std::exchange(capture_.only_deep_link_next, false)) {
          throughput_.keep_only_link(1);
          if constexpr (Kind::splits) kinds_ = {};
        }
        capture_vertex(point, bsdf);
      }
      if (bsdf.count > 0) add_light_samples(point, bsdf, p_of_mis);
    }
    return continue_path(point, bsdf, p_scatter);
  }

  /// From the first surface on that disperses light, what is found is that of a single wavelength. Last of all, since
  /// that may be less than nothing: what is clamped, and how much of a surface is seen, does not depend on it.
  Rgb tinted(Rgb light) const { return has_one_wavelength_ ? light * wavelength_.weight : light; }

  /// At the point that a pixel of a sheet shows: what is transparent there shows nothing, and no path goes on behind
  /// it.
  bool is_on_sheet() const {
    if constexpr (Kind::splits)
      return context_.scene.camera.type == CameraType::SHEET && state_.depth == 0 && state_.transparent_depth == 0;
    return false;
  }

  /// Leaves a hole in the film; whether anything of the surface shows beside it.
  bool hold_out(float fraction) {
    if (!sees_film_) return true;
    record_.alpha -= fraction * average(throughput_.total());
    return fraction < 1.0f;
  }

  /// What is opaque of an object that is held out leaves a hole in the film; what lies behind shows through the rest.
  bool pass_held_out(const SurfacePoint& point, Bsdf& bsdf) {
    if (context_.record_seen) see_held_out(point);
    record_.alpha -= average(throughput_.total() * max(Rgb(0.0f), Rgb(1.0f) - bsdf.transparency));
    return !is_black(bsdf.transparency) && pass_through(point, bsdf, 1.0f);
  }

  void catch_shadows() {
    record_.caught = average(throughput_.total());
    record_.light_before_catcher = record_.combined();
    record_.alpha_before_catcher = record_.alpha;
  }

  bool is_emitter(const Hit& hit) const {
    const Scene& scene = context_.scene;
    return cistern::is_emitter(scene, scene.material_of(scene.instances[hit.instance], hit.triangle));
  }

  void record_surface(const SurfacePoint& point, const Bsdf& bsdf) {
    const bool is_seen = is_on_sheet() || average(bsdf.transparency) <= kMostTransparency;
    if (!record_.hit && state_.depth == 0 && is_seen && bsdf.holdout < 1.0f) record_first_hit(point, bsdf);
    if (context_.record_seen && sees_film_ && !last_segment_) see(point, bsdf);
  }

  void see(const SurfacePoint& point, const Bsdf& bsdf) {
    const Rgb throughput = throughput_.total(), alpha = max(Rgb(0.0f), Rgb(1.0f) - bsdf.transparency);
    add_seen({.point = point,
              .path = state_,
              .is_held_out = bsdf.holdout >= 1.0f,
              .throughput = average(throughput),
              .alpha = average(alpha),
              .contribution = average(throughput * alpha),
              .normal = bsdf.scatters() ? bsdf_normal(bsdf) : point.ns,
              .roughness = mean_roughness(bsdf)});
  }

  void add_seen(SeenSurface seen) {
    if constexpr (Kind::has_media) seen.clear = average(media_.clear);
    scratch_.seen_surfaces.push_back(seen);
  }

  void see_held_out(const SurfacePoint& point) { add_seen({.point = point, .path = state_, .is_held_out = true}); }

  void see_environment() {
    SeenSurface seen;
    seen.path = state_;
    seen.is_environment = true;
    seen.point.wo = -ray_.direction;
    add_seen(seen);
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
    if (!ends_here && !has_rough_lobe(bsdf) && bsdf.subsurface_count == 0) return;
    features_done_ = true;
    const Rgb shown = ends_here ? min(bsdf.emission, Rgb(1.0f)) : bsdf_albedo(bsdf);
    record_.albedo = throughput_.smooth * shown;
    record_.denoising_normal = bsdf.scatters() ? bsdf_normal(bsdf) : bsdf.ng;
  }

  // --- what is left to others: path_walk_capture.h -----------------------------------------------------------------

  VertexUse vertex_use() const;
  VisiblePoint captured_point(const SurfacePoint& point, const Bsdf& bsdf) const;
  bool can_be_visible_point(const Bsdf& bsdf) const;
  void capture_vertex(const SurfacePoint& point, const Bsdf& bsdf);
  /// Whether the way of an open link to here may meet some.
  bool may_meet_splats(int link, const SurfacePoint& point) const;
  void start_link(int link, const VisiblePoint& from);
  void capture_sample_point(int index, const VisiblePoint& captured);
  FoundKind found_kind(uint8_t kind) const;
  void capture_light_vertex(const VisiblePoint& captured);
  /// Whether the current vertex is the sample point of a second link whose light is left to the caller.
  bool is_left_deep() const;
  /// Light reflected at the current vertex, or other that is met, as the continuations of the captured sample points.
  void add_to_continuations(Rgb by_rough_lobes, Rgb other, LightGroup group);

  // --- by the group of the emitter: path_walk_groups.h --------------------------------------------------------------

  void start_parts();
  LightSource source_of(uint32_t emitter) const;
  LightSource source_of(const Instance& instance) const;
  /// What was just added to the record.
  void add_to_group_of(const LightSource& source, Rgb light);
  /// Where that is asked for, as split_environment_behind_film.
  void add_environment_behind_film_to_group();

  // --- by the kind of the first scattering: path_walk_kinds.h ------------------------------------------------------

  LightByKind& light_by_kind() const { return scratch_.light_by_kind; }
  bool is_unscattered() const { return state_.depth == 0; }
  /// What is seen of a surface.
  void add_color(const Bsdf& bsdf);
  /// Light that the ray meets, as `add` has it.
  void split_met_light(Rgb radiance, SourceKind source);
  /// What Combined leaves out, seen straight: as in Cycles, the pass has it.
  void split_environment_behind_film();
  /// Light that the current vertex reflects, as add_reflected_light has it; `f` of its direction.
  void split_reflected_light(const BsdfKinds& f, Rgb rough_cos, Rgb smooth_cos, Rgb radiance, int faces);
  /// The same of a medium.
  void split_scattered_light(Rgb phase_cos, Rgb radiance);
  void split_later_light(Rgb rough_cos, Rgb smooth_cos, Rgb radiance, int faces = 0);
  /// Before the path's throughput is scattered with these weights in the direction of the sample, or below a surface.
  void scatter_kinds(const Bsdf& bsdf, const BsdfSample& sample, Rgb rough_weight, Rgb smooth_weight);
  void scatter_kinds(Rgb rough_weight, Rgb smooth_weight);
  void scatter_kinds_in_medium();
  KindColors kind_shares_of_seen() const;
  LightVertexKinds kinds_of_vertex() const;

  // --- light found by the path itself: path_walk_light.h -----------------------------------------------------------

  /// Weight of this path against light samples of an emitter that has `pdf` (per solid angle, given the emitter).
  float emitter_weight(std::optional<uint32_t> emitter, float pdf) const;
  /// The same where reservoirs take the light samples.
  float captured_emitter_weight(uint32_t emitter, float pdf) const;
  /// That density of what the ray meets: 0 where light samples of the receiver would not find this path, past panes.
  float sought_pdf(const LampHit& lamp) const;
  float sought_pdf(const SurfacePoint& point, uint32_t emitter) const;
  float sought_environment_pdf() const;
  void add(Rgb radiance, const LightSource& source);
  void add_lamps(const std::optional<Hit>& hit);
  void add_surface_emission(const SurfacePoint& point, Rgb emission);
  /// Light of emitters that some surfaces let pass. A scattered ray meets them on its first segment, wherever they are.
  void add_past_blockers();
  void add_lamps_past_blockers(PathState receiver);
  void add_surfaces_past_blockers(PathState receiver);
  /// Of light that the current ray, which left `receiver`, goes straight towards.
  Rgb transmittance_ahead(const IncidentLight& light, const PathState& receiver) const;
  /// Whether the current ray leaves an emitter to add_past_blockers.
  bool is_met_past_blockers(uint64_t blockers) const { return blockers != kAllSets && state_.depth > 0; }
  void add_environment();

  uint8_t light_set_of(const SurfacePoint& point) const { return context_.scene.instances[point.instance].light_set; }
  /// State of the ray towards a light. Of several kinds of scattering the strongest stands for all: a light whose
  /// material tells diffuse from glossy rays is then another to next-event estimation than to scattered rays, and what
  /// the two add up to depends on their weights.
  PathState scattered_state(const SurfacePoint& point, const Bsdf& bsdf) const;
  void add_light_samples(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter);
  /// How many the current vertex takes, where the light set chooses.
  int light_samples() const;
  /// Next-event estimation with light sample `index` of these.
  void add_direct_light(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter, int index);
  void keep_incident_light(const IncidentLight& light, Rgb radiance, const BsdfEvaluation& f,
                           const LightSource& source);
  /// The limit for what one light sample brings to the current vertex by panes of so many faces: it is for all that
  /// the vertex takes together.
  float clamp_of_reflected(int faces = 0) const;
  /// Adds what the current vertex reflects of a light sample that passed so many faces of panes; by each it was
  /// scattered once more.
  void add_reflected_light(Rgb rough_cos, Rgb smooth_cos, Rgb radiance, const LightSource& source, int faces = 0);

  /// Sets the chooser of the current vertex; false where the light set chooses.
  bool choose_by_learning(const SurfacePoint& point, const Bsdf& bsdf);
  /// Like emitter_weight, against `candidates` samples of the chooser of the vertex that scattered the ray.
  float learned_emitter_weight(uint32_t emitter, float pdf) const;
  /// Next-event estimation with the light sample that learned lights offer.
  void add_learned_light(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter);

  bool teaches_directions() const;
  void gather(Rgb radiance);

  // --- media: path_walk_media.h -------------------------------------------------------------------------------------

  /// Starts the segment up to the hit, with what is emitted along it.
  void enter_segment(const std::optional<Hit>& hit);
  /// Light that the segment's medium scatters, and whether it scatters the path: empty where that goes on to the end,
  /// else whether it goes on at all.
  std::optional<bool> traverse_medium();
  /// By this weight, and without being scattered there.
  void pass_medium(Rgb weight);
  /// Of light on its way along the segment from so far.
  Rgb segment_transmittance(float distance) const;
  /// The same of a medium that varies from place to place.
  std::optional<bool> traverse_uneven_medium();
  UnevenRay uneven_ray() const;
  /// Next-event estimation somewhere along the segment.
  void add_light_in_medium();
  template <class Sample, class Pdf>
  void add_light_in_medium(const Sample& sample_inside, const Pdf& pdf_inside);
  bool scatter_in_medium(const Medium& medium, float distance);
  /// What the camera would see first if no medium scattered the path.
  void record_surface_behind();
  /// Closest surface, or boundary of media, that a ray meets.
  std::optional<Hit> find_hit() const;
  /// Where the segment begins along the ray.
  float segment_begin() const;
  /// Goes on through one, which counts for nothing; a ray that is stuck passes no more of them.
  bool cross_boundary(const SurfacePoint& point, float distance);
  /// Of a path that leaves a surface, on either side.
  void update_media(const SurfacePoint& point, Vec3 direction);
  PassedLight passed_light_to(const SurfacePoint& point, const IncidentLight& light) const;

  // --- continuing: path_walk_continue.h -----------------------------------------------------------------------------

  bool continue_path(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter);
  /// After an event that the path took with `probability`.
  void scale_by_chance(Rgb weight, float probability);
  bool pass_through(const SurfacePoint& point, const Bsdf& bsdf, float probability);
  bool go_straight(const SurfacePoint& point, Rgb weight, float probability);
  /// From here on light samples of the last vertex find nothing; but lamps without shadows, which were met already.
  void forget_rivals();
  /// Goes on from a surface that has ray portals, straight or through one of these. Light samples and connections stop
  /// at the surface, so what is found behind is no rival of theirs.
  [[gnu::noinline]] bool pass_portal(const SurfacePoint& point, const Bsdf& bsdf, float probability);
  bool scatter(const SurfacePoint& point, const Bsdf& bsdf, float p_scatter);
  /// Goes on from where a walk below the surface comes out, with a Lambert lobe of albedo 1: a vertex that nothing is
  /// captured at. Getting there counts as smooth, and as no bounce.
  [[gnu::noinline]] bool scatter_below(const SurfacePoint& entry, const BsdfSample& sample, float p_scatter);
  /// Makes its weights f_k cos / p_k; see emitters_tell_kinds.
  static void carry_own_kind(const Bsdf& bsdf, BsdfSample& sample);
  /// Of a sample by a delta lobe.
  bool goes_through_pane(const SurfacePoint& point, const Bsdf& bsdf, const BsdfSample& sample) const;
  void leave_captured_vertex(const BsdfSample& sample, float p_scatter);
  bool goes_on_from_sample_point();
  void count_bounce(const BsdfSample& sample);
  /// After a scattering of that density; infinite by delta lobes.
  void limit_gloss(float pdf);
  /// Of a path that has ended but for its second link: whether that goes on.
  void extend_deep_link();
  /// Whether the second link is under way, towards its sample point or beyond.
  bool continues_deep_link() const;
  /// With the cube root of the throughput: survivors of dark paths are light in weight and many, and may yet find what
  /// few paths do. With the throughput itself samples are a quarter cheaper, and noisier by more. Nothing is gained by
  /// it before the second bounce, up to which the numbers of a pixel's samples are stratified: it would break that.
  bool survives_roulette();
  /// Whether the path is so long that roulette may end it.
  bool plays_roulette() const;

  const PathContext& context_;
  Ray ray_;
  PathSampler& sampler_;
  PathScratch& scratch_;
  [[no_unique_address]] std::conditional_t<Kind::captures, CaptureState, std::monostate> capture_;
  [[no_unique_address]] std::conditional_t<Kind::learns, LearningState, NoLearning> learning_;
  [[no_unique_address]] std::conditional_t<Kind::is_guided, GuidedState, NoGuides> guided_;
  [[no_unique_address]] std::conditional_t<Kind::has_media, MediaState, NoMedia> media_;
  [[no_unique_address]] std::conditional_t<Kind::splits, KindState, NoKinds> kinds_;
  PathState state_;
  PathRecord record_;
  std::conditional_t<Kind::captures, CapturedThroughput, Throughput> throughput_;
  std::optional<MisReceiver> mis_receiver_;  // last vertex that next-event estimation could have lit; none after a
                                             // delta lobe, but of panes
  PaneTrail panes_;                          // where the context passes_panes
  float scatter_pdf_ = 0.0f;                 // of the current direction, per solid angle
  int light_samples_taken_ = 1;              // by the current vertex, which share its limits
  float least_pdf_ = INFINITY;               // see gloss_limits
  float path_length_ = 0.0f;
  Vec3 vertex_origin_;         // where the ray left the last vertex: transparent surfaces are no vertices
  float travelled_ = 0.0f;     // from there to the ray's origin
  bool last_segment_ = false;  // a bounce limit is reached: only light met directly still counts
  bool features_done_ = false;
  bool has_one_wavelength_ = false;  // see tinted
  WavelengthSample wavelength_{};    // where the context disperses
  bool sees_film_ = true;  // the film may be transparent for this ray: from the camera, or through clear glass
};

}  // namespace cistern

#include "transport/path_walk_capture.h"
#include "transport/path_walk_continue.h"
#include "transport/path_walk_groups.h"
#include "transport/path_walk_kinds.h"
#include "transport/path_walk_light.h"
#include "transport/path_walk_media.h"
