#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "scene/scene.h"

namespace cistern {

/// Lets somebody watch and stop long work; the functions may be called from any thread, empty ones are not called.
struct WorkMonitor {
  std::function<bool()> is_stopped;                  // asked at least every 20 ms
  std::function<void(float done)> report = nullptr;  // share of the work in [0, 1], now and then

  bool stopped() const { return is_stopped && is_stopped(); }
};

/// A cell of the cache: spatial cell * 64 + normal bin. For colours: cell_color(key), or cell_color(key / 64) for the
/// spatial cell alone.
using LightCacheKey = uint32_t;
inline constexpr LightCacheKey kNoLightCacheKey = ~LightCacheKey{0};

/// Which cells of a fixed grid hold surfaces, and points on those surfaces. Depends on the geometry alone: lights and
/// materials may change under it. Plain data, immutable once built.
///
/// [Stefanescu 2025] V. T. Stefanescu: Worldspace ReSTIR for Direct Illumination. Thesis, TU Delft, §3.1 and §4.2:
/// 64^3 cells over the box of the scene, 64 bins of normals in each, points distributed evenly over all surfaces.
///
/// Departures: cells are cubes, 64 along the longest side of the box: slices of a flat scene would hold next to nothing
/// each. Bins are 8 x 8 squares of an octahedron [Cigolle et al. 2014], turned so that normals along the axes
/// lie inside a bin, since those of the printed (theta, phi) differ in size and meet at poles; both sides of a triangle
/// count; points lie at equal distances along the sum of all areas.
class LightCacheCells {
 public:
  static constexpr int kResolution = 64;       // spatial cells along each axis of the box
  static constexpr int kNormalResolution = 8;  // bins along each axis of the octahedron
  static constexpr int kNormalBins = kNormalResolution * kNormalResolution;
  static constexpr int kSpatialCells = kResolution * kResolution * kResolution;

  struct SurfacePosition {
    Vec3 position, normal;  // normal: geometric, unit, on the side of the cell's bin
  };

  /// `point_count` points (at least 1) on all triangles of all instances. Null when stopped. A scene without surface
  /// gives a grid without occupied cells.
  static std::shared_ptr<const LightCacheCells> build(const Scene& scene, uint32_t point_count, uint64_t seed,
                                                      const WorkMonitor& monitor = {});
  /// Whether the scene has the very surfaces that this was built from.
  bool fits(const Scene& scene) const;

  /// The cell of a point and the side its unit normal is on; points outside of the box belong to the nearest cell.
  /// kNoLightCacheKey where no point was found when building, or for what is not finite.
  LightCacheKey key_of(Vec3 position, Vec3 normal) const;
  /// Edges of spatial cells in metres, above zero also for flat scenes.
  Vec3 cell_size() const { return cell_size_; }
  /// Up to `max_count` of the points of an occupied cell, spread over all of them; at least one.
  void points_of(LightCacheKey key, size_t max_count, std::vector<SurfacePosition>& points) const;

  /// Spatial cells that hold surfaces, ascending.
  std::span<const uint32_t> occupied_spatial_cells() const { return occupied_list_; }
  /// Number of cells, counting those of different bins.
  size_t occupied_cells() const;
  size_t memory_bytes() const;

 private:
  struct PackedPoint {
    Vec3 position;
    uint32_t normal;  // octahedral
  };
  /// What decides whether geometry is the same; meshes are immutable.
  struct Fingerprint {
    std::vector<std::weak_ptr<const Mesh>> meshes;
    uint64_t instances = 0;
  };
  static Fingerprint fingerprint_of(const Scene& scene);
  static int normal_bin(Vec3 normal);
  uint32_t spatial_cell(Vec3 position) const;
  void set_box(const Bounds3& box);
  void sort_points(std::vector<PackedPoint> points);

  Vec3 lower_, cell_size_{1.0f, 1.0f, 1.0f};
  Vec3 last_{kResolution - 1.0f, kResolution - 1.0f, kResolution - 1.0f};  // cells along each axis that meet the box
  std::vector<PackedPoint> points_;                                        // by spatial cell
  std::vector<uint32_t> first_point_;                                      // per spatial cell, and the end
  std::vector<uint64_t> occupied_;                                         // per spatial cell, a bit per normal bin
  std::vector<uint32_t> occupied_list_;
  Fingerprint fingerprint_;
};

}  // namespace cistern
