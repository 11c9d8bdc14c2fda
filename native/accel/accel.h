#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "accel/offset_origin.h"
#include "base/lanes.h"
#include "scene/scene.h"

namespace cistern {

/// A straight line meets it once.
struct TriangleId {
  uint32_t instance = 0, triangle = 0;
  friend bool operator==(const TriangleId&, const TriangleId&) = default;
};
inline constexpr TriangleId kNoTriangle{UINT32_MAX, UINT32_MAX};

struct Ray {
  Vec3 origin;
  Vec3 direction;  // unit
  float t_min = 0.0f;
  float t_max = INFINITY;
  // Splats that it does not meet; other surfaces do not look at these. Along a straight line:
  TriangleId leaves = kNoTriangle;  // of the vertex where that begins
  TriangleId passes = kNoTriangle;  // the last that it went through
};

/// Several rays, from t = 0.
struct RayLanes {
  Vec3Lanes origin, direction;  // unit
  Lanes t_max = 0.0f;
  LaneMask exists{false};
  std::array<TriangleId, kLanes> leaves = no_triangles();  // Ray::leaves

  static constexpr std::array<TriangleId, kLanes> no_triangles() {
    std::array<TriangleId, kLanes> none;
    none.fill(kNoTriangle);
    return none;
  }
  void set(size_t lane, const Ray& ray) {
    origin.set(lane, ray.origin);
    direction.set(lane, ray.direction);
    t_max[lane] = ray.t_max;
    exists[lane] = true;
    leaves[lane] = ray.leaves;
  }
};

/// Closest surface along a ray. `normal` is the geometric normal by the triangle's winding in object space, mapped to
/// the world and not normalised: the outside of a mirrored object stays outside. (u, v) weigh vertices 1 and 2.
/// Of a strand, `triangle` is the segment, u how far along it, v 0, and the normal points away from its middle. Of a
/// splat u and v are 0, and the normal is the axis in which it is flattest.
struct Hit {
  float t;
  float u, v;
  Vec3 normal;
  uint32_t instance;
  uint32_t triangle;
};

/// Surfaces in no order. Of more than these one at a place, which no scene needs, some are left out.
struct HitList {
  static constexpr size_t kCapacity = 16;
  size_t count = 0;
  std::array<Hit, kCapacity> hits;

  std::span<const Hit> all() const { return {hits.data(), count}; }
  void add(const Hit& hit) {
    if (count < kCapacity) hits[count++] = hit;
  }
};

/// Ray tracing on a scene: the only part of the project that knows Embree. Built once per snapshot; meshes that are
/// instanced more than once keep an Embree scene of their own, shared with the accel of earlier snapshots;
/// meshes used once are put into the top level in world space, which traces faster.
/// All queries are const, thread-safe and set no state except flush-to-zero via `FlushDenormals` (see below).
///
/// Rays meet splats by chance (splat_geometry.h): the same query has the same answer, but another query of the same
/// segment, whose rays differ by a rounding, has another one. Estimates ask once for each segment.
class Accel {
 public:
  /// `previous` may be null; parts of it that still apply are reused. `keep_instances` true never flattens (viewport
  /// editing). Null once `is_stopped` was true: it is asked from any thread, all the time. Throws Error when memory
  /// runs out.
  static std::shared_ptr<const Accel> build(std::shared_ptr<const Scene> scene,
                                            const std::shared_ptr<const Accel>& previous = {},
                                            bool keep_instances = false, const std::function<bool()>& is_stopped = {});
  virtual ~Accel() = default;

