#include "shading/nodes_rays.h"

#include <array>

#include "base/frame.h"
#include "base/sobol.h"
#include "base/warp.h"
#include "shading/mesh_interpolation.h"

namespace cistern {
namespace {

enum RayNode : uint32_t {
  kOcclusion,
  kBevel
};  // sets of random numbers; all nodes of a kind have the same, as Cycles'

/// Rays are traced on meshes that are in an accel; alone, only in those of triangles.
bool can_trace(const NodeContext& c, bool is_local) {
  return c.accel != nullptr && c.has_mesh() && !(is_local && c.mesh().is_strands());
}

/// Where a probe through the disk of radius 1 passes it, with a density in proportion to (1 - r)^3: the r below which
/// the part `u` of the probes lies, whose 1 - r = y is where (5 - 4 y) y^4 = 1 - u. Newton's steps from the inflection
/// all go one way.
float sample_disk_radius(float u) {
  constexpr int kMostSteps = 12;
  constexpr float kTolerance = 1e-6f;
  const float above = 1.0f - u;
  float y = 0.75f;
  for (int i = 0; i < kMostSteps; ++i) {
    const float y2 = y * y, slope = 20.0f * y * y2 * (1.0f - y), excess = (5.0f - 4.0f * y) * y2 * y2 - above;
    if (std::abs(excess) < kTolerance || !(slope > 0.0f)) break;
    y = clamp01(y - excess / slope);
  }
  return 1.0f - y;
}

/// In metres. Embree ends the process for rays that are far away, also in the space of a very small object.
constexpr float kMostRadius = 1e5f;

float disk_density(float r) { return r < 1.0f ? (1.0f - r) * (1.0f - r) * (1.0f - r) : 0.0f; }  // not normalised

/// Normals of what lies within a radius, found by probes: lines across a ball, along the normal or one of two tangents.
class BevelProbes {
 public:
  BevelProbes(const NodeContext& context, float radius) : c_(context), frame_(context.point.ng), radius_(radius) {}

  void trace(Vec2 u) {
    constexpr int kMostHits = 16;
    const size_t along = u.x < kShares[0] ? 0 : (u.x < kShares[0] + kShares[1] ? 1 : 2);
    constexpr std::array<float, 3> kBefore{0.0f, kShares[0], kShares[0] + kShares[1]};
    const SineCosine azimuth = sine_cosine_of_turns((u.x - kBefore[along]) / kShares[along]);
    const float r = sample_disk_radius(u.y), height = radius_ * safe_sqrt(1.0f - r * r);
    const Vec3 axis = axes_[along], s = axes_[(along + 1) % 3], t = axes_[(along + 2) % 3];
    Ray ray{c_.point.position + height * axis + (radius_ * r) * (azimuth.cosine * s + azimuth.sine * t), -axis, 0.0f,
            2.0f * height};
    for (int i = 0; i < kMostHits; ++i) {
      const std::optional<Hit> hit = c_.accel->intersect_instance(ray, c_.point.instance);
      if (!hit) return;
      add(*hit, along, disk_density(r));
      ray.t_min = std::nextafter(hit->t, INFINITY);
    }
  }

  Vec3 sum() const { return sum_; }

 private:
  /// Of the probes, by axis; also what their densities on a surface are in proportion to, with the cosine.
  static constexpr std::array<float, 3> kShares{0.5f, 0.25f, 0.25f};

  void add(const Hit& hit, size_t along, float density) {
    const Instance& instance = c_.instance();
    const Vec3 ng = normalize_or(hit.normal, {});
    float squares = 0.0f;
    for (size_t i = 0; i < axes_.size(); ++i) squares += probe_density(i, ng) * probe_density(i, ng);
    if (!(squares > 0.0f) || !(density > 0.0f)) return;
    const Mesh& mesh = c_.mesh();
    const Vec2 barycentric{hit.u, hit.v};
    const Vec3 place = instance.object_to_world.point(interpolate_position(mesh, hit.triangle, barycentric));
    const float wanted = disk_density(length(place - c_.point.position) / radius_);
    Vec3 n = ng;
    if (!mesh.is_flat(hit.triangle))
      n = normalize_or(blend_world_normals(mesh, instance, hit.triangle, barycentric), ng);
    sum_ += (probe_density(along, ng) / squares * wanted / density) * n;
  }
  float probe_density(size_t along, Vec3 ng) const { return kShares[along] * std::abs(dot(axes_[along], ng)); }

