#pragma once

#include "shading/surface_point.h"

namespace cistern {

/// What a path meets before it scatters, in order: surfaces that it passes and the first it does not, or the
/// environment (where `point` is but the direction -wo). Behind glass that the film is transparent through, too.
struct SeenSurface {
  SurfacePoint point{};
  PathState path{};
  bool is_environment = false;
  bool is_held_out = false;   // nothing of it is in the picture
  float throughput = 1.0f;    // mean over channels, before the surface
  float alpha = 1.0f;         // mean of what does not pass it straight
  float contribution = 1.0f;  // mean of the product of the two
  float clear = 1.0f;         // mean of what fog before it lets through, over the chance that the path gets there
  Vec3 normal{};              // with bump and normal maps
  float roughness = 1.0f;     // see mean_roughness
};

}  // namespace cistern
