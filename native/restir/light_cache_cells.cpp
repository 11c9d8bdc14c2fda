#include "restir/light_cache_cells.h"

#include <atomic>
#include <bit>
#include <numeric>

#include "base/parallel.h"
#include "base/rng.h"
#include "base/warp.h"

namespace cistern {
namespace {

constexpr uint32_t kChunkTriangles = 16384;  // a millisecond of work
constexpr uint32_t kPointStream = 0x706f696e;
/// The box is larger than the scene by these parts of it, so that walls at round coordinates are not planes of cells.
constexpr Vec3 kLowerMargin{0.00618f, 0.00414f, 0.00732f}, kUpperMargin{0.00236f, 0.00449f, 0.00646f};
/// Turns normals before they are binned: the axes come to lie in the middle half of bins, the diagonals between two
/// axes inside of bins as well. Found by search.
constexpr Vec3 kNormalRows[3] = {{0.69664051f, 0.48803058f, 0.52584993f},
                                 {-0.65862f, 0.14443774f, 0.7384832f},
                                 {0.28444981f, -0.8607926f, 0.42204788f}};

bool is_finite_vec(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// A run of triangles of one instance.
struct Chunk {
  uint32_t instance, begin, end;
  double area = 0.0;         // square metres
  double area_before = 0.0;  // of all chunks before it
};

std::vector<Chunk> make_chunks(const Scene& scene) {
  std::vector<Chunk> chunks;
  for (uint32_t i = 0; i < scene.instances.size(); ++i) {
    const int mesh = scene.instances[i].mesh;
    if (mesh < 0 || !scene.meshes[static_cast<size_t>(mesh)]) continue;
    if (scene.meshes[static_cast<size_t>(mesh)]->is_strands()) continue;  // their segments have no area
    const auto count = static_cast<uint32_t>(scene.meshes[static_cast<size_t>(mesh)]->triangle_count());
    for (uint32_t begin = 0; begin < count; begin += kChunkTriangles)
      chunks.push_back({i, begin, std::min(begin + kChunkTriangles, count)});
  }
  return chunks;
}

struct WorldTriangle {
  Vec3 p0, edge_1, edge_2;
  Vec3 scaled_normal() const { return cross(edge_1, edge_2); }
  double area() const { return 0.5 * length(scaled_normal()); }
};

WorldTriangle world_triangle(const Scene& scene, uint32_t instance, uint32_t triangle) {
  const Instance& i = scene.instances[instance];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(i.mesh)];
  const std::array<Vec3, 3> vertices = mesh.triangle_positions(triangle);
  const Vec3 p0 = i.object_to_world.point(vertices[0]);
  return {p0, i.object_to_world.point(vertices[1]) - p0, i.object_to_world.point(vertices[2]) - p0};
}

/// Calls body(chunk) for all in parallel, until stopped; true if all were visited. Reports from `from` to `to`.
template <class Body>
bool for_each_chunk(std::vector<Chunk>& chunks, const WorkMonitor& monitor, float from, float to, const Body& body) {
  std::atomic<bool> stopped{false};
  std::atomic<size_t> done{0};
  parallel_blocks(chunks.size(), 1, [&](size_t i, size_t, size_t) {
    if (stopped || monitor.stopped()) {
      stopped = true;
      return;
    }
    body(chunks[i]);
    const size_t n = ++done;
    if (monitor.report) monitor.report(lerp(from, to, static_cast<float>(n) / static_cast<float>(chunks.size())));
  });
  return !stopped;
}

/// Where the points along the sum of areas that fall to a chunk begin: point j lies at (j + shift) * step.
struct PointSpacing {
  double step, shift;
  uint32_t count;
  uint32_t first_at(double area) const {
    return static_cast<uint32_t>(std::clamp(std::ceil(area / step - shift), 0.0, static_cast<double>(count)));
  }
};

}  // namespace

std::shared_ptr<const LightCacheCells> LightCacheCells::build(const Scene& scene, uint32_t point_count, uint64_t seed,
                                                              const WorkMonitor& monitor) {
  auto cells = std::make_shared<LightCacheCells>();
  cells->fingerprint_ = fingerprint_of(scene);
  std::vector<Chunk> chunks = make_chunks(scene);
  const auto add_area = [&](Chunk& chunk) {
    for (uint32_t t = chunk.begin; t < chunk.end; ++t) {
      const double area = world_triangle(scene, chunk.instance, t).area();
      if (std::isfinite(area)) chunk.area += area;
    }
  };
  if (!for_each_chunk(chunks, monitor, 0.0f, 0.4f, add_area)) return nullptr;
  double total = 0.0;
  for (Chunk& chunk : chunks) chunk.area_before = std::exchange(total, total + chunk.area);
  Rng rng(seed, 0, 0, kPointStream);
  const PointSpacing spacing{total / point_count, rng.next_double(), total > 0.0 ? point_count : 0};
  std::vector<PackedPoint> points(spacing.count);
  const auto place_points = [&](Chunk& chunk) {
    uint32_t next = spacing.first_at(chunk.area_before);
    const uint32_t end = &chunk == &chunks.back() ? spacing.count : spacing.first_at(chunk.area_before + chunk.area);
    double area_after = 0.0;
    for (uint32_t t = chunk.begin; t < chunk.end && next < end; ++t) {
      const WorldTriangle triangle = world_triangle(scene, chunk.instance, t);
      if (!std::isfinite(triangle.area())) continue;
      area_after += triangle.area();
      // Rounding may leave the chunk's last points beyond its last triangle: they belong to it all the same.
      const bool is_last = t + 1 == chunk.end;
      for (; next < end && (is_last || (next + spacing.shift) * spacing.step < chunk.area_before + area_after);
           ++next) {
        Rng point_rng(seed, next, 1, kPointStream);
        const Vec2 b = square_to_triangle(point_rng.next_vec2());
        const Vec3 normal = normalize_or(triangle.scaled_normal(), {0.0f, 0.0f, 1.0f});
        points[next] = {triangle.p0 + triangle.edge_1 * b.x + triangle.edge_2 * b.y, encode_octahedral(normal)};
      }
    }
  };
  if (spacing.count > 0 && !for_each_chunk(chunks, monitor, 0.4f, 0.9f, place_points)) return nullptr;
  Bounds3 box;
  for (const PackedPoint& p : points) box.extend(p.position);
  cells->set_box(box);
  cells->sort_points(std::move(points));
  if (monitor.report) monitor.report(1.0f);
  return cells;
}

LightCacheCells::Fingerprint LightCacheCells::fingerprint_of(const Scene& scene) {
  Fingerprint fingerprint{{scene.meshes.begin(), scene.meshes.end()}, scene.instances.size()};
  for (const Instance& instance : scene.instances) {
    uint64_t hash = hash_combine(fingerprint.instances, static_cast<uint64_t>(instance.mesh));
    const Transform& m = instance.object_to_world;
    for (const Vec3 row : {m.row_x, m.row_y, m.row_z, m.translation})
      for (const float v : {row.x, row.y, row.z}) hash = hash_combine(hash, std::bit_cast<uint32_t>(v));
    fingerprint.instances = hash;
  }
  return fingerprint;
}

bool LightCacheCells::fits(const Scene& scene) const {
  const Fingerprint other = fingerprint_of(scene);
  const auto is_same = [](const std::weak_ptr<const Mesh>& a, const std::weak_ptr<const Mesh>& b) {
    return !a.owner_before(b) && !b.owner_before(a);
  };
  return other.instances == fingerprint_.instances &&
         std::equal(other.meshes.begin(), other.meshes.end(), fingerprint_.meshes.begin(), fingerprint_.meshes.end(),
                    is_same);
}

void LightCacheCells::set_box(const Bounds3& box) {
  if (box.is_empty()) return;
  const Vec3 extent = box.diagonal();
  const float longest = std::max({extent.x, extent.y, extent.z}), edge = longest > 0.0f ? longest : 1.0f;
  const Vec3 size{edge, edge, edge};
  lower_ = box.lower - size * kLowerMargin;
  cell_size_ = size * (Vec3{1.0f, 1.0f, 1.0f} + kLowerMargin + kUpperMargin) * (1.0f / kResolution);
  const Vec3 last = (box.upper - lower_) * (1.0f / cell_size_.x);  // cells are cubes
  last_ = {std::floor(last.x), std::floor(last.y), std::floor(last.z)};
}

uint32_t LightCacheCells::spatial_cell(Vec3 position) const {
  uint32_t cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float steps = (position[axis] - lower_[axis]) / cell_size_[axis];
    cell = cell * kResolution + static_cast<uint32_t>(std::clamp(steps, 0.0f, last_[axis]));
  }
  return cell;
}