  /// `visibility`: RayVisibility bits; objects sharing no bit with it are not there for this ray.
  virtual std::optional<Hit> intersect(const Ray& ray, uint8_t visibility) const = 0;
  /// Closest surface of one instance that is not flattened, whatever its visibility, as if there were no others.
  /// Instances with MaterialProgram::has_subsurface or looks_at_own_object never are; of others nothing is found.
  virtual std::optional<Hit> intersect_instance(const Ray& ray, uint32_t instance) const = 0;
  /// Whether it has a surface there.
  virtual bool obstructed_by_instance(const Ray& ray, uint32_t instance) const = 0;
  /// Whether an *opaque* surface lies strictly between the ends. `visibility` as above; `blockers`: only instances
  /// whose shadow_set is among these, which differs where the scene has_shadow_links.
  virtual bool occluded(const Ray& ray, uint8_t visibility = kVisibleToShadow, uint64_t blockers = kAllSets) const = 0;
  /// The same for rays that start or end near each other, which are then traced faster; of those that exist.
  virtual LaneMask occluded(const RayLanes& rays, uint8_t visibility) const = 0;
  /// Whether any surface does, opaque or not, for rays that start near each other.
  virtual LaneMask obstructed(const RayLanes& rays, uint8_t visibility) const = 0;
  /// The same, but of what is only where media begin and end.
  virtual LaneMask obstructed_by_surfaces(const RayLanes& rays, uint8_t visibility) const = 0;
  /// Closest surface whose materials may let light through (MaterialProgram::may_be_transparent).
  virtual std::optional<Hit> intersect_transparent(const Ray& ray, uint8_t visibility = kVisibleToShadow,
                                                   uint64_t blockers = kAllSets) const = 0;
  /// Whether a ray may meet a splat between its ends, by whatever chance, but for the one it leaves.
  virtual bool may_meet_splats(const Ray& ray) const = 0;
  virtual LaneMask may_meet_splats(const RayLanes& rays) const = 0;
  /// Whether an instance has a material that may refract clearly (MaterialProgram::may_be_pane), and has_pane_shape.
  virtual bool may_be_pane(uint32_t instance) const = 0;
  /// As occluded and intersect_transparent, for shadow rays that refraction may let through: instances that may be
  /// panes are no longer opaque. Splats are not there for the first: rays that go on behind panes meet them then.
  virtual bool occluded_but_for_panes(const Ray& ray) const = 0;
  virtual std::optional<Hit> intersect_transparent_or_pane(const Ray& ray) const = 0;
  /// As intersect and intersect_transparent, but surfaces that have a medium inside are there for all rays, and none
  /// of those that were `passed`.
  virtual std::optional<Hit> intersect_or_medium(const Ray& ray, uint8_t visibility,
                                                 std::span<const TriangleId> passed) const = 0;
  virtual std::optional<Hit> intersect_transparent_or_medium(const Ray& ray, uint8_t visibility, uint64_t blockers,
                                                             std::span<const TriangleId> passed) const = 0;
  /// As intersect, but instances without any surface, whose media just begin and end, are not there.
  virtual std::optional<Hit> intersect_surface(const Ray& ray, uint8_t visibility) const = 0;
  /// All surfaces along a ray that have a medium inside.
  virtual HitList media_along(const Ray& ray, uint64_t blockers) const = 0;
  /// Closest surface of an instance that may emit and whose light some things do not block (LightLinks::blockers).
  virtual std::optional<Hit> intersect_shadow_linked(const Ray& ray, uint8_t visibility) const = 0;
  virtual bool has_transparent_surfaces() const = 0;
  virtual bool has_media() const = 0;
  /// Whether an instance may_be_pane.
  virtual bool has_panes() const = 0;
  virtual bool has_splats() const = 0;
  virtual Bounds3 bounds() const = 0;
  /// Bytes held by Embree for this accel, scenes shared with others included.
  virtual size_t memory_bytes() const = 0;
};

/// Sets flush-to-zero and denormals-are-zero while alive, as Embree wants, and restores the thread's state.
class FlushDenormals {
 public:
  FlushDenormals();
  ~FlushDenormals();
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned saved_;
};

/// Throws Error when the Embree that answers is not the one compiled against (another library took over its names).
void check_embree_version();
/// Version of the Embree compiled against, "3.13.5".
std::string embree_version();
/// Path of the library whose Embree answers.
std::string embree_library();

}  // namespace cistern
