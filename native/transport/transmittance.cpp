#include "transport/transmittance.h"

#include <algorithm>

#include "shading/displaced_normal.h"
#include "shading/material.h"
#include "shading/shadow_origin.h"
#include "transport/uneven_media.h"

namespace cistern {
namespace {

/// Shadow rays end this much before the light, relative to their length: a few roundings.
constexpr float kShadowEpsilon = 1e-6f;

/// The end of a ray is known to a few roundings of its length: it has to stop so much farther from the surface it is
/// aimed at, or light at grazing angles would end behind what it leaves.
constexpr float kEndRounding = 0x1p-22f;

/// Where a ray of length `distance` to a surface ends.
Vec3 ray_end(const Vec3& position, float clearance, float distance, const Vec3& normal, const Vec3& wi) {
  return offset_origin(position, clearance + kEndRounding * distance, normal, -wi);
}

/// `leaves`, `passes`: as of rays.
Ray ray_between(Vec3 origin, Vec3 target, TriangleId leaves, TriangleId passes = kNoTriangle) {
  const Vec3 segment = target - origin;
  const float distance = length(segment);
  return {origin, segment / distance, 0.0f, distance * (1.0f - kShadowEpsilon), leaves, passes};
}

/// Both ends are moved off their surfaces, and the ray joins the moved ends: one end alone would let light at grazing
/// angles occlude itself.
Ray shadow_ray(const Scene& scene, const SurfacePoint& point, const IncidentLight& light, float grazing_cosine) {
  const Vec3 origin = leave_surface(scene, point, light.wi, grazing_cosine);
  if (!std::isfinite(light.distance)) return {origin, light.wi, 0.0f, INFINITY, point.triangle_id()};
  Vec3 target = point.position + light.wi * light.distance;
  if (light.normal != Vec3{}) target = ray_end(target, light.clearance, light.distance, light.normal, light.wi);
  return ray_between(origin, target, point.triangle_id());
}

/// What passes surfaces that are not opaque, and how many there are.
struct Passage {
  Rgb transmittance{1.0f};
  int surfaces = 0;
};
/// `state` is that of the ray, which starts with that footprint; it passes at most `most_surfaces` of the `blockers`.
Passage transparency_along(const PathContext& context, float footprint, Ray ray, PathState state, int most_surfaces,
                           uint64_t blockers = kAllSets) {
  Passage passage;
  if (!context.accel.has_transparent_surfaces()) return passage;
  state.ray_length = 0.0f;
  const RayCone cone{footprint, context.pixel.angle};
  const Vec3 end = ray.origin + ray.direction * ray.t_max;
  while (const std::optional<Hit> hit = context.accel.intersect_transparent(ray, state.ray_kind, blockers)) {
    if (++passage.surfaces > most_surfaces) return {Rgb(0.0f), passage.surfaces};
    SurfacePoint point = make_surface_point(context.scene, ray, *hit);
    state.ray_length += hit->t;
    set_footprint(point, cone.at(state.ray_length), context.scene, state);
    passage.transmittance *= evaluate_transparency(context.scene, point, state, &context.accel);
    if (is_black(passage.transmittance)) return passage;
    ++state.transparent_depth;
    // Towards the same end, which steps off surfaces would otherwise push on.
    const Vec3 beyond = offset_origin(point.position, point.clearance, point.ng, ray.direction);
    if (std::isfinite(ray.t_max)) {
      ray = ray_between(beyond, end, ray.leaves, point.triangle_id());
    } else {
      ray.origin = beyond;
      ray.passes = point.triangle_id();
    }
  }
  return passage;
}

Ray ray_towards(Vec3 position, TriangleId leaves, const IncidentLight& light) {
  if (!std::isfinite(light.distance)) return {position, light.wi, 0.0f, INFINITY, leaves};
  Vec3 target = position + light.wi * light.distance;
  if (light.normal != Vec3{}) target = ray_end(target, light.clearance, light.distance, light.normal, light.wi);
  return ray_between(position, target, leaves);
}

/// Of a ray from `receiver` to the light, or to a vertex; `grazing_cosine`: see shadow_origin.
Rgb transmittance_of(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                     const PathState& state, int most_surfaces, float grazing_cosine) {
  const Ray ray = shadow_ray(context.scene, receiver, light, grazing_cosine);
  if (context.accel.occluded(ray, state.ray_kind, light.blockers)) return Rgb(0.0f);
  return transparency_along(context, receiver.footprint, ray, state, most_surfaces, light.blockers).transmittance;
}

/// What passes surfaces that are not opaque, and the media along a ray; `state` is that of the ray. Media that begin or
/// end without a surface count for no transparent one, but in case a ray gets stuck at one they are not endless.
Rgb transmittance_along(const PathContext& context, Ray ray, const RayCone& cone, PathState state, int most_surfaces,
                        uint64_t blockers, MediaStack& media, PathSampler& sampler) {
  if (context.accel.occluded(ray, state.ray_kind, blockers)) return Rgb(0.0f);
  const Vec3 end = ray.origin + ray.direction * ray.t_max;
  Rgb result(1.0f);
  BoundaryTrail trail;
  state.ray_length = 0.0f;
  for (int boundaries = 0, surfaces = 0; boundaries <= kMostBoundaries;) {
    std::optional<Hit> hit;
    if (context.accel.has_transparent_surfaces() || context.accel.has_media())
      hit = context.accel.intersect_transparent_or_medium(ray, state.ray_kind, blockers, trail.passed());
    const float begin = trail.begin(), length = std::max((hit ? hit->t : ray.t_max) - begin, 0.0f);
    const SegmentMedia segment = context.media->together(media, state, ray.direction, std::isinf(length));
    result *=
        segment.varies()
            ? estimate_transmittance(
                  {*context.media, segment, state, ray.origin + begin * ray.direction, ray.direction}, length, sampler)
            : medium_transmittance(segment.even, length);
    if (!hit || is_black(result)) return result;
    SurfacePoint point = make_surface_point(context.scene, ray, *hit);
    state.ray_length += hit->t;
    if (context.media->is_boundary(point, state.ray_kind)) {
      ++boundaries;
      ray = context.media->cross(media, trail, ray, hit->t, point);
      state.ray_length -= trail.begin();
    } else {
      if (++surfaces > most_surfaces) return Rgb(0.0f);
      set_footprint(point, cone.at(state.ray_length), context.scene, state);
      result *= evaluate_transparency(context.scene, point, state, &context.accel);
      ++state.transparent_depth;
      context.media->leave(media, context.accel, point, ray.direction, blockers);
      trail.clear();
      ray.origin = offset_origin(point.position, point.clearance, point.ng, ray.direction);
      ray.passes = point.triangle_id();
    }
    if (std::isfinite(ray.t_max)) ray = ray_between(ray.origin, end, ray.leaves, ray.passes);
  }
  return Rgb(0.0f);
}

/// `leave_surface` of several.
Vec3Lanes ray_starts(const Scene& scene, const SurfaceLanes& points, const Vec3Lanes& wi, const LaneMask& is_asked) {
  Lanes side = 1.0f;
  where(!(dot(points.ns, wi) > 0.0f), side) = -1.0f;
  Vec3Lanes starts = points.position + points.ng * (side * points.clearance);
  const LaneMask is_lifted = is_asked && side * dot(points.ng, wi) < 0.0f;
  if (none_of(is_lifted)) return starts;
  for (size_t i = 0; i < kLanes; ++i)
    if (is_lifted[i]) starts.set(i, leave_surface(scene, *points.points[i], wi.at(i), 0.0f));
  return starts;
}

/// From several points to where a ray that leaves the vertex would start.
RayLanes rays_between(const Scene& scene, const SurfaceLanes& points, const Vec3Lanes& wi, const LaneMask& is_asked,
                      const SeenVertex& vertex) {
  const Vec3Lanes starts = ray_starts(scene, points, wi, is_asked), position(vertex.position);
  const Lanes off_surface = vertex.clearance + kEndRounding * length(position - starts);
  const Vec3Lanes segments = position + Vec3Lanes(vertex.normal) * off_surface - starts;
  const Lanes distance = length(segments);
  return {starts, segments * (1.0f / distance), distance * (1.0f - kShadowEpsilon), is_asked, points.leaves};
}

PathState shadow_state(const PathState& path) {
  PathState state = path;
  state.ray_kind = kVisibleToShadow;
  state.is_singular = false;
  ++state.depth;  // as a ray scattered towards the light
  return state;
}

PanePassage past_panes(const PathContext& context, float footprint, const Ray& ray, bool may_turn,
                       const PathState& path) {
  // Where nothing is transparent, most rays are told without looking for panes.
  if (!context.accel.has_transparent_surfaces() && !context.accel.occluded(ray)) return {Rgb(1.0f), 0, ray.direction};
  if (context.accel.occluded_but_for_panes(ray)) return {};
  return pass_panes({context, footprint, ray, path, shadow_state(path)}, may_turn);
}

/// What arrives of a light that is not distant.
PassedLight near_light(const PathContext& context, float footprint, const Ray& ray, const IncidentLight& light,
                       const PathState& path) {
  const PathState shadow = shadow_state(path);
  if (!context.accel.occluded(ray)) {
    const int most_surfaces = context.limits.max_transparent_bounces - path.transparent_depth;
    return {light.radiance * transparency_along(context, footprint, ray, shadow, most_surfaces).transmittance};
  }
  if (context.accel.occluded_but_for_panes(ray)) return {};
  Ray endless = ray;
  endless.t_max = INFINITY;
  const auto find = context.lights.lamp_of(*light.emitter) ? find_lamp_past_panes : find_triangle_past_panes;
  return find(context, {context, footprint, endless, path, shadow}, *light.emitter);
}

/// Behind the last surface it passes, a path has no vertices; see PathLimits.
int most_surfaces_to_vertex(const PathContext& context, int transparent_depth) {
  return std::max(context.limits.max_transparent_bounces - transparent_depth - 1, 0);
}

}  // namespace

PassedLight passed_light(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                         const PathState& path) {
  if (!context.passes_panes || !is_sought_through_panes(light))
    return {light.radiance * transmittance(context, receiver, light, path)};
  const Ray ray = shadow_ray(context.scene, receiver, light, kGrazingCosine);
  if (std::isfinite(light.distance)) return near_light(context, receiver.footprint, ray, light, path);
  const PanePassage passage = past_panes(context, receiver.footprint, ray, light.is_environment, path);
  if (is_black(passage.share)) return {};
  if (is_parallel(light.wi, passage.direction)) return {light.radiance * passage.share, passage.faces};
  return {evaluate_environment(context.scene, passage.direction, shadow_state(path)) * passage.share, passage.faces};
}

bool is_behind_panes(const PathContext& context, Vec3 origin, const IncidentLight& light) {
  const Ray ray = ray_towards(origin, kNoTriangle, light);
  return context.accel.occluded(ray) && !context.accel.occluded_but_for_panes(ray);
}

Rgb transmittance(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                  const PathState& path) {
  const int most_surfaces = context.limits.max_transparent_bounces - path.transparent_depth;
  return transmittance_of(context, receiver, light, shadow_state(path), most_surfaces, kGrazingCosine);
}

Rgb transmittance(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& light,
                  const PathState& path, MediaStack media, PathSampler& sampler) {
  context.media->leave(media, context.accel, receiver, light.wi, light.blockers);
  const int most_surfaces = context.limits.max_transparent_bounces - path.transparent_depth;
  const Ray ray = shadow_ray(context.scene, receiver, light, kGrazingCosine);
  const RayCone cone{receiver.footprint, context.pixel.angle};
  return transmittance_along(context, ray, cone, shadow_state(path), most_surfaces, light.blockers, media, sampler);
}

Rgb transmittance(const PathContext& context, Vec3 position, TriangleId leaves, float footprint,
                  const IncidentLight& light, const PathState& path, MediaStack media, PathSampler& sampler) {
  const int most_surfaces = context.limits.max_transparent_bounces - path.transparent_depth;
  const RayCone cone{footprint, context.pixel.angle};
  return transmittance_along(context, ray_towards(position, leaves, light), cone, shadow_state(path), most_surfaces,
                             light.blockers, media, sampler);
}

Rgb transmittance(const PathContext& context, Vec3 position, TriangleId leaves, float footprint,
                  const IncidentLight& light, const PathState& path) {
  const PathState state = shadow_state(path);
  const Ray ray = ray_towards(position, leaves, light);
  if (context.passes_panes && is_sought_through_panes(light) && std::isinf(light.distance))
    return past_panes(context, footprint, ray, light.is_environment, path).share;
  if (context.accel.occluded(ray, state.ray_kind, light.blockers)) return Rgb(0.0f);
  const int most_surfaces = context.limits.max_transparent_bounces - path.transparent_depth;
  return transparency_along(context, footprint, ray, state, most_surfaces, light.blockers).transmittance;
}

bool may_meet_splats(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& vertex) {
  return context.accel.has_splats() && context.accel.may_meet_splats(shadow_ray(context.scene, receiver, vertex, 0.0f));
}

Rgb transmittance_to_vertex(const PathContext& context, const SurfacePoint& receiver, const IncidentLight& vertex,
                            const PathState& scattered) {
  if (may_meet_splats(context, receiver, vertex)) return Rgb(0.0f);
  return transmittance_of(context, receiver, vertex, scattered,
                          most_surfaces_to_vertex(context, scattered.transparent_depth), 0.0f);
}

void SurfaceLanes::set(size_t lane, const SurfacePoint& point, int depth) {
  points[lane] = &point;
  transparent_depth[lane] = depth;
  position.set(lane, point.position);
  ng.set(lane, point.ng);
  ns.set(lane, point.ns);
  clearance[lane] = point.clearance;
  leaves[lane] = point.triangle_id();
}

RgbLanes transmittance_as_found(const PathContext& context, const SurfaceLanes& points, const Vec3Lanes& wi,
                                const LaneMask& is_asked, const SeenVertex& vertex, const PathState& scattered) {
  const RayLanes rays = rays_between(context.scene, points, wi, is_asked, vertex);
  LaneMask is_clear = is_asked && !context.accel.occluded(rays, scattered.ray_kind);
  if (context.accel.has_splats()) is_clear &= !context.accel.may_meet_splats(rays);
  RgbLanes result(where_or_zero(is_clear, 1.0f));
  if (!context.accel.has_transparent_surfaces()) return result;
  for (size_t i = 0; i < kLanes; ++i) {
    if (!is_clear[i]) continue;
    PathState state = scattered;
    state.transparent_depth = static_cast<uint16_t>(points.transparent_depth[i]);
    const Ray ray{rays.origin.at(i), rays.direction.at(i), 0.0f, rays.t_max[i], rays.leaves[i]};
    const Passage passage = transparency_along(context, points.points[i]->footprint, ray, state,
                                               most_surfaces_to_vertex(context, points.transparent_depth[i]));
    const bool is_as_found = points.transparent_depth[i] + passage.surfaces == scattered.transparent_depth;
    result.set(i, is_as_found ? passage.transmittance : Rgb());
  }
  return result;
}

}  // namespace cistern
