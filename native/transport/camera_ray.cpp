#include "transport/camera_ray.h"

#include "base/warp.h"
#include "scene/panorama.h"

namespace cistern {

Vec2 sample_aperture(const Camera& camera, Vec2 u) {
  Vec2 p;
  if (camera.blades < 3) {
    p = square_to_disk(u);
  } else {
    const auto blades = static_cast<float>(camera.blades);
    const float scaled = u.x * blades;
    const float blade = std::min(std::floor(scaled), blades - 1.0f);
    const float angle = 2.0f * kPi / blades;
    const Vec2 b = square_to_triangle({std::min(scaled - blade, kOneMinusEpsilon), u.y});
    const float a0 = (blade - 0.5f) * angle + camera.blade_rotation, a1 = a0 + angle;
    p = b.x * Vec2{std::cos(a0), std::sin(a0)} + b.y * Vec2{std::cos(a1), std::sin(a1)};
  }
  return {p.x / camera.aperture_ratio, p.y};
}

namespace {

Vec2 to_window(const Camera& camera, Vec2 film_position) {
  return {lerp(camera.left, camera.right, film_position.x), lerp(camera.bottom, camera.top, film_position.y)};
}

Vec2 from_window(const Camera& camera, Vec2 p) {
  return {(p.x - camera.left) / (camera.right - camera.left), (p.y - camera.bottom) / (camera.top - camera.bottom)};
}

/// [Cycles] A lens across each direction, in focus on a sphere.
Ray panoramic_ray(const Camera& camera, Vec2 film_position, Vec2 u_lens) {
  const std::optional<Vec3> seen = panorama_direction(camera.panorama, to_window(camera, film_position));
  if (!seen) return kSeesNothing;
  Vec3 origin, direction = *seen;
  if (camera.aperture_radius > 0.0f) {
    const Vec3 side = normalize_or(Vec3{1.0f, 0.0f, 0.0f} - direction.x * direction, {0.0f, 1.0f, 0.0f});
    const Vec2 lens = sample_aperture(camera, u_lens) * camera.aperture_radius;
    origin = lens.x * side + lens.y * cross(side, direction);
    direction = normalize(camera.focus_distance * direction - origin);
  }
  return {camera.camera_to_world.point(origin), normalize(camera.camera_to_world.vector(direction)), camera.clip_start,
          camera.clip_end};
}

}  // namespace

Ray camera_ray(const Camera& camera, Vec2 film_position, Vec2 u_lens) {
  if (camera.type == CameraType::SHEET) return kSeesNothing;
  if (camera.type == CameraType::PANORAMIC) return panoramic_ray(camera, film_position, u_lens);
  const auto [x, y] = to_window(camera, film_position);
  const bool perspective = camera.type == CameraType::PERSPECTIVE;
  Vec3 origin = perspective ? Vec3{} : Vec3{x, y, 0.0f};
  Vec3 direction = perspective ? Vec3{x, y, -1.0f} : Vec3{0.0f, 0.0f, -1.0f};
  if (camera.aperture_radius > 0.0f) {
    const Vec3 focus = origin + direction * camera.focus_distance;
    const Vec2 lens = sample_aperture(camera, u_lens) * camera.aperture_radius;
    origin += Vec3{lens.x, lens.y, 0.0f};
    direction = (focus - origin) / camera.focus_distance;  // its z stays -1
  }
  const float per_depth = length(direction);  // ray length for one unit of depth
  Ray ray;
  ray.origin = camera.camera_to_world.point(origin);
  ray.direction = normalize(camera.camera_to_world.vector(direction));
  ray.t_min = camera.clip_start * per_depth;
  ray.t_max = camera.clip_end * per_depth;
  return ray;
}

std::optional<Vec2> project(const Camera& camera, Vec3 position) {
  if (camera.type == CameraType::SHEET) return std::nullopt;
  const Vec3 offset = position - camera.camera_to_world.translation;
  if (camera.type == CameraType::PANORAMIC) {
    const Transform& axes = camera.camera_to_world;
    const Vec3 local{dot(axes.column(0), offset), dot(axes.column(1), offset), dot(axes.column(2), offset)};
    if (!(length_squared(local) > 0.0f)) return std::nullopt;
    const std::optional<Vec2> position_in_frame = panorama_position(camera.panorama, normalize(local));
    return position_in_frame ? std::optional(from_window(camera, *position_in_frame)) : std::nullopt;
  }
  const float depth = camera_depth(camera, position);
  if (!(depth > 0.0f)) return std::nullopt;
  const float scale = camera.type == CameraType::PERSPECTIVE ? 1.0f / depth : 1.0f;
  const float x = dot(camera.camera_to_world.column(0), offset) * scale;
  const float y = dot(camera.camera_to_world.column(1), offset) * scale;
  return from_window(camera, {x, y});
}

float camera_depth(const Camera& camera, Vec3 position) {
  if (camera.type == CameraType::PANORAMIC) return length(position - camera.camera_to_world.translation);
  return -dot(camera.camera_to_world.column(2), position - camera.camera_to_world.translation);
}

}  // namespace cistern
