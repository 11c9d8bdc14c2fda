#include "transport/sheet_ray.h"

#include "accel/offset_origin.h"
#include "scene/surface_sheet.h"
#include "shading/mesh_interpolation.h"

namespace cistern {
namespace {

/// Of rays that arrive at `position` from the eye. As in Cycles, what is seen at a grazing angle is seen from further
/// above, what faces away the more so the more it does, and nothing from behind.
Vec3 direction_from_eye(const Camera& camera, Vec3 position, Vec3 ng, Vec3 ns) {
  constexpr float kLeastCosine = 0.2f, kLeastGeometricCosine = 1e-4f;
  Vec3 to_eye = camera.eye_type == CameraType::ORTHOGRAPHIC
                    ? camera.camera_to_world.column(2)
                    : normalize_or(camera.camera_to_world.translation - position, ns);
  const float cosine = dot(to_eye, ns);
  if (cosine < kLeastCosine) to_eye = normalize_or(to_eye + (kLeastCosine - cosine) * ns, ns);
  if (cosine < 0.0f) to_eye = normalize_or(lerp(to_eye, ns, -cosine), ns);
  const float above = dot(to_eye, ng);
  if (above < kLeastGeometricCosine) to_eye = normalize_or(to_eye + (kLeastGeometricCosine - above) * ng, ng);
  return -to_eye;
}

/// Off edges and corners, where rays that leave the point would start on the far side of the surfaces that meet there:
/// towards the middle of the triangle, by this part of its coordinates, in metres of at least 1.
Vec2 off_edges(Vec2 weights, const std::array<Vec3, 3>& world_corners) {
  constexpr float kShare = 1e-4f;
  const auto [p0, p1, p2] = world_corners;
  const Vec3 position = p0 + weights.x * (p1 - p0) + weights.y * (p2 - p0);
  const Vec3 to_middle = (1.0f / 3.0f) * (p0 + p1 + p2) - position;
  const float reach = std::max({std::abs(position.x), std::abs(position.y), std::abs(position.z), 1.0f});
  const float distance = length(to_middle), step = std::min(kShare * reach, distance);
  if (!(distance > 0.0f)) return weights;
  const float t = step / distance;
  if (std::min({weights.x, weights.y, 1.0f - weights.x - weights.y}) >= t / 3.0f) return weights;
  return {lerp(weights.x, 1.0f / 3.0f, t), lerp(weights.y, 1.0f / 3.0f, t)};
}

}  // namespace

std::optional<SheetRay> sheet_ray(const Scene& scene, size_t pixel, Vec2 offset) {
  const SurfaceSheet& sheet = *scene.camera.sheet;
  const SheetPixel& at = sheet.pixels[pixel];
  if (at.triangle < 0) return std::nullopt;
  const Instance& instance = scene.instances[sheet.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  const auto triangle = static_cast<uint32_t>(at.triangle);
  const std::array<Vec3, 3> corners = mesh.triangle_positions(triangle);
  const Transform& to_world = instance.object_to_world;
  const Vec2 weights = off_edges(inside_triangle(at.weights + offset.x * at.along_x + offset.y * at.along_y),
                                 {to_world.point(corners[0]), to_world.point(corners[1]), to_world.point(corners[2])});

  SheetRay out;
  out.hit.normal = transform_normal(to_world, cross(corners[1] - corners[0], corners[2] - corners[0]));
  out.hit.u = weights.x, out.hit.v = weights.y;
  out.hit.instance = sheet.instance, out.hit.triangle = triangle;
  out.ray.direction = -normalize_or(out.hit.normal, {0.0f, 0.0f, 1.0f});
  const SurfacePoint point = make_surface_point(scene, out.ray, out.hit);
  out.ray.direction = scene.camera.sees_sheet_from_eye
                          ? direction_from_eye(scene.camera, point.position, point.ng, point.ns)
                          : -point.ns;
  out.ray.origin = offset_origin(point.position, point.clearance, point.ng, -out.ray.direction);
  out.hit.t = length(point.position - out.ray.origin);
  return out;
}

}  // namespace cistern
