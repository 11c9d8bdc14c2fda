#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "accel/accel.h"
#include "accel/splat_geometry.h"
#include "accel/top_level.h"

namespace cistern {
namespace {

void set_ray(RTCRay& out, const Ray& ray, uint32_t mask, float time = splat_time::kByChance) {
  out.org_x = ray.origin.x;
  out.org_y = ray.origin.y;
  out.org_z = ray.origin.z;
  out.tnear = ray.t_min;
  out.dir_x = ray.direction.x;
  out.dir_y = ray.direction.y;
  out.dir_z = ray.direction.z;
  out.time = time;
  out.tfar = ray.t_max;
  out.mask = mask;
  out.id = splat_key(ray.leaves);
  out.flags = splat_key(ray.passes);
}

void set_rays(RTCRay8& out, const RayLanes& rays, uint32_t mask, float time) {
  static_assert(kLanes == std::size(RTCRay8{}.org_x));
  constexpr auto kAligned = std::experimental::vector_aligned;
  rays.origin.x.copy_to(out.org_x, kAligned);
  rays.origin.y.copy_to(out.org_y, kAligned);
  rays.origin.z.copy_to(out.org_z, kAligned);
  rays.direction.x.copy_to(out.dir_x, kAligned);
  rays.direction.y.copy_to(out.dir_y, kAligned);
  rays.direction.z.copy_to(out.dir_z, kAligned);
  rays.t_max.copy_to(out.tfar, kAligned);
  std::ranges::fill(out.tnear, 0.0f);
  std::ranges::fill(out.time, time);
  std::ranges::fill(out.mask, mask);
  std::ranges::transform(rays.leaves, out.id, splat_key);
  std::ranges::fill(out.flags, splat_key(kNoTriangle));
}

/// Of what is opaque to rays.
uint32_t opaque_ray_mask(uint8_t visibility) {
  return opaque_mask(visibility) | ((visibility & kVisibleToShadow) != 0 ? kPaneMask : 0);
}

/// Instances of some shadow sets, but for triangles that were passed.
struct Blockers {
  const std::vector<Placement>& placements;
  uint64_t sets;
  std::span<const TriangleId> passed{};
  static bool counts(const void* subject, unsigned instance, unsigned triangle) {
    const auto& blockers = *static_cast<const Blockers*>(subject);
    return has_set(blockers.sets, blockers.placements[instance].shadow_set) &&
           std::ranges::find(blockers.passed, TriangleId{instance, triangle}) == blockers.passed.end();
  }
};

bool is_shadow_linked(const void* placements, unsigned instance, unsigned) {
  return (*static_cast<const std::vector<Placement>*>(placements))[instance].is_shadow_linked;
}

/// Embree as Debian builds it ends the process for rays that are not numbers. They meet nothing; what carries them
/// shows in the film, which counts it.
bool is_number(const Ray& ray) {
  const Vec3 o = ray.origin, d = ray.direction;
  return std::isfinite(o.x + o.y + o.z) && std::isfinite(d.x + d.y + d.z) && ray.t_min <= ray.t_max;
}
LaneMask is_number(const RayLanes& rays) {
  const Vec3Lanes &o = rays.origin, &d = rays.direction;
  return isfinite(o.x + o.y + o.z) && isfinite(d.x + d.y + d.z) && rays.t_max >= 0.0f;
}

class EmbreeAccel final : public Accel {
 public:
  EmbreeAccel(std::shared_ptr<const TopLevel> top, MeshScenes mesh_scenes)
      : top_(std::move(top)), mesh_scenes_(std::move(mesh_scenes)) {}

