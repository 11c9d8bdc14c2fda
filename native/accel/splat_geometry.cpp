#include "accel/splat_geometry.h"

#include <bit>
#include <cmath>

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

/// As Embree has it, in object space.
struct SplatRay {
  Vec3 origin, direction;
  float t_min, t_max;
  uint32_t leaves, passes;  // splat_key
  float time;

  SplatRay(RTCRayN* rays, unsigned n, unsigned i)
      : origin{RTCRayN_org_x(rays, n, i), RTCRayN_org_y(rays, n, i), RTCRayN_org_z(rays, n, i)},
        direction{RTCRayN_dir_x(rays, n, i), RTCRayN_dir_y(rays, n, i), RTCRayN_dir_z(rays, n, i)},
        t_min(RTCRayN_tnear(rays, n, i)),
        t_max(RTCRayN_tfar(rays, n, i)),
        leaves(RTCRayN_id(rays, n, i)),
        passes(RTCRayN_flags(rays, n, i)),
        time(RTCRayN_time(rays, n, i)) {}
};

/// Distance along the ray of a splat that it meets, in lengths of the direction; NaN where it does not. `id`: of the
/// splat.
float distance_to(const Gaussian& gaussian, TriangleId id, const SplatRay& ray) {
  const Vec3 from_middle = ray.origin - gaussian.middle;
  const Vec3 origin = gaussian.in_deviations(from_middle), direction = gaussian.in_deviations(ray.direction);
  const float t = -dot(origin, direction) / dot(direction, direction);
  if (!(t >= ray.t_min && t <= ray.t_max)) return NAN;
  const Vec3 about = origin + t * direction;
  // By rounding it is off along the direction, by far where the splat is thin and far away.
  const Vec3 closest = about - (dot(about, direction) / dot(direction, direction)) * direction;
  const float chance = gaussian.opacity * std::exp(-0.5f * dot(closest, closest));
  const float hash = ray.time == splat_time::kSolid ? 0.0f : hash_of(ray.origin + t * ray.direction, gaussian.splat);
  if (!(chance > kLeastChance && hash < chance)) return NAN;
  const uint32_t key = splat_key(id);
  if (key == ray.leaves || key == ray.passes || ray.time == splat_time::kAbsent) return NAN;
  const float length2 = dot(ray.direction, ray.direction), along = dot(from_middle, ray.direction);
  const bool is_within =
      dot(from_middle, from_middle) * length2 - along * along <= gaussian.radius * gaussian.radius * length2;
  return is_within ? t : NAN;
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
bool counts(const Arguments* arguments, RTCRay ray, RTCHit& hit) {
  int valid = -1;
  const RTCFilterFunctionNArguments filtered{&valid,
                                             arguments->geometryUserPtr,
                                             arguments->context,
                                             reinterpret_cast<RTCRayN*>(&ray),
                                             reinterpret_cast<RTCHitN*>(&hit),
                                             1};
  embree_filter(arguments, &filtered);
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
    const float t = distance_to(gaussians[arguments->primID], {instance, arguments->primID}, SplatRay(rays, n, i));
    if (std::isnan(t)) continue;
    RTCHit hit = make_hit(gaussians, arguments->primID, arguments->geomID, instance);
    RTCRay ray = rtcGetRayFromRayN(rays, n, i);
    ray.tfar = t;
    if (!counts(arguments, ray, hit)) continue;
    RTCRayN_tfar(rays, n, i) = t;
    rtcCopyHitToHitN(RTCRayHitN_HitN(arguments->rayhit, n), &hit, n, i);
  }
}

void occlude(const RTCOccludedFunctionNArguments* arguments) {
  const Gaussian* const gaussians = gaussians_of(arguments->geometryUserPtr);
  const unsigned n = arguments->N, instance = arguments->context->instID[0];
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] != -1) continue;
    const float t =
        distance_to(gaussians[arguments->primID], {instance, arguments->primID}, SplatRay(arguments->ray, n, i));
    if (std::isnan(t)) continue;
    RTCHit hit = make_hit(gaussians, arguments->primID, arguments->geomID, instance);
    RTCRay ray = rtcGetRayFromRayN(arguments->ray, n, i);
    ray.tfar = t;
    if (counts(arguments, ray, hit)) RTCRayN_tfar(arguments->ray, n, i) = -INFINITY;
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
