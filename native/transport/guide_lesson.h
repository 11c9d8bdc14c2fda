#pragma once

#include "transport/path_tracer.h"

namespace cistern {

/// Notes a direction that a path takes, before its throughput takes that in. `gathered`: magnitude of all that the path
/// has added up to so far.
void remember_direction(const PathContext& context, const SurfacePoint& point, const Bsdf& bsdf,
                        const BsdfSample& sample, Rgb throughput, double gathered, PathScratch& scratch);

/// Leaves the records of a path that has ended, having added up to `gathered`.
void teach_directions(double gathered, PathScratch& scratch);

}  // namespace cistern