  std::optional<Hit> intersect(const Ray& ray, uint8_t visibility) const override {
    return closest_hit(ray, any_surface_mask(visibility));
  }
  std::optional<Hit> intersect_instance(const Ray& ray, uint32_t instance) const override {
    const RTCScene scene = own_scene(instance);
    RTCRayHit query;
    if (!scene || !is_number(ray) || !find_closest(scene, to_object(ray, instance), kAnyMask, query))
      return std::nullopt;
    return make_hit(query, instance);
  }
  bool obstructed_by_instance(const Ray& ray, uint32_t instance) const override {
    const RTCScene scene = own_scene(instance);
    if (!scene || !is_number(ray)) return false;
    RTCRay query;
    set_ray(query, to_object(ray, instance), kAnyMask);
    embree_occluded(scene, query);
    return query.tfar < 0.0f;
  }
  bool occluded(const Ray& ray, uint8_t visibility, uint64_t sets) const override {
    const uint32_t mask = opaque_ray_mask(visibility);
    if (sets == kAllSets || !top_->is_filtered) return any_hit(ray, mask, splat_time::kByChance);
    const Blockers blockers{top_->placements, sets};
    return any_hit(ray, mask, splat_time::kByChance, HitFilter{Blockers::counts, &blockers});
  }
  LaneMask occluded(const RayLanes& rays, uint8_t visibility) const override {
    return in_packet(rays, opaque_ray_mask(visibility));
  }
  LaneMask obstructed(const RayLanes& rays, uint8_t visibility) const override {
    return in_packet(rays, any_surface_mask(visibility));
  }
  LaneMask obstructed_by_surfaces(const RayLanes& rays, uint8_t visibility) const override {
    return in_packet(rays, surface_mask(visibility));
  }
  std::optional<Hit> intersect_transparent(const Ray& ray, uint8_t visibility, uint64_t sets) const override {
    return closest_hit(ray, transparent_mask(visibility), sets);
  }
  bool may_be_pane(uint32_t instance) const override { return top_->placements[instance].is_pane; }
  bool occluded_but_for_panes(const Ray& ray) const override {
    return any_hit(ray, opaque_mask(kVisibleToShadow), splat_time::kAbsent);
  }
  bool may_meet_splats(const Ray& ray) const override {
    return top_->has_splats && any_hit(ray, kSplatMask, splat_time::kSolid);
  }
  LaneMask may_meet_splats(const RayLanes& rays) const override {
    return top_->has_splats ? in_packet(rays, kSplatMask, splat_time::kSolid) : LaneMask(false);
  }
  std::optional<Hit> intersect_transparent_or_pane(const Ray& ray) const override {
    return closest_hit(ray, transparent_mask(kVisibleToShadow) | kPaneMask);
  }
  std::optional<Hit> intersect_or_medium(const Ray& ray, uint8_t visibility,
                                         std::span<const TriangleId> passed) const override {
    return closest_hit(ray, any_surface_mask(visibility) | kMediumMask, kAllSets, passed);
  }
  std::optional<Hit> intersect_transparent_or_medium(const Ray& ray, uint8_t visibility, uint64_t sets,
                                                     std::span<const TriangleId> passed) const override {
    return closest_hit(ray, transparent_mask(visibility) | kMediumMask, sets, passed);
  }
  std::optional<Hit> intersect_surface(const Ray& ray, uint8_t visibility) const override {
    return closest_hit(ray, surface_mask(visibility));
  }
  HitList media_along(const Ray& ray, uint64_t sets) const override {
    Collected found{*this, sets, {}};
    if (!top_->has_media || !is_number(ray)) return found.hits;
    RTCRayHit query;
    set_query(query, ray, kMediumMask);
    embree_intersect_all(top_->scene.get(), query, {Collected::add, &found});
    return found.hits;
  }
  std::optional<Hit> intersect_shadow_linked(const Ray& ray, uint8_t visibility) const override {
    if (!top_->has_shadow_linked_surfaces) return std::nullopt;
    return closest_hit(ray, any_surface_mask(visibility), {is_shadow_linked, &top_->placements});
  }
  bool has_transparent_surfaces() const override { return top_->has_transparent_surfaces; }
  bool has_media() const override { return top_->has_media; }
  bool has_panes() const override { return top_->has_panes; }
  bool has_splats() const override { return top_->has_splats; }
  Bounds3 bounds() const override { return top_->bounds; }
  size_t memory_bytes() const override {
    size_t bytes = top_->memory_bytes;
    for (const auto& [mesh, mesh_scene] : mesh_scenes_) bytes += mesh_scene->memory_bytes;
    return bytes;
  }

