#pragma once

#include <memory>
#include <optional>

#include "accel/accel.h"
#include "base/alias_table.h"
#include "lights/light_set.h"
#include "shading/material.h"
#include "transport/extinction_bounds.h"
#include "transport/media_crossings.h"

namespace cistern {

/// Boundaries without a surface that a ray crosses at most: more means that it got stuck. As Cycles.
inline constexpr int kMostBoundaries = 1024;

/// The media of a segment of a ray.
struct SegmentMedia {
  Medium even;        // those that are the same everywhere, added up
  MediaStack uneven;  // the others, that of the world first

  bool may_shine = false;  // any of them

  bool varies() const { return !uneven.is_empty(); }
};

/// The participating media of a scene: absorbing, scattering, emitting. Each is inside of the surfaces that have its
/// material, which therefore should be closed, with normals to the outside; one of the world is everywhere. Where they
/// overlap they add up. Immutable.
class Media {
 public:
  /// Null for a scene without any.
  static std::shared_ptr<const Media> make(const Scene& scene, const LightSet& lights);
  /// Name of a material that has one inside and is in use; empty without any.
  static std::string find_name(const Scene& scene);

  /// Whether a ray that met this, by Accel's queries for surfaces and media, goes straight on: there is no surface, or
  /// none that such rays see. They cross what they do not see all the same, as others that leave surfaces there may see
  /// it.
  bool is_boundary(const SurfacePoint& point, uint8_t ray_kind) const;
  /// Brings the media of a ray that crosses the boundary at `point`, which is `distance` along it, up to date. Returns
  /// the ray that goes on; the part before BoundaryTrail::begin is behind it.
  Ray cross(MediaStack& stack, BoundaryTrail& trail, const Ray& ray, float distance, const SurfacePoint& point) const;
  /// The same of a ray that arrived at a surface and leaves it, on either side, to where offset_origin takes it.
  void leave(MediaStack& stack, const Accel& accel, const SurfacePoint& point, Vec3 direction,
             uint64_t blockers = kAllSets) const;
  /// Those that a ray from `origin`, where it has left no surface, begins in.
  MediaStack around(const Accel& accel, Vec3 origin) const;
  /// What they are together for the ray, which goes along `direction` (unit); without those of objects that such rays
  /// do not see. Of a ray that meets no surface any more (`is_endless`) only that of the world: where another did not
  /// end, its surface is not closed.
  SegmentMedia together(const MediaStack& stack, const PathState& path, Vec3 direction, bool is_endless) const;
  /// All that a segment has at a place of the world, or only what is uneven.
  Medium at(const SegmentMedia& segment, const PathState& path, Vec3 direction, Vec3 position) const;
  Medium uneven_at(const SegmentMedia& segment, const PathState& path, Vec3 direction, Vec3 position) const;
  /// What fills the world, and varies, alone.
  Medium world_at(const PathState& path, Vec3 direction, Vec3 position) const;
  /// How dense one that varies hardly is more than, along a ray: of an instance, or of the world.
  BlockWalk bounds_along(const MediaStack::Entry& entry, Vec3 origin, Vec3 direction) const;
  WorldBlockWalk world_bounds_along(Vec3 origin, Vec3 direction) const { return {*world_bounds_, origin, direction}; }

  /// Light links of them together are those of the medium that was entered first, and in a world filled by one there
  /// are none, as in Cycles: the set they are as a receiver, and whether what they emit reaches a receiver.
  uint8_t light_set(const MediaStack& stack) const;
  bool shine_on(const MediaStack& stack, uint8_t receiver) const;
  /// The light group of what they emit together is that of the medium that was entered last, as in Cycles.
  LightGroup light_group(const MediaStack& stack) const;

  /// A choice of emitters that does not look at the receiver; see LightSet::receiver_free_pmf. Empty without emitters.
  const AliasTable& emitters() const { return emitters_; }

 private:
  struct Volume {
    Volume(uint32_t i, const Bounds3& box) : instance(i), bounds(box) {}
    uint32_t instance;
    Bounds3 bounds;                                      // in world space
    std::shared_ptr<const ExtinctionBounds> extinction;  // of what varies; null: nothing does
    Transform world_to_blocks;
    float scale = 1.0f;  // how much denser than where `extinction` was found
  };
  explicit Media(const Scene& scene) : scene_(scene) {}
  bool has_medium(uint32_t instance, int material) const;
  void find_bounds();
  void add_entry(Medium& medium, const MediaStack::Entry& entry, const PathState& path, Vec3 direction,
                 Vec3 position) const;

  const Scene& scene_;
  bool fills_world_ = false;
  std::optional<WorldExtinctionBounds> world_bounds_;  // where what fills it varies
  std::vector<Volume> volumes_;
  AliasTable emitters_;
};

}  // namespace cistern
