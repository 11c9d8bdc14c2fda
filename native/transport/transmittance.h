#pragma once

#include <array>

#include "transport/clear_panes.h"
#include "transport/media_stack.h"
#include "transport/path_context.h"
#include "transport/path_sampler.h"

namespace cistern {

/// Fraction of what `light` sends that reaches `receiver`: 0 behind opaque surfaces, tinted by transparent ones.
Rgb transmittance(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                  const PathState& path);

/// What arrives of a light, by clear panes, too, where PathContext::passes_panes.
PassedLight passed_light(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                         const PathState& path);

/// Whether a light that is not distant would be looked for past panes from this origin of a ray.
bool is_behind_panes(const PathContext& context, Vec3 origin, const IncidentLight& light);

/// The same where there are media, with those that the ray to the receiver arrived in; of media that vary from place to
/// place an estimate, whose mean it is.
Rgb transmittance(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                  const PathState& path, MediaStack media, PathSampler& sampler);
/// Of light that reaches a point in these media; `leaves`: of the ray from there.
Rgb transmittance(const PathContext& context, Vec3 position, TriangleId leaves, float footprint,
                  const IncidentLight& light, const PathState& path, MediaStack media, PathSampler& sampler);

/// Of light that reaches a point where there are none; of the sky and suns by panes, too, as if they sent as much the
/// way it goes on.
Rgb transmittance(const PathContext& context, Vec3 position, TriangleId leaves, float footprint,
                  const IncidentLight& light, const PathState& path);

/// Whether the ray to a vertex may meet splats. Its way cannot be asked about again, since the answer would be another
/// one: no such path is found by way of others, and what a path of one's own brings is kept to oneself.
bool may_meet_splats(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& vertex);

/// The same of a ray that `receiver` scattered towards a vertex at `distance` along `wi`, of normal `normal`: its kind
/// in `scattered` decides what it meets; black where it may_meet_splats. `scattered.transparent_depth` surfaces were
/// passed before.
Rgb transmittance_to_vertex(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& vertex,
                            const PathState& scattered);

/// Surface points that rays leave, several at a time.
struct SurfaceLanes {
  std::array<const SurfacePoint*, kLanes> points{};  // null: none, and the rest is zero
  std::array<int, kLanes> transparent_depth{};       // surfaces that their paths passed before
  Vec3Lanes position, ng, ns;
  Lanes clearance = 0.0f;
  std::array<TriangleId, kLanes> leaves = RayLanes::no_triangles();

  void set(size_t lane, const SurfacePoint& point, int transparent_depth);
};
/// A vertex that several points look at, all from the side of its normal.
struct SeenVertex {
  Vec3 position, normal;
  float clearance = 0.0f;  // of its surface
};
/// The same for several points, of which only some are asked for; `wi`, unit, leads to the vertex. What a path received
/// there may have passed all transparent surfaces that were left to it; black where a ray may_meet_splats, and where a
/// ray passes more or fewer of them than that of the path, which was `scattered` there: with more or fewer left, it
/// would have found something else.
RgbLanes transmittance_as_found(const PathContext& context, const SurfaceLanes& points, const Vec3Lanes& wi,
                                const LaneMask& is_asked, const SeenVertex& vertex, const PathState& scattered);

}  // namespace cistern
