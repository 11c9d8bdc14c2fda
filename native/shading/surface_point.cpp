#include "shading/surface_point.h"

#include <bit>

#include "base/hash.h"
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

uint32_t place_hash(const SurfacePoint& point) {
  const auto pair = [](float a, float b) {
    return (uint64_t{std::bit_cast<uint32_t>(a)} << 32) | std::bit_cast<uint32_t>(b);
  };
  const uint64_t place = hash_combine(pair(point.position.x, point.position.y),
                                      (uint64_t{std::bit_cast<uint32_t>(point.position.z)} << 32) | point.triangle);
  return static_cast<uint32_t>(hash_combine(place, pair(point.barycentric.x, point.barycentric.y)) >> 32);
}

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
  if (!mesh.is_flat(hit.triangle)) {
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

std::optional<TangentFrame> tangent_frame(const Scene& scene, const SurfacePoint& point, int attribute,
                                          bool is_of_original) {
  const Instance& instance = scene.instances[point.instance];
  const CornerTangents* corners = scene.find_tangents(instance.mesh, attribute, is_of_original);
  if (corners == nullptr) return std::nullopt;
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  const Mesh& shape = is_of_original ? mesh.original() : mesh;
  const Vec3 outside = point.is_backface ? -point.ng : point.ng;
  TangentFrame frame;
  frame.normal = shape.is_flat(point.triangle) ? normalize_or(instance.object_to_world.transposed_vector(outside), {})
                                               : blend_normals(shape, point.triangle, point.barycentric);
  frame.tangent = corners->tangent(point.triangle, point.barycentric);
  frame.bitangent = corners->handedness(point.triangle, point.barycentric) * cross(frame.normal, frame.tangent);
  return frame;
}

AttributeValue surface_attribute(const Scene& scene, const SurfacePoint& point, int index) {
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(scene.instances[point.instance].mesh)];
  return interpolate_attribute(mesh, point.triangle, point.barycentric, index);
}

}  // namespace cistern