int LightCacheCells::normal_bin(Vec3 normal) {
  const Vec3 turned{dot(kNormalRows[0], normal), dot(kNormalRows[1], normal), dot(kNormalRows[2], normal)};
  const float sum = std::abs(turned.x) + std::abs(turned.y) + std::abs(turned.z);
  float u = turned.x / sum, v = turned.y / sum;
  if (turned.z < 0.0f) {
    const float upper_u = u;
    u = std::copysign(1.0f - std::abs(v), u);
    v = std::copysign(1.0f - std::abs(upper_u), v);
  }
  const auto bin = [](float x) {
    return static_cast<int>(std::clamp(0.5f * kNormalResolution * (x + 1.0f), 0.0f, kNormalResolution - 1.0f));
  };
  return bin(u) * kNormalResolution + bin(v);
}

LightCacheKey LightCacheCells::key_of(Vec3 position, Vec3 normal) const {
  if (occupied_.empty() || !is_finite_vec(position) || !is_finite_vec(normal) || normal == Vec3{})
    return kNoLightCacheKey;
  const uint32_t cell = spatial_cell(position);
  const auto bin = static_cast<uint32_t>(normal_bin(normal));
  return (occupied_[cell] >> bin) & 1 ? cell * kNormalBins + bin : kNoLightCacheKey;
}

