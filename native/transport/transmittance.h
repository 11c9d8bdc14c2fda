#pragma once

#include "transport/media_stack.h"
#include "transport/path_context.h"
#include "transport/path_sampler.h"

namespace cistern {

/// Fraction of what `light` sends that reaches `receiver`: 0 behind opaque surfaces, tinted by transparent ones.
Rgb transmittance(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                  const PathState& path);

/// The same where there are media, with those that the ray to the receiver arrived in; of media that vary from place to
/// place an estimate, whose mean it is.
Rgb transmittance(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                  const PathState& path, MediaStack media, PathSampler& sampler);
/// Of light that reaches a point in these media.
Rgb transmittance(const PathContext& context, Vec3 position, float footprint, const IncidentLight& light,
                  const PathState& path, MediaStack media, PathSampler& sampler);

/// Of light that reaches a point where there are none.
Rgb transmittance(const PathContext& context, Vec3 position, float footprint, const IncidentLight& light,
                  const PathState& path);

/// The same of a ray that `receiver` scattered towards a vertex at `distance` along `wi`, of normal `normal`: its kind
/// in `scattered` decides what it meets. `scattered.transparent_depth` surfaces were passed before.
Rgb transmittance_to_vertex(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& vertex,
                            const PathState& scattered);

/// A ray from a receiver to a vertex that several look at, all from the side of its normal.
struct VertexRay {
  const SurfacePoint* receiver;
  Vec3 wi;                // unit, towards the vertex
  int transparent_depth;  // surfaces passed before
  Rgb transmittance{};
  int surfaces = 0;  // transparent ones on the way
};
struct SeenVertex {
  Vec3 position, normal;
  float clearance = 0.0f;  // of its surface
};
/// The same for several receivers; their rays are traced together.
void trace_to_vertex(const PathContext& context, const SeenVertex& vertex, const PathState& scattered,
                     std::span<VertexRay> rays);

}  // namespace cistern
