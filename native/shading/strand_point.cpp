#include "shading/strand_point.h"

#include "scene/strand_curve.h"

namespace cistern {
namespace {

/// Of the radius, off the surface. Embree finds curves by iteration, whose errors are in proportion to the radius, and
/// balls exactly.
constexpr float kClearance = 0.02f, kClearanceOfBalls = 1e-4f;

}  // namespace

SurfacePoint make_strand_point(const Scene& scene, const Ray& ray, const Hit& hit) {
  const Instance& instance = scene.instances[hit.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  const StrandSegment segment = strand_segment(mesh, hit.triangle);
  const Transform to_object = inverse(instance.object_to_world);
  const Vec3 center = segment.center(hit.u);
  const Vec3 found = to_object.point(ray.origin + hit.t * ray.direction);
  const Vec3 towards_eye = normalize_or(to_object.vector(-ray.direction), {0.0f, 0.0f, 1.0f});
  const Vec3 outward = normalize_or(found - center, towards_eye);

  SurfacePoint point;
  // The ray's end is accurate only to the length of the ray, the middle of the strand to the size of its object.
  const Vec3 offset = instance.object_to_world.vector(segment.radius(hit.u) * outward);
  point.position = instance.object_to_world.point(center) + offset;
  point.wo = -ray.direction;
  point.barycentric = {hit.u, 0.0f};
  point.instance = hit.instance;
  point.triangle = hit.triangle;
  point.material = scene.material_of(instance, hit.triangle);
  point.ng = normalize_or(to_object.transposed_vector(outward), point.wo);
  if (dot(point.ng, point.wo) < 0.0f) point.ng = normalize_or(hit.normal, point.wo);  // by rounding at the rim
  if (dot(point.ng, point.wo) < 0.0f) point.ng = point.wo;
  point.ns = point.ng;
  const std::array<Vec3, 3> ends{segment.positions[1], segment.positions[2], center};
  point.is_strand = mesh.strand_shape != StrandShape::BALLS;
  const float clearance = point.is_strand ? kClearance : kClearanceOfBalls;
  point.clearance =
      surface_clearance(coordinate_reach(instance.object_to_world, ends), point.ng) + clearance * length(offset);
  return point;
}

}  // namespace cistern