/// Counting sort: points of a cell keep their order.
void LightCacheCells::sort_points(std::vector<PackedPoint> points) {
  if (points.empty()) return;
  std::vector<uint32_t> cell_of(points.size());
  first_point_.assign(kSpatialCells + 1, 0);
  occupied_.assign(kSpatialCells, 0);
  for (size_t i = 0; i < points.size(); ++i) {
    cell_of[i] = spatial_cell(points[i].position);
    ++first_point_[cell_of[i] + 1];
    const Vec3 normal = decode_octahedral(points[i].normal);
    occupied_[cell_of[i]] |= (uint64_t{1} << normal_bin(normal)) | (uint64_t{1} << normal_bin(-normal));
  }
  std::partial_sum(first_point_.begin(), first_point_.end(), first_point_.begin());
  for (uint32_t cell = 0; cell < kSpatialCells; ++cell)
    if (occupied_[cell] != 0) occupied_list_.push_back(cell);
  std::vector<uint32_t> next(first_point_.begin(), first_point_.end() - 1);
  points_.resize(points.size());
  for (size_t i = 0; i < points.size(); ++i) points_[next[cell_of[i]]++] = points[i];
}

void LightCacheCells::points_of(LightCacheKey key, size_t max_count, std::vector<SurfacePosition>& points) const {
  points.clear();
  const uint32_t cell = key / kNormalBins;
  const int bin = static_cast<int>(key % kNormalBins);
  for (uint32_t i = first_point_[cell]; i < first_point_[cell + 1]; ++i) {
    const Vec3 normal = decode_octahedral(points_[i].normal);
    if (normal_bin(normal) == bin) points.push_back({points_[i].position, normal});
    if (normal_bin(-normal) == bin) points.push_back({points_[i].position, -normal});
  }
  if (points.size() <= max_count) return;
  for (size_t i = 0; i < max_count; ++i) points[i] = points[(2 * i + 1) * points.size() / (2 * max_count)];
  points.resize(max_count);
}

size_t LightCacheCells::occupied_cells() const {
  size_t count = 0;
  for (const uint64_t bins : occupied_) count += static_cast<size_t>(std::popcount(bins));
  return count;
}

size_t LightCacheCells::memory_bytes() const {
  return points_.capacity() * sizeof(PackedPoint) +
         (first_point_.capacity() + occupied_list_.capacity()) * sizeof(uint32_t) +
         occupied_.capacity() * sizeof(uint64_t) + fingerprint_.meshes.capacity() * sizeof(std::weak_ptr<const Mesh>);
}

}  // namespace cistern