  const NodeContext& c_;
  Frame frame_;
  std::array<Vec3, 3> axes_{frame_.n, frame_.s, frame_.t};
  float radius_;
  Vec3 sum_;
};

/// Metres from the point, or from the origin, that rays start within.
bool is_near(Vec3 place, Vec3 from, float distance) { return length(place - from) <= distance; }

struct NodeHit {
  Ray ray;
  Hit hit;
  float scale;  // metres by unit of the node's length
};
std::optional<NodeHit> cast(const NodeContext& c, const NodeRay& asked) {
  constexpr float kFarthest = 1e9f;  // as of ray portals
  const float scale = length(asked.direction);
  if (!can_trace(c, asked.is_local) || !(asked.length > 0.0f) || !(scale > 0.0f) || !std::isfinite(scale)) return {};
  const SurfacePoint& point = c.point;
  const bool is_reachable =
      asked.is_local ? is_near(asked.origin, point.position, kMostRadius) : is_near(asked.origin, {}, kFarthest);
  if (!is_reachable) return {};
  Ray ray{asked.origin, asked.direction / scale, 0.0f, scale * asked.length};
  constexpr float kBeyondStep = 1.1f;
  if (asked.shift.step != 0)
    ray.t_min = kBeyondStep * length(footprint_step(point, asked.shift));
  else if (asked.origin == point.position)
    ray.origin = offset_origin(point.position, point.clearance, point.ng, ray.direction);
  if (asked.origin == point.position) ray.leaves = point.triangle_id();
  const std::optional<Hit> hit =
      asked.is_local ? c.accel->intersect_instance(ray, point.instance) : c.accel->intersect(ray, kVisibleToAll);
  if (!hit) return {};
  return NodeHit{ray, *hit, scale};
}

}  // namespace

float ambient_occlusion(const Accel& accel, const SurfacePoint& point, const OcclusionSettings& settings,
                        float distance, Vec3 normal) {
  const Vec3 n = normalize_or(normal, point.ns);
  const Frame frame(settings.is_inside ? -n : n);
  const uint32_t seed = place_hash(point);
  constexpr int kPacket = static_cast<int>(kLanes);
  int blocked = 0;
  for (int begin = 0; begin < settings.rays; begin += kPacket) {
    RayLanes rays;
    const int count = std::min(kPacket, settings.rays - begin);
    for (int i = 0; i < count; ++i) {
      const Vec2 u = sobol_point(static_cast<uint32_t>(begin + i), kOcclusion, seed).pair;
      const Vec3 direction = normalize(frame.to_world(square_to_cosine_hemisphere(u)));
      const Vec3 origin = offset_origin(point.position, point.clearance, point.ng, direction);
      if (settings.is_local)
        blocked +=
            accel.obstructed_by_instance({origin, direction, 0.0f, distance, point.triangle_id()}, point.instance) ? 1
                                                                                                                   : 0;
      else
        rays.set(static_cast<size_t>(i), {origin, direction, 0.0f, distance, point.triangle_id()});
    }
    if (settings.is_local) continue;
    blocked += popcount(settings.meets_boundaries ? accel.obstructed(rays, kVisibleToShadow)
                                                  : accel.obstructed_by_surfaces(rays, kVisibleToShadow));
  }
  return 1.0f - static_cast<float>(blocked) / static_cast<float>(settings.rays);
}

float ambient_occlusion_node(const NodeContext& context, const OcclusionSettings& settings, float distance,
                             Vec3 normal) {
  if (!(distance > 0.0f) || !can_trace(context, settings.is_local)) return 1.0f;
  return ambient_occlusion(*context.accel, context.point, settings, distance, normal);
}

Vec3 bevel_node(const NodeContext& context, int probes, float radius, Vec3 normal) {
  if (!(radius > 0.0f) || !std::isfinite(radius) || !can_trace(context, true)) return normal;
  BevelProbes found(context, std::min(radius, kMostRadius));
  const uint32_t seed = place_hash(context.point);
  for (int i = 0; i < probes; ++i) found.trace(sobol_point(static_cast<uint32_t>(i), kBevel, seed).pair);
  const Vec3 mean = normalize_or(found.sum(), {});
  if (mean == Vec3{}) return normal;
  return context.point.is_backface ? -mean : mean;
}

Vec3 raycast_node(const NodeContext& context, bool wants_normal, const NodeRay& ray) {
  const std::optional<NodeHit> met = cast(context, ray);
  if (!met) return wants_normal ? Vec3{} : Vec3{0.0f, 0.0f, ray.length};
  if (wants_normal) return make_surface_point(context.scene, met->ray, met->hit).ns;
  return {1.0f, met->hit.instance == context.point.instance ? 1.0f : 0.0f, met->hit.t / met->scale};
}

}  // namespace cistern
