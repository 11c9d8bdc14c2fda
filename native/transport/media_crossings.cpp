#include "transport/media_crossings.h"

#include <algorithm>
#include <tuple>

#include "transport/media.h"

namespace cistern {
namespace {

/// Rays in the plane of a boundary would be at the same place forever.
constexpr float kLeastCosine = 1e-3f;
/// Of what counts as the same place: how far back a ray starts that goes on, and how much farther than where rays that
/// leave a surface start they look.
constexpr float kMargin = 0.5f;
/// Boundaries that a search for the media around a point passes at most.
constexpr int kMostCrossed = 1024;

bool contains(const Bounds3& b, Vec3 p) {
  return p.x >= b.lower.x && p.y >= b.lower.y && p.z >= b.lower.z && p.x <= b.upper.x && p.y <= b.upper.y &&
         p.z <= b.upper.z;
}

/// Length along a ray over which it is as near to the surface that it meets at `point` as rays that leave it.
float length_near(const SurfacePoint& point, Vec3 direction) {
  return point.clearance / std::max(std::abs(dot(point.ng, direction)), kLeastCosine);
}

/// Of a ray that goes through the surface from the side that `point` shows.
bool enters(const SurfacePoint& point) { return !point.is_backface; }

}  // namespace

Ray Media::cross(MediaStack& stack, BoundaryTrail& trail, const Ray& ray, float distance,
                 const SurfacePoint& point) const {
  const float near = length_near(point, ray.direction);
  const bool is_same_place = trail.is_same_place(distance, near);
  // Triangles without a medium are those that such rays do not see, of an object that has one elsewhere.
  if (has_medium(point.instance, point.material))
    trail.cross({point.instance, point.material}, enters(point), is_same_place, stack);
  trail.pass({point.instance, point.triangle}, is_same_place);
  const float back = trail.is_full() ? -near : kMargin * near;
  trail.go_on_from(std::max(back, 0.0f));
  Ray behind = ray;
  behind.origin = point.position - back * ray.direction;
  behind.t_min = 0.0f;
  behind.t_max = ray.t_max - distance + back;
  return behind;
}

void Media::leave(MediaStack& stack, const Accel& accel, const SurfacePoint& point, Vec3 direction,
                  uint64_t blockers) const {
  if (!accel.has_media()) return;
  const bool passes = dot(point.ng, direction) < 0.0f;
  const Vec3 side = passes ? -point.ng : point.ng;
  const Ray way{point.position - kMargin * point.clearance * side, side, 0.0f,
                (1.0f + 2.0f * kMargin) * point.clearance};
  HitList found = accel.media_along(way, blockers);
  std::ranges::sort(std::span(found.hits.data(), found.count), {},
                    [](const Hit& hit) { return std::tuple(hit.t, hit.instance, hit.triangle); });
  // What the point itself begins or ends counts where the ray passes, even if the search misses it by rounding.
  const MediaStack::Entry own{point.instance, point.material};
  MediaCrossings here;
  if (passes && has_medium(own.instance, own.material)) here.add(own, enters(point));
  for (const Hit& hit : found.all()) {
    const MediaStack::Entry medium{hit.instance, scene_.material_of(scene_.instances[hit.instance], hit.triangle)};
    const bool is_point = hit.instance == point.instance && hit.triangle == point.triangle;
    if (is_point || (!passes && medium == own) || !has_medium(medium.instance, medium.material)) continue;
    here.add(medium, dot(hit.normal, side) < 0.0f);
  }
  here.apply(stack);
}

/// By a ray to the outside of all that could contain the point: media that it leaves without having entered them.
MediaStack Media::around(const Accel& accel, Vec3 origin) const {
  MediaStack inside, entered, ignored;
  float reach = 0.0f;
  for (const Volume& volume : volumes_)
    if (contains(volume.bounds, origin)) reach = std::max(reach, length(volume.bounds.diagonal()));
  if (reach == 0.0f) return inside;
  BoundaryTrail trail;
  MediaCrossings here;
  const auto go_on = [&] {
    for (const auto& [medium, net] : here) {
      if (net > 0) entered.enter(medium);
      if (net < 0 && !entered.contains(medium)) inside.enter(medium);
    }
    here.clear();
  };
  // Along no axis and no diagonal, which edges of meshes lie on.
  Ray ray{origin, normalize(Vec3{0.2113f, 0.1357f, 0.9681f}), 0.0f, reach};
  for (int i = 0; i < kMostCrossed; ++i) {
    const std::optional<Hit> hit = accel.intersect_or_medium(ray, 0, trail.passed());
    if (!hit) break;
    const SurfacePoint point = make_surface_point(scene_, ray, *hit);
    if (!trail.is_same_place(hit->t, length_near(point, ray.direction))) go_on();
    if (has_medium(point.instance, point.material)) here.add({point.instance, point.material}, enters(point));
    ray = cross(ignored, trail, ray, hit->t, point);
  }
  go_on();
  return inside;
}

}  // namespace cistern
