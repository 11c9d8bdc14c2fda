#include "accel/splat_geometry.h"

#include <bit>
#include <cmath>

#include "accel/accel.h"
#include "base/hash.h"

namespace cistern {
namespace {

const Gaussian* gaussians_of(const void* user_data) { return static_cast<const Gaussian*>(user_data); }

/// Below this no hash is.
constexpr float kLeastChance = 0x1p-24f;

/// In standard deviations: where the chance is no more than that.
float reach_of(float opacity) { return std::sqrt(2.0f * std::log(opacity * (1.0f / kLeastChance))); }

float hash_of(Vec3 place, uint32_t splat) {
  const auto bits = [](float x) { return uint64_t{std::bit_cast<uint32_t>(x)}; };
  const uint64_t hash = hash_combine(bits(place.x) | bits(place.y) << 32, bits(place.z) | uint64_t{splat} << 32);
  return to_unit_float(static_cast<uint32_t>(hash >> 32));
}

/// Distance along the ray of a splat that it meets; NaN where it does not. Distances are in lengths of the direction.
float distance_to(const Gaussian& gaussian, const Ray& ray) {
  const Vec3 from_middle = ray.origin - gaussian.middle;
  const Vec3 origin = gaussian.in_deviations(from_middle), direction = gaussian.in_deviations(ray.direction);
  const float t = -dot(origin, direction) / dot(direction, direction);
  if (!(t >= ray.t_min && t <= ray.t_max)) return NAN;
  const Vec3 closest = origin + t * direction;
  const float hash = hash_of(ray.origin + t * ray.direction, gaussian.splat);
  const float chance = gaussian.opacity * std::exp(-0.5f * dot(closest, closest));
  if (!(chance > kLeastChance && hash < chance)) return NAN;
  const float length2 = dot(ray.direction, ray.direction), along = dot(from_middle, ray.direction);
  const bool is_within =
      dot(from_middle, from_middle) * length2 - along * along <= gaussian.radius * gaussian.radius * length2;
  return is_within ? t : NAN;
}

Ray ray_of(RTCRayN* rays, unsigned n, unsigned i) {
  return {{RTCRayN_org_x(rays, n, i), RTCRayN_org_y(rays, n, i), RTCRayN_org_z(rays, n, i)},
          {RTCRayN_dir_x(rays, n, i), RTCRayN_dir_y(rays, n, i), RTCRayN_dir_z(rays, n, i)},
          RTCRayN_tnear(rays, n, i),
          RTCRayN_tfar(rays, n, i),
          {RTCRayN_flags(rays, n, i), RTCRayN_id(rays, n, i)}};
}

/// As above, for ray `i`; NaN also for the splat that it leaves.
float distance_to(const Gaussian* gaussians, uint32_t segment, unsigned instance, RTCRayN* rays, unsigned n,
                  unsigned i) {
  const Ray ray = ray_of(rays, n, i);
  return ray.leaves == TriangleId{instance, segment} ? NAN : distance_to(gaussians[segment], ray);
}

RTCHit make_hit(const Gaussian* gaussians, uint32_t segment, unsigned geometry, unsigned instance) {
  const Vec3 normal = gaussians[segment].normal();
  RTCHit hit;
  hit.Ng_x = normal.x;
  hit.Ng_y = normal.y;
  hit.Ng_z = normal.z;
  hit.u = hit.v = 0.0f;
  hit.primID = segment;
  hit.geomID = geometry;
  hit.instID[0] = instance;
  return hit;
}

/// Whether filters count a hit that is the ray's end now.
template <class Arguments>
bool counts(void (*filter)(const Arguments*, const RTCFilterFunctionNArguments*), const Arguments* arguments,
            RTCRay& ray, RTCHit& hit) {
  int valid = -1;
  const RTCFilterFunctionNArguments filtered{&valid,
                                             arguments->geometryUserPtr,
                                             arguments->context,
                                             reinterpret_cast<RTCRayN*>(&ray),
                                             reinterpret_cast<RTCHitN*>(&hit),
                                             1};
  filter(arguments, &filtered);
  return valid == -1;
}

void bounds_of(const RTCBoundsFunctionArguments* arguments) {
  const Gaussian& gaussian = gaussians_of(arguments->geometryUserPtr)[arguments->primID];
  const Vec3 middle = gaussian.middle;
  const float reach = reach_of(gaussian.opacity);
  // Rows are axes over deviations: axes times deviations are rows over the squares of their lengths.
  const auto half_width = [&](int axis) {
    float sum = 0.0f;
    for (const Vec3 row : {gaussian.row_x, gaussian.row_y, gaussian.row_z}) {
      const float side = row[axis] / dot(row, row);
      sum += side * side;
    }
    return std::min(reach * std::sqrt(sum), gaussian.radius) * 1.0001f;
  };
  const Vec3 half{half_width(0), half_width(1), half_width(2)};
  RTCBounds& bounds = *arguments->bounds_o;
  bounds.lower_x = middle.x - half.x;
  bounds.lower_y = middle.y - half.y;
  bounds.lower_z = middle.z - half.z;
  bounds.upper_x = middle.x + half.x;
  bounds.upper_y = middle.y + half.y;
  bounds.upper_z = middle.z + half.z;
}

void intersect(const RTCIntersectFunctionNArguments* arguments) {
  const Gaussian* const gaussians = gaussians_of(arguments->geometryUserPtr);
  const unsigned n = arguments->N, instance = arguments->context->instID[0];
  RTCRayN* const rays = RTCRayHitN_RayN(arguments->rayhit, n);
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] != -1) continue;
    const float t = distance_to(gaussians, arguments->primID, instance, rays, n, i);
    if (std::isnan(t)) continue;
    RTCHit hit = make_hit(gaussians, arguments->primID, arguments->geomID, instance);
    RTCRay ray = rtcGetRayFromRayN(rays, n, i);
    ray.tfar = t;
    if (!counts(rtcFilterIntersection, arguments, ray, hit)) continue;
    RTCRayN_tfar(rays, n, i) = t;
    rtcCopyHitToHitN(RTCRayHitN_HitN(arguments->rayhit, n), &hit, n, i);
  }
}

void occlude(const RTCOccludedFunctionNArguments* arguments) {
  const Gaussian* const gaussians = gaussians_of(arguments->geometryUserPtr);
  const unsigned n = arguments->N, instance = arguments->context->instID[0];
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] != -1) continue;
    const float t = distance_to(gaussians, arguments->primID, instance, arguments->ray, n, i);
    if (std::isnan(t)) continue;
    RTCHit hit = make_hit(gaussians, arguments->primID, arguments->geomID, instance);
    RTCRay ray = rtcGetRayFromRayN(arguments->ray, n, i);
    ray.tfar = t;
    if (counts(rtcFilterOcclusion, arguments, ray, hit)) RTCRayN_tfar(arguments->ray, n, i) = -INFINITY;
  }
}

}  // namespace

EmbreeGeometry splat_geometry(const EmbreeDevice& device, const Mesh& mesh) {
  EmbreeGeometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER));
  device.check("making splats of \"" + mesh.name + "\"");
  rtcSetGeometryUserPrimitiveCount(geometry.get(), static_cast<unsigned>(mesh.vertices.size()));
  rtcSetGeometryUserData(geometry.get(), const_cast<Gaussian*>(mesh.splats->gaussians.data()));
  rtcSetGeometryBoundsFunction(geometry.get(), bounds_of, nullptr);
  rtcSetGeometryIntersectFunction(geometry.get(), intersect);
  rtcSetGeometryOccludedFunction(geometry.get(), occlude);
  return geometry;
}

}  // namespace cistern
