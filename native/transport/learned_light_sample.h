#pragma once

#include "lights/learned_lights.h"
#include "lights/light_record.h"
#include "shading/bsdf.h"
#include "transport/path_context.h"
#include "transport/path_sampler.h"

namespace cistern {

/// A path's vertex as light samples see it.
struct LearnedLightVertex {
  const SurfacePoint& point;
  const Bsdf& bsdf;
  PathState scattered;       // of a ray scattered towards a light
  float p_scatter = 1.0f;    // probability that the path scatters here
  bool keeps_light = false;  // others may reflect what this vertex does not
};

/// A light sample and what it brings: the vertex reflects f times the radiance that arrives times `weight`, which holds
/// that against the path's own BSDF sample and one over the probability.
struct LearnedLightSample {
  uint32_t emitter = 0;
  IncidentLight light;
  BsdfEvaluation f;
  float weight = 0.0f;
  float W = 0.0f;  // one over the probability of (emitter, point on it), as resampling estimates it

  /// `weight` times what arrives if nothing is in between.
  Rgb unshadowed() const { return light.radiance * weight; }
};

/// One of the chooser's `candidates` light samples, kept in proportion to what it seems to bring: what it would
/// unshadowed, times the visibility of its lights around here in earlier frames. [Talbot et al. 2005] The path's own
/// BSDF sample has the rest of the power heuristic, in which light samples count `candidates` times. Empty: no light.
std::optional<LearnedLightSample> sample_learned_light(const PathContext& context,
                                                       const LearnedLights::Chooser& chooser,
                                                       const LearnedLightVertex& vertex, double u_choice, Vec2 u_light,
                                                       PathSampler& sampler);

/// What there is to learn from a sample of which `radiance` arrived; `throughput`: of the path up to the vertex.
std::optional<LightRecord> light_record(const PathContext& context, const LearnedLights::Chooser& chooser,
                                        const LearnedLightVertex& vertex, const LearnedLightSample& sample,
                                        Rgb radiance, Rgb throughput);

}  // namespace cistern
