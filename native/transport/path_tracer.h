#pragma once

#include "lights/light_record.h"
#include "transport/guide_table.h"
#include "transport/light_by_group.h"
#include "transport/light_by_kind.h"
#include "transport/path_capture.h"
#include "transport/path_sampler.h"
#include "transport/seen_surface.h"
#include "transport/transmittance.h"

namespace cistern {

/// Depth of pixels that see nothing.
inline constexpr float kNoHitDepth = 1e10f;

/// One camera path's estimate. Combined = direct + indirect + emission + environment.
struct PathRecord {
  Rgb direct, indirect, emission, environment;
  Rgb combined() const { return direct + indirect + emission + environment; }
  float alpha = 1.0f;
  // Where the path met a surface that catches shadows in the film: its throughput, and what it had gathered before.
  float caught = 0.0f;
  Rgb light_before_catcher;
  float alpha_before_catcher = 1.0f;
  /// Light that was left at a vertex, `is_caught` or before the catcher.
  void add_left(Rgb of_direct, Rgb of_indirect, bool is_caught) {
    direct += of_direct;
    indirect += of_indirect;
    if (!is_caught) light_before_catcher += of_direct + of_indirect;
  }
  Rgb shared;  // what `indirect` has from other pixels' paths, less what it lacks of its own: for trials

  // First surface the camera ray met, through those that are more transparent than not.
  bool hit = false;
  float depth = kNoHitDepth;  // along the view axis
  Vec3 position, normal;
  // First surface rough enough to be a feature for a denoiser, seen through smooth ones.
  Rgb albedo;
  Vec3 denoising_normal;
};

/// A vertex on the way, whose direction will turn out to have brought light.
struct TaughtVertex {
  NestedCellKey cell;
  uint32_t bin;            // of the direction
  float scale;             // from what the path adds up to GuideRecord::light
  double gathered_before;  // what the path had added up before it took the direction
};

/// Reusable memory of one thread, so that nothing is allocated per sample.
struct PathScratch {
  std::optional<Hit> known_hit;  // of the camera ray to come: it is not traced
  std::vector<LampHit> lamp_hits;
  bool trains_lights = false;              // whether paths leave records where lights are chosen by what was learned
  std::vector<LightRecord> light_records;  // of all paths so far
  bool trains_guide = false;               // the same of directions
  std::vector<GuideRecord> guide_records;
  std::vector<TaughtVertex> taught_vertices;  // of the path under way
  std::vector<SeenSurface> seen_surfaces;     // of the last path, where PathContext::record_seen asks for them
  LightByKind light_by_kind;                  // the same, where PathContext::splits_kinds
  LightByGroup light_by_group;                // the same, of PathContext::light_groups
};

/// The reference estimator: unidirectional path tracing with next-event estimation at every vertex and multiple
/// importance sampling (power heuristic) against BSDF sampling [Veach 1997, ch. 9 and 10]. `ray` starts at the camera.
///
/// With `capture`, what that asks for is left out of the estimate and stored instead: direct light by the rough lobes
/// of the visible point and of later vertices, of which the path's own BSDF sample adds only 1 - light_sample_share;
/// and light that the rough lobes of the visible point reflect from the rough lobes of the next vertex, the sample
/// point. Smooth lobes, and what they show, keep the path's own estimate. The sum of estimate and what was left is the
/// estimate without `capture`.
PathRecord trace_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                      PathCapture* capture = nullptr);

/// Part of an emitter's light that `candidates` light samples at a vertex account for; the path's own BSDF sample has
/// the rest. Balance heuristic with receiver-free probabilities: any partition is lawful, this one costs nothing to
/// evaluate at somebody else's vertex. Densities are per solid angle, `light_pdf` given the emitter. Not for light that
/// no scattered ray meets: light samples have all of that.
float light_sample_share(const PathContext& context, float candidates, uint32_t emitter, float light_pdf,
                         float bsdf_pdf);

/// A contribution scaled down to a mean over channels of at most `limit`, or least -`limit`; 0 means no limit.
Rgb clamp_contribution(Rgb contribution, float limit);

/// What that multiplies it by.
float clamp_factor(Rgb contribution, float limit);

/// Probability that a path scatters instead of passing straight through.
float scatter_probability(const Bsdf& bsdf);

}  // namespace cistern
