#include "shading/shadow_origin.h"

#include <algorithm>
#include <array>

#include "shading/mesh_interpolation.h"

namespace cistern {
namespace {

/// A triangle with a vertex normal farther from its own than this is no part of a smooth surface, but a face of a cube.
constexpr float kSmoothCosine = 0.85f;

/// From the point to the mean, weighted as the point is, of its projections on the tangent planes of the vertices; or,
/// where that is higher, as high along the normal as it can lie below all these planes, each raised to the highest
/// vertex: a hollow triangle lies in front of the smooth surface, and what passes its vertices shall pass it, too. That
/// height is at most what a grazing ray gains along the shortest edge, so that nothing beside the surface is stepped
/// over. What is outside: +1 the side of the stored normals, -1 the other. A plane that the point lies outside of
/// leaves it there.
Vec3 lift(const Scene& scene, const SurfacePoint& point, float outwards) {
  constexpr std::array<Vec2, 3> kVertices{Vec2{0.0f, 0.0f}, Vec2{1.0f, 0.0f}, Vec2{0.0f, 1.0f}};
  const Instance& instance = scene.instances[point.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  const Vec2 b = point.barycentric;
  const std::array<float, 3> weights{1.0f - b.x - b.y, b.x, b.y};
  std::array<Vec3, 3> vertices;
  for (size_t i = 0; i < 3; ++i)
    vertices[i] = instance.object_to_world.point(interpolate_position(mesh, point.triangle, kVertices[i]));
  Vec3 sum, normal;
  float hollow = kGrazingCosine * std::sqrt(std::min({length_squared(vertices[1] - vertices[0]),
                                                      length_squared(vertices[2] - vertices[1]),
                                                      length_squared(vertices[0] - vertices[2])}));
  for (size_t i = 0; i < 3; ++i) {
    const Vec3 stored = interpolate_normal(mesh, point.triangle, kVertices[i]);
    const Vec3 n = outwards * normalize_or(transform_normal(instance.object_to_world, stored), {});
    const float below = dot(vertices[i] - point.position, n);
    if (std::abs(dot(n, point.ng)) < kSmoothCosine) hollow = 0.0f;
    float raised = 0.0f;
    for (const Vec3& vertex : vertices) raised = std::max(raised, dot(vertex - vertices[i], n));
    hollow = std::min(hollow, below + raised);
    normal += weights[i] * n;
    sum += (weights[i] * std::max(below, 0.0f)) * n;
  }
  normal = normalize_or(normal, {});
  return sum + std::max(hollow - dot(sum, normal), 0.0f) * normal;
}

}  // namespace

ShadowOrigin shadow_origin(const Scene& scene, const SurfacePoint& point, const Vec3& wi, float grazing_cosine) {
  const bool is_above = dot(point.ns, wi) > 0.0f;
  const Vec3 side = is_above ? point.ng : -point.ng;
  const float cosine = dot(side, wi);
  const float amount = cosine < 0.0f ? 1.0f : (cosine < grazing_cosine ? 1.0f - cosine / grazing_cosine : 0.0f);
  if (!(amount > 0.0f) || point.ns == point.ng) return {point.position, side};
  return {point.position + amount * lift(scene, point, is_above == point.is_backface ? -1.0f : 1.0f), side};
}

}  // namespace cistern
