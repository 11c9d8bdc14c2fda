#include "shading/surface_point.h"

#include "scene/triangle_weights.h"
#include "shading/mesh_interpolation.h"
#include "shading/splat_point.h"
#include "shading/strand_point.h"

namespace cistern {
namespace {

struct WorldTriangle {
  Vec3 p0, edge_1, edge_2;
};

WorldTriangle world_triangle(const Mesh& mesh, const Instance& instance, uint32_t triangle) {
  const std::array<Vec3, 3> vertices = mesh.triangle_positions(triangle);
  const Vec3 p0 = instance.object_to_world.point(vertices[0]);
  return {p0, instance.object_to_world.point(vertices[1]) - p0, instance.object_to_world.point(vertices[2]) - p0};
}

}  // namespace

SurfacePoint make_surface_point(const Scene& scene, const Ray& ray, const Hit& hit) {
  const Instance& instance = scene.instances[hit.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  if (mesh.is_strands()) return mesh.splats ? make_splat_point(scene, ray, hit) : make_strand_point(scene, ray, hit);

  SurfacePoint point;
  // Interpolating vertices is accurate to the size of the triangle; origin + t * direction only to the ray's length.
  point.position = instance.object_to_world.point(interpolate_position(mesh, hit.triangle, {hit.u, hit.v}));
  point.wo = -ray.direction;
  point.barycentric = {hit.u, hit.v};
  point.instance = hit.instance;
  point.triangle = hit.triangle;
  point.material = scene.material_of(instance, hit.triangle);

  point.ng = normalize_or(hit.normal, point.wo);
  point.ns = point.ng;
  if (mesh.normals_domain != Domain::FACE && !mesh.normals.empty()) {
    point.ns = normalize_or(blend_world_normals(mesh, instance, hit.triangle, point.barycentric), point.ng);
  }
  point.is_backface = dot(point.ng, point.wo) < 0.0f;
  if (point.is_backface) {
    point.ng = -point.ng;
    point.ns = -point.ns;
  }
  point.clearance =
      surface_clearance(coordinate_reach(instance.object_to_world, mesh.triangle_positions(hit.triangle)), point.ng);
  return point;
}

Vec2 shifted_barycentric(const Scene& scene, const SurfacePoint& point, BumpShift shift) {
  if (shift.step == 0 || point.footprint == 0.0f) return point.barycentric;
  const Instance& instance = scene.instances[point.instance];
  const WorldTriangle t = world_triangle(*scene.meshes[static_cast<size_t>(instance.mesh)], instance, point.triangle);
  const Vec3 step = footprint_step(point, shift);
  return point.barycentric + weight_step(t.edge_1, t.edge_2, point.is_backface ? -step : step);
}

Frame bump_axes(const SurfacePoint& point) {
  const Vec3 s = normalize_or(cross(Vec3{1.0f, 1.0f, 1.0f}, point.ng), {});
  if (s == Vec3{}) return Frame(point.ng);
  return {s, cross(point.ng, s), point.ng};
}

Vec3 footprint_step(const SurfacePoint& point, BumpShift shift) {
  if (shift.step == 0) return {};
  const Frame axes = bump_axes(point);
  return shift.width * point.footprint * (shift.step == 1 ? axes.s : axes.t);
}

namespace {

/// Of a triangle of `mesh` that lies as it does in `shape`; `normal`: of the frame, in object space.
std::optional<TangentFrame> frame_on(const Mesh& mesh, const Mesh& shape, uint32_t triangle, int attribute,
                                     Vec3 normal) {
  const Vec3 uv0 = interpolate_attribute(mesh, triangle, {0.0f, 0.0f}, attribute).value;
  const Vec3 duv1 = interpolate_attribute(mesh, triangle, {1.0f, 0.0f}, attribute).value - uv0;
  const Vec3 duv2 = interpolate_attribute(mesh, triangle, {0.0f, 1.0f}, attribute).value - uv0;
  const float determinant = duv1.x * duv2.y - duv2.x * duv1.y;
  if (determinant == 0.0f || !std::isfinite(determinant)) return std::nullopt;

  const auto [p0, p1, p2] = shape.triangle_positions(triangle);
  const Vec3 edge_1 = p1 - p0, edge_2 = p2 - p0;
  const float sign = determinant < 0.0f ? -1.0f : 1.0f;  // lengths do not matter, signs do
  const Vec3 dp_du = sign * (duv2.y * edge_1 - duv1.y * edge_2);
  const Vec3 dp_dv = sign * (duv1.x * edge_2 - duv2.x * edge_1);
  TangentFrame frame;
  frame.normal = normal;
  frame.tangent = normalize_or(dp_du - dot(dp_du, frame.normal) * frame.normal, {});
  if (frame.normal == Vec3{} || frame.tangent == Vec3{}) return std::nullopt;
  const Vec3 across = cross(frame.normal, frame.tangent);
  frame.bitangent = dot(across, dp_dv) < 0.0f ? -across : across;
  return frame;
}

/// Shading normal on the outside of the object, in its space.
Vec3 outer_normal(const Mesh& mesh, const Instance& instance, const SurfacePoint& point) {
  if (instance.blends_world_normals && mesh.normals_domain != Domain::FACE && !mesh.normals.empty())
    return normalize_or(blend_normals(mesh, point.triangle, point.barycentric), {});
  const Vec3 outside = point.is_backface ? -point.ns : point.ns;
  return normalize_or(instance.object_to_world.transposed_vector(outside), {});
}

}  // namespace

std::optional<TangentFrame> tangent_frame(const Scene& scene, const SurfacePoint& point, int attribute) {
  if (attribute < 0) return std::nullopt;
  const Instance& instance = scene.instances[point.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  return frame_on(mesh, mesh, point.triangle, attribute, outer_normal(mesh, instance, point));
}

std::optional<TangentFrame> mesh_tangent_frame(const Scene& scene, const SurfacePoint& point, int attribute,
                                               bool is_original) {
  const Instance& instance = scene.instances[point.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  if (attribute < 0 || !mesh.undisplaced) return tangent_frame(scene, point, attribute);
  const Mesh& shape = is_original ? *mesh.undisplaced : mesh;
  const bool is_flat = shape.normals_domain == Domain::FACE;
  const Vec3 outside = point.is_backface ? -point.ng : point.ng;
  const Vec3 normal = is_flat ? normalize_or(instance.object_to_world.transposed_vector(outside), {})
                              : normalize_or(blend_normals(shape, point.triangle, point.barycentric), {});
  return frame_on(mesh, shape, point.triangle, attribute, normal);
}

AttributeValue surface_attribute(const Scene& scene, const SurfacePoint& point, int index) {
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(scene.instances[point.instance].mesh)];
  return interpolate_attribute(mesh, point.triangle, point.barycentric, index);
}

}  // namespace cistern
