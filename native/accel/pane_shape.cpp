#include "accel/pane_shape.h"

#include <algorithm>
#include <numeric>

namespace cistern {
namespace {

constexpr size_t kMostTriangles = 4096;
constexpr size_t kDirections = 12;  // that most of the area has to lie in
constexpr size_t kMostClusters = 64;
constexpr double kLeastShare = 0.5;
constexpr float kSameDirection = 0.999f, kFlat = 0.9999f;  // cosines

/// Area of planes in one direction, whichever way they face.
struct Cluster {
  Vec3 normal;
  double area = 0.0;
};

bool is_flat(const Mesh& mesh, size_t triangle, Vec3 normal) {
  if (mesh.is_flat(triangle)) return true;
  const TriangleIndices& places =
      mesh.normals_domain == Domain::POINT ? mesh.vertices[triangle] : mesh.corners[triangle];
  return std::ranges::all_of(
      places, [&](uint32_t i) { return std::abs(dot(decode_octahedral(mesh.normals[i]), normal)) > kFlat; });
}

void add(std::vector<Cluster>& clusters, Vec3 normal, double area) {
  const auto known = std::ranges::find_if(
      clusters, [&](const Cluster& c) { return std::abs(dot(c.normal, normal)) > kSameDirection; });
  if (known != clusters.end()) {
    known->area += area;
  } else if (clusters.size() < kMostClusters) {
    clusters.push_back({normal, area});
  }
}

}  // namespace

bool has_pane_shape(const Scene& scene, const Instance& instance) {
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  if (mesh.is_strands()) return false;
  std::vector<Cluster> clusters;
  double all = 0.0;
  const size_t step = mesh.triangle_count() / kMostTriangles + 1;
  for (size_t i = 0; i < mesh.triangle_count(); i += step) {
    const int material = scene.material_of(instance, static_cast<uint32_t>(i));
    const auto* const program = material < 0 ? nullptr : scene.materials[static_cast<size_t>(material)].get();
    if (!program || !program->may_be_pane) continue;
    const auto [a, b, c] = mesh.triangle_positions(i);
    const Vec3 scaled = cross(b - a, c - a);
    const float twice_area = length(scaled);
    if (!(twice_area > 0.0f)) continue;
    all += twice_area;
    const Vec3 normal = scaled * (1.0f / twice_area);
    if (is_flat(mesh, i, normal)) add(clusters, normal, twice_area);
  }
  const size_t count = std::min(clusters.size(), kDirections);
  std::ranges::partial_sort(clusters, clusters.begin() + static_cast<std::ptrdiff_t>(count), std::ranges::greater{},
                            &Cluster::area);
  const double most = std::accumulate(clusters.begin(), clusters.begin() + static_cast<std::ptrdiff_t>(count), 0.0,
                                      [](double sum, const Cluster& c) { return sum + c.area; });
  return all > 0.0 && most >= kLeastShare * all;
}

}  // namespace cistern
