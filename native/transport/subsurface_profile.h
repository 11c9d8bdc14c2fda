#pragma once

#include "transport/subsurface_walk.h"

namespace cistern {

/// Where light that entered leaves the same object by a DiffusionProfile of straight distances, on whatever surface
/// lies so far away. Rays along three axes through disks about the entry find candidates, of which one is taken in
/// proportion to what it brings; axes and colours are weighed by the balance heuristic. [King et al. 2013, BSSRDF
/// Importance Sampling; Pharr, Jakob and Humphreys 2016, Physically Based Rendering, 15.4] Empty where a ray finds
/// none.
std::optional<SubsurfaceExit> exit_by_profile(const Accel& accel, const SurfacePoint& entry,
                                              const Subsurface& subsurface, int vertex, PathSampler& sampler);

}  // namespace cistern