  const std::shared_ptr<const TopLevel>& top() const { return top_; }
  const MeshScenes& mesh_scenes() const { return mesh_scenes_; }

 private:
  static constexpr uint32_t kAnyMask = ~0u;

  /// What rays meet of instances of some shadow sets.
  struct Collected {
    const EmbreeAccel& accel;
    uint64_t sets;
    HitList hits;
    static void add(void* subject, const RTCHit& hit, float t) {
      auto& collected = *static_cast<Collected*>(subject);
      const uint32_t instance = hit_instance(hit);
      if (!has_set(collected.sets, collected.accel.top_->placements[instance].shadow_set)) return;
      collected.hits.add(collected.accel.make_hit(hit, t, instance));
    }
  };

  /// Null for what intersect_instance does not find.
  RTCScene own_scene(uint32_t instance) const {
    const Placement& placement = top_->placements[instance];
    if (!placement.mesh || placement.is_flattened) return nullptr;
    return mesh_scenes_.at(placement.mesh.get())->scene.get();
  }
  /// Not normalised: distances stay those of the world.
  Ray to_object(const Ray& ray, uint32_t instance) const {
    const Transform& map = top_->normal_maps[instance];
    const auto in_own_scene = [&](TriangleId id) {
      return id.instance == instance ? TriangleId{RTC_INVALID_GEOMETRY_ID, id.triangle} : id;
    };
    return {map.point(ray.origin),    map.vector(ray.direction), ray.t_min, ray.t_max,
            in_own_scene(ray.leaves), in_own_scene(ray.passes)};
  }
  LaneMask in_packet(const RayLanes& rays, uint32_t mask, float time = splat_time::kByChance) const {
    const LaneMask is_traced = rays.exists && is_number(rays);
    alignas(32) std::array<int, kLanes> valid;
    for (size_t i = 0; i < kLanes; ++i) valid[i] = is_traced[i] ? -1 : 0;
    RTCRay8 packet;
    set_rays(packet, rays, mask, time);
    embree_occluded(valid.data(), top_->scene.get(), packet);
    return is_traced && Lanes(packet.tfar, std::experimental::vector_aligned) < 0.0f;
  }
  /// Of those that the filter, if there is one, counts.
  template <class... Filter>
  bool any_hit(const Ray& ray, uint32_t mask, float time, const Filter&... filter) const {
    if (!is_number(ray)) return false;
    RTCRay query;
    set_ray(query, ray, mask, time);
    embree_occluded(top_->scene.get(), query, filter...);
    return query.tfar < 0.0f;
  }
  std::optional<Hit> closest_hit(const Ray& ray, uint32_t mask) const {
    RTCRayHit query;
    if (!is_number(ray) || !find_closest(top_->scene.get(), ray, mask, query)) return std::nullopt;
    return make_hit(query, hit_instance(query.hit));
  }
  std::optional<Hit> closest_hit(const Ray& ray, uint32_t mask, uint64_t sets,
                                 std::span<const TriangleId> passed = {}) const {
    if ((sets == kAllSets && passed.empty()) || !top_->is_filtered) return closest_hit(ray, mask);
    const Blockers blockers{top_->placements, sets, passed};
    return closest_hit(ray, mask, {Blockers::counts, &blockers});
  }
  std::optional<Hit> closest_hit(const Ray& ray, uint32_t mask, const HitFilter& filter) const {
    if (!is_number(ray)) return std::nullopt;
    RTCRayHit query;
    set_query(query, ray, mask);
    embree_intersect(top_->scene.get(), query, filter);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return make_hit(query, hit_instance(query.hit));
  }
  static uint32_t hit_instance(const RTCHit& hit) {
    return hit.instID[0] == RTC_INVALID_GEOMETRY_ID ? hit.geomID : hit.instID[0];
  }
  static void set_query(RTCRayHit& query, const Ray& ray, uint32_t mask) {
    set_ray(query.ray, ray, mask);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  }
  /// False where nothing is hit.
  static bool find_closest(RTCScene scene, const Ray& ray, uint32_t mask, RTCRayHit& query) {
    set_query(query, ray, mask);
    embree_intersect(scene, query);
    return query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
  Hit make_hit(const RTCRayHit& query, uint32_t instance) const {
    return make_hit(query.hit, query.ray.tfar, instance);
  }
  Hit make_hit(const RTCHit& hit, float t, uint32_t instance) const {
    const Vec3 normal = top_->normal_maps[instance].transposed_vector({hit.Ng_x, hit.Ng_y, hit.Ng_z});
    return {t, hit.u, hit.v, normal, instance, hit.primID};
  }

  std::shared_ptr<const TopLevel> top_;
  MeshScenes mesh_scenes_;
};

/// Scenes of all meshes that are instanced, from `previous` where it has them; without some when stopped.
MeshScenes build_mesh_scenes(const std::shared_ptr<const EmbreeDevice>& device,
                             const std::vector<Placement>& placements, const MeshScenes& previous, bool is_filtered,
                             const IsStopped& is_stopped) {
  MeshScenes scenes;
  std::vector<std::shared_ptr<const Mesh>> missing;
  for (const Placement& placement : placements) {
    if (!placement.mesh || placement.is_flattened) continue;
    if (!scenes.try_emplace(placement.mesh.get()).second) continue;
    const auto known = previous.find(placement.mesh.get());
    if (known != previous.end() && known->second->is_filtered == is_filtered) {
      scenes[placement.mesh.get()] = known->second;
    } else {
      missing.push_back(placement.mesh);
    }
  }
  std::vector<std::shared_ptr<MeshScene>> built(missing.size());
  const size_t bytes_before = device->memory_bytes();
  tbb::parallel_for(size_t{0}, missing.size(),
                    [&](size_t i) { built[i] = build_mesh_scene(device, missing[i], is_filtered, is_stopped); });
  // Embree counts for the whole device: what the batch took is shared out by triangles.
  const double bytes = static_cast<double>(device->memory_bytes_since(bytes_before));
  double triangles = 0.0;
  for (const std::shared_ptr<const Mesh>& mesh : missing) triangles += static_cast<double>(mesh->triangle_count());
  for (size_t i = 0; i < missing.size(); ++i) {
    if (!built[i]) continue;
    built[i]->memory_bytes = static_cast<size_t>(bytes * static_cast<double>(missing[i]->triangle_count()) / triangles);
    scenes[missing[i].get()] = built[i];
  }
  return scenes;
}

}  // namespace

std::shared_ptr<const Accel> Accel::build(std::shared_ptr<const Scene> scene,
                                          const std::shared_ptr<const Accel>& previous, bool keep_instances,
                                          const std::function<bool()>& is_stopped) {
  const auto* const old = dynamic_cast<const EmbreeAccel*>(previous.get());
  std::vector<Placement> placements = place_instances(*scene, keep_instances);
  const bool is_filtered = scene->has_shadow_links() || std::ranges::any_of(placements, &Placement::has_medium);
  if (old && old->top()->placements == placements && old->top()->is_filtered == is_filtered) {
    return std::make_shared<EmbreeAccel>(old->top(), old->mesh_scenes());
  }
  const std::shared_ptr<const EmbreeDevice> device = old ? old->top()->device : std::make_shared<const EmbreeDevice>();
  MeshScenes mesh_scenes =
      build_mesh_scenes(device, placements, old ? old->mesh_scenes() : MeshScenes{}, is_filtered, is_stopped);
  if (is_stopped && is_stopped()) return nullptr;
  std::shared_ptr<const TopLevel> top =
      build_top_level(device, std::move(placements), mesh_scenes, is_filtered, is_stopped);
  if (!top) return nullptr;
  return std::make_shared<EmbreeAccel>(std::move(top), std::move(mesh_scenes));
}

}  // namespace cistern
