#pragma once

#include "accel/accel.h"
#include "lights/light_set.h"
#include "transport/camera_ray.h"
#include "transport/path_sampler.h"
#include "transport/visible_points.h"

namespace cistern {

/// Limits of a path as Blender users know them: a limit of n allows n scatterings after the first one of its kind is
/// lit, so 0 is direct light only. Transparent surfaces: a path passes n, and of
/// what it meets after the last only sees the emission; its shadow rays pass as many as the path has left.
struct PathLimits {
  int max_bounces = 12;
  int max_diffuse_bounces = 12;
  int max_glossy_bounces = 12;
  int max_transmission_bounces = 12;
  int max_transparent_bounces = 8;
  int min_bounces = 0;        // Russian roulette starts after these
  float clamp_direct = 0.0f;  // largest mean radiance of one contribution, 0: off
  float clamp_indirect = 0.0f;
  bool film_transparent = false;  // the camera sees through to nothing instead of the environment
  bool film_transparent_glass = false;
};

/// What a path needs besides its own random numbers; all of it immutable while rendering.
struct PathContext {
  const Scene& scene;
  const Accel& accel;
  const LightSet& lights;
  PathLimits limits;
  PixelFootprint pixel;
  /// Whether PathRecord's members about the first surfaces are wanted.
  bool record_surfaces = true;
  /// Light samples that visible points get besides their path; counts only where direct light is left to the caller.
  float light_candidates = 1.0f;
};

/// Depth of pixels that see nothing.
inline constexpr float kNoHitDepth = 1e10f;

/// One camera path's estimate. Combined = direct + indirect + emission + environment.
struct PathRecord {
  Rgb direct, indirect, emission, environment;
  float alpha = 1.0f;

  // First surface the camera ray met, through those that are more transparent than not.
  bool hit = false;
  float depth = kNoHitDepth;  // along the view axis
  Vec3 position, normal;
  // First surface rough enough to be a feature for a denoiser, seen through smooth ones.
  Rgb albedo;
  Vec3 denoising_normal;
};

/// Reusable memory of one thread, so that nothing is allocated per sample.
struct PathScratch {
  std::vector<LampHit> lamp_hits;
};

/// The reference estimator: unidirectional path tracing with next-event estimation at every vertex and multiple
/// importance sampling (power heuristic) against BSDF sampling [Veach 1997, ch. 9 and 10]. `ray` starts at the camera.
///
/// With `visible`, the caller estimates the direct light there: the path stores its visible point, takes no light
/// sample for the rough lobes there, and of an emitter that it meets next adds only 1 - light_sample_share.
/// Transparent surfaces on the way scale both parts alike.
PathRecord trace_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                      VisiblePoint* visible = nullptr);

/// Part of an emitter's light at a visible point that light samples account for; the path's own BSDF sample has the
/// rest. Balance heuristic of `light_candidates` samples with receiver-free probabilities: any partition is lawful,
/// this one costs nothing to evaluate at somebody else's visible point. Densities are per solid angle, `light_pdf`
/// given the emitter. 1 for light that no scattered ray meets is up to the caller.
float light_sample_share(const PathContext& context, uint32_t emitter, float light_pdf, float bsdf_pdf);

/// A contribution scaled down to a mean over channels of at most `limit`; 0 means no limit.
Rgb clamp_contribution(Rgb contribution, float limit);

/// Probability that a path scatters instead of passing straight through.
float scatter_probability(const Bsdf& bsdf);

/// Fraction of what `light` sends that reaches `position`, on a surface with geometric normal `ng`: 0 behind opaque
/// surfaces, tinted by transparent ones.
Rgb transmittance(const PathContext& context, Vec3 position, Vec3 ng, const IncidentLight& light,
                  const PathState& path);

}  // namespace cistern
