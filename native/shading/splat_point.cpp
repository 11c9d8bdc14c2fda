#include "shading/splat_point.h"

namespace cistern {

SurfacePoint make_splat_point(const Scene& scene, const Ray& ray, const Hit& hit) {
  const Instance& instance = scene.instances[hit.instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  SurfacePoint point;
  point.position = ray.origin + hit.t * ray.direction;
  point.wo = -ray.direction;
  point.instance = hit.instance;
  point.triangle = hit.triangle;
  point.material = scene.material_of(instance, hit.triangle);
  point.ng = normalize_or(hit.normal, point.wo);
  point.is_backface = dot(point.ng, point.wo) < 0.0f;
  if (point.is_backface) point.ng = -point.ng;
  point.ns = point.ng;
  point.is_splat = true;
  const Vec3 middle = mesh.splats->gaussians[hit.triangle].middle;
  point.clearance = surface_clearance(coordinate_reach(instance.object_to_world, {middle, middle, middle}), point.ng);
  return point;
}

bool reads_splat_radiance(const NodeContext& context, int name_index) {
  static const uint32_t kRadiance = attribute_name_hash("radiance");
  return context.has_mesh() && context.mesh().splats &&
         context.program.attribute_hashes[static_cast<size_t>(name_index)] == kRadiance;
}

Vec3 splat_radiance(const NodeContext& context) {
  const Mesh& mesh = context.mesh();
  const Vec3 direction = inverse(context.instance().object_to_world).vector(-context.point.wo);
  return to_vec(
      mesh.splats->colors->radiance(mesh.splats->gaussians[context.point.triangle].splat, normalize_or(direction, {})));
}

}  // namespace cistern
