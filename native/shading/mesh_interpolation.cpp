#include "shading/mesh_interpolation.h"

#include "scene/strand_curve.h"

namespace cistern {
namespace {

Vec3 triangle_normal(const Mesh& mesh, uint32_t triangle) {
  const auto [p0, p1, p2] = mesh.triangle_positions(triangle);
  return cross(p1 - p0, p2 - p0);
}

}  // namespace

Vec3 interpolate_position(const Mesh& mesh, uint32_t triangle, Vec2 barycentric) {
  if (mesh.is_strands()) return strand_segment(mesh, triangle).center(barycentric.x);
  const auto [p0, p1, p2] = mesh.triangle_positions(triangle);
  const float w = 1.0f - barycentric.x - barycentric.y;
  return w * p0 + barycentric.x * p1 + barycentric.y * p2;
}

Vec3 blend_normals(const Mesh& mesh, uint32_t triangle, Vec2 barycentric) {
  const TriangleIndices e = mesh.elements(triangle, mesh.normals_domain);
  const float w = 1.0f - barycentric.x - barycentric.y;
  return w * decode_octahedral(mesh.normals[e[0]]) + barycentric.x * decode_octahedral(mesh.normals[e[1]]) +
         barycentric.y * decode_octahedral(mesh.normals[e[2]]);
}

Vec3 blend_world_normals(const Mesh& mesh, const Instance& instance, uint32_t triangle, Vec2 barycentric) {
  if (!instance.blends_world_normals)
    return transform_normal(instance.object_to_world, blend_normals(mesh, triangle, barycentric));
  const TriangleIndices e = mesh.elements(triangle, mesh.normals_domain);
  const std::array<float, 3> weights{1.0f - barycentric.x - barycentric.y, barycentric.x, barycentric.y};
  Vec3 sum;
  for (size_t j = 0; j < 3; ++j)
    sum += weights[j] *
           normalize_or(transform_normal(instance.object_to_world, decode_octahedral(mesh.normals[e[j]])), {});
  return sum;
}

Vec3 interpolate_normal(const Mesh& mesh, uint32_t triangle, Vec2 barycentric) {
  const Vec3 flat = triangle_normal(mesh, triangle);
  const Vec3 n = mesh.is_flat(triangle) ? flat : blend_normals(mesh, triangle, barycentric);
  return normalize_or(n, normalize_or(flat, {0.0f, 0.0f, 1.0f}));
}

AttributeValue interpolate_attribute(const Mesh& mesh, uint32_t triangle, Vec2 barycentric, int index) {
  const MeshAttribute& attribute = mesh.attributes[static_cast<size_t>(index)];
  const TriangleIndices e = mesh.elements(triangle, attribute.domain);
  const size_t stride = static_cast<size_t>(attribute.components);
  const float* a = attribute.values.get() + stride * e[0];
  const float* b = attribute.values.get() + stride * e[1];
  const float* c = attribute.values.get() + stride * e[2];
  const float w = 1.0f - barycentric.x - barycentric.y;
  const auto component = [&](size_t i) { return w * a[i] + barycentric.x * b[i] + barycentric.y * c[i]; };
  AttributeValue result;
  result.value.x = component(0);
  if (stride == 1) {
    result.value = {result.value.x, result.value.x, result.value.x};
    return result;
  }
  result.value.y = component(1);
  if (stride > 2) result.value.z = component(2);
  if (stride > 3) result.alpha = component(3);
  return result;
}

}  // namespace cistern
