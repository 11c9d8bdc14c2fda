#include "transport/sheet_ray.h"

#include "accel/offset_origin.h"
#include "scene/surface_sheet.h"
#include "shading/mesh_interpolation.h"

namespace cistern {
namespace {

/// Of rays that arrive at `position`. What is seen at a grazing angle, or from behind, is seen from further above.
Vec3 direction_onto(const Camera& camera, Vec3 position, Vec3 normal) {
  constexpr float kLeastCosine = 0.4f;  // as in Cycles
  if (!camera.sees_sheet_from_eye) return -normal;
  const Vec3 to_eye = camera.is_parallel ? camera.camera_to_world.column(2)
                                         : normalize_or(camera.camera_to_world.translation - position, normal);
  const float below = kLeastCosine - dot(to_eye, normal);
  return below > 0.0f ? -normalize_or(to_eye + below * normal, normal) : -to_eye;
}

Vec3 shading_normal(const Mesh& mesh, const Instance& instance, uint32_t triangle, Vec2 weights, Vec3 ng) {
  if (mesh.normals_domain == Domain::FACE || mesh.normals.empty()) return ng;
  return normalize_or(transform_normal(instance.object_to_world, blend_normals(mesh, triangle, weights)), ng);
}

}  // namespace

std::optional<SheetRay> sheet_ray(const Scene& scene, size_t pixel, Vec2 offset) {
  const SurfaceSheet& sheet = *scene.camera.sheet;
  const SheetPixel& at = sheet.pixels[pixel];
  if (at.triangle < 0) return std::nullopt;
  const Instance& instance = scene.instances[sheet.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  const auto triangle = static_cast<uint32_t>(at.triangle);
  const Vec2 weights = inside_triangle(at.weights + offset.x * at.along_x + offset.y * at.along_y);
  const std::array<Vec3, 3> corners = mesh.triangle_positions(triangle);

  SheetRay out;
  out.hit.normal = transform_normal(instance.object_to_world, cross(corners[1] - corners[0], corners[2] - corners[0]));
  out.hit.u = weights.x, out.hit.v = weights.y;
  out.hit.instance = sheet.instance, out.hit.triangle = triangle;
  const Vec3 position = instance.object_to_world.point(interpolate_position(mesh, triangle, weights));
  const Vec3 ng = normalize_or(out.hit.normal, {0.0f, 0.0f, 1.0f});
  const Vec3 ns = shading_normal(mesh, instance, triangle, weights, ng);
  out.ray.direction = direction_onto(scene.camera, position, ns);
  const float clearance = surface_clearance(coordinate_reach(instance.object_to_world, corners), ng);
  out.ray.origin = offset_origin(position, clearance, ng, -out.ray.direction);
  out.ray.t_min = 0.0f, out.ray.t_max = INFINITY;
  out.hit.t = length(position - out.ray.origin);
  return out;
}

}  // namespace cistern
