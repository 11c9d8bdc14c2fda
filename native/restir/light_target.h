#pragma once

#include <optional>

#include "resampling/reservoir.h"
#include "transport/path_tracer.h"

namespace cistern {

// Light samples are points of their emitter's own unit square, (emitter, uv), and all contribution weights W are in
// that measure: counting over emitters, area over the square. Every receiver shares it, so a sample moves from one to
// another without a Jacobian, and area lights, spheres, suns and environment are one kind of sample. A light sampler
// draws y = (emitter, uv) with density pmf(emitter); at receiver r the integrand is
//   F_r(y) = f cos(wi) L(wi) / p(wi | emitter),  p per solid angle (LightSet::evaluate).
// Reservoirs estimate its part light_sample_share (path_tracer.h); the path's own BSDF sample adds the rest. They never
// see visibility, so MIS weights need no rays.
using LightReservoir = Reservoir<LightSample>;

/// Target p_hat of light reservoirs at a visible point: the unshadowed magnitude that F brings it, by its Receiver.
/// Positive wherever F can be. `candidates` as in light_sample_share, here and below.
float light_target(const PathContext& context, float candidates, const VisiblePoint& visible,
                   const LightSample& sample);

/// Whether something of the sample's light arrives.
bool is_visible(const PathContext& context, const VisiblePoint& visible, const LightSample& sample);

/// The sample's light as it arrives: F is `f_cos` (rough lobes, true BSDF) times `radiance`, which holds the share of
/// light samples, the density and the shadow ray; `even_cos` as BsdfEvaluation has it. Empty where nothing arrives.
struct ArrivingLight {
  Vec3 wi;
  Rgb f_cos, even_cos, radiance;
  uint8_t visibility = kVisibleToAll;  // RayVisibility bits
};
std::optional<ArrivingLight> arriving_light(const PathContext& context, float candidates, const VisiblePoint& visible,
                                            const LightSample& sample);

/// F times the throughput to the camera.
Rgb reflected_light(const PathContext& context, float candidates, const VisiblePoint& visible,
                    const LightSample& sample);

/// Shares that kinds of scattering have in it.
KindColors reflected_shares(const PathContext& context, const VisiblePoint& visible, const LightSample& sample);

}  // namespace cistern
