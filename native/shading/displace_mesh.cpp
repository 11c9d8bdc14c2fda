#include "shading/displace_mesh.h"

#include <cmath>
#include <unordered_map>

#include "base/parallel.h"
#include "scene/smooth_normals.h"
#include "shading/material.h"
#include "shading/mesh_interpolation.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 1 << 10;  // vertices per task
constexpr uint32_t kNoCorner = 0xffffffffu;

Vec3 area_vector(const Mesh& mesh, size_t triangle) {
  const auto [p0, p1, p2] = mesh.triangle_positions(triangle);
  return cross(p1 - p0, p2 - p0);
}

/// Values at points, at the vertices that take their place.
MeshAttribute gather(const MeshAttribute& attribute, const std::vector<uint32_t>& points) {
  const auto components = static_cast<size_t>(attribute.components);
  const std::shared_ptr<float[]> values = std::make_shared<float[]>(points.size() * components);
  for (size_t i = 0; i < points.size(); ++i)
    std::copy_n(&attribute.values[points[i] * components], components, &values[i * components]);
  return {attribute.name, attribute.domain, attribute.components, values, attribute.name_hash};
}

/// The vertices that take the place of points: one for each normal that a point has at its corners.
class NormalSplit {
 public:
  explicit NormalSplit(Mesh& mesh) : mesh_(mesh) {}

  void run() {
    for (size_t t = 0; t < mesh_.triangle_count(); ++t)
      for (size_t j = 0; j < 3; ++j)
        mesh_.vertices[t][j] = vertex(mesh_.vertices[t][j], mesh_.normals[mesh_.corners[t][j]]);
    std::vector<Vec3> positions;
    positions.reserve(points_.size() + 1);  // see Mesh
    for (const uint32_t point : points_) positions.push_back(mesh_.positions[point]);
    for (MeshAttribute& attribute : mesh_.attributes)
      if (attribute.domain == Domain::POINT) attribute = gather(attribute, points_);
    mesh_.positions = std::move(positions);
    mesh_.normals = std::move(normals_);
    mesh_.normals_domain = Domain::POINT;
  }

 private:
  uint32_t vertex(uint32_t point, uint32_t normal) {
    const auto next = static_cast<uint32_t>(points_.size());
    const auto [known, is_new] = vertices_.try_emplace(uint64_t{point} << 32 | normal, next);
    if (is_new) {
      points_.push_back(point);
      normals_.push_back(normal);
    }
    return known->second;
  }

  Mesh& mesh_;
  std::unordered_map<uint64_t, uint32_t> vertices_;  // by point and normal
  std::vector<uint32_t> points_, normals_;           // by vertex
};

class Displacer {
 public:
  Displacer(DisplacedMesh& displaced, const Scene& scene, uint32_t instance)
      : displaced_(displaced), source_(*displaced.source), scene_(scene), index_(instance), mesh_(source_) {
    mesh_.undisplaced = displaced.source;
    if (source_.normals_domain == Domain::CORNER) NormalSplit(mesh_).run();
    if (source_.normals_domain == Domain::FACE) flat_normals_ = smooth_normals(source_);
  }

  void run(const std::function<bool()>& is_stopped) {
    find_corners();
    move_vertices(is_stopped);
    if (is_stopped && is_stopped()) return;
    renew_normals();
    keep_normals_for_bump();
    mesh_.bounds = {};
    for (const Vec3& p : mesh_.positions)
      if (is_finite(p)) mesh_.bounds.extend(p);
    displaced_.mesh = std::make_shared<const Mesh>(std::move(mesh_));
  }

 private:
  const Instance& instance() const { return scene_.instances[index_]; }
  /// Of a triangle; null: does not move it.
  const MaterialProgram* program(size_t triangle) const {
    const size_t slot = mesh_.material_slots.empty() ? 0 : mesh_.material_slots[triangle];
    return displaced_.programs[std::min(slot, displaced_.programs.size() - 1)].get();
  }

  void find_corners() {
    corner_of_.assign(mesh_.positions.size(), kNoCorner);
    for (uint32_t t = 0; t < mesh_.triangle_count(); ++t) {
      if (program(t) == nullptr) continue;
      for (uint32_t j = 0; j < 3; ++j) {
        uint32_t& corner = corner_of_[mesh_.vertices[t][j]];
        if (corner == kNoCorner) corner = 3 * t + j;
      }
    }
  }

  SurfacePoint point_at(size_t vertex) const {
    const uint32_t corner = corner_of_[vertex];
    const Transform& object_to_world = instance().object_to_world;
    SurfacePoint point;
    point.triangle = corner / 3;
    point.instance = index_;
    point.barycentric = {corner % 3 == 1 ? 1.0f : 0.0f, corner % 3 == 2 ? 1.0f : 0.0f};
    point.material = scene_.material_of(instance(), point.triangle);
    point.position = object_to_world.point(mesh_.positions[vertex]);
    const Vec3 normal = flat_normals_.empty() ? decode_octahedral(mesh_.normals[vertex]) : flat_normals_[vertex];
    point.ng = normalize_or(transform_normal(object_to_world, area_vector(mesh_, point.triangle)), normal);
    point.ns = point.wo = normalize_or(transform_normal(object_to_world, normal), point.ng);
    return point;
  }

  void move_vertices(const std::function<bool()>& is_stopped) {
    const Transform world_to_object = inverse(instance().object_to_world);
    const size_t count = mesh_.positions.size();
    std::vector<Vec3> moved(count);
    std::vector<size_t> kept(block_count(count, kBlockSize));
    parallel_blocks(count, kBlockSize, [&](size_t block, size_t begin, size_t end) {
      if (is_stopped && is_stopped()) return;
      for (size_t v = begin; v < end; ++v) {
        moved[v] = mesh_.positions[v];
        if (corner_of_[v] == kNoCorner) continue;
        const Vec3 p = moved[v] + world_to_object.vector(evaluate_displacement(scene_, point_at(v)));
        if (is_near(p)) {
          moved[v] = p;
        } else {
          ++kept[block];
        }
      }
    });
    std::copy(moved.begin(), moved.end(), mesh_.positions.begin());
    size_t total = 0;
    for (const size_t of_block : kept) total += of_block;
    if (total > 0) warn(total);
  }

  static bool is_near(Vec3 p) {
    return std::abs(p.x) <= kFarthestCoordinate && std::abs(p.y) <= kFarthestCoordinate &&
           std::abs(p.z) <= kFarthestCoordinate;  // false for what is not a number
  }

  void warn(size_t count) {
    std::string names;
    for (const auto& program : displaced_.programs) {
      if (!program) continue;
      const std::string name = (names.empty() ? "'" : ", '") + program->name + "'";
      if (names.find("'" + program->name + "'") == std::string::npos) names += name;
    }
    displaced_.warning = "Object '" + scene_.object_names[static_cast<size_t>(instance().object)] +
                         "': displacement by material " + names + " is not finite or too far at " +
                         std::to_string(count) + (count == 1 ? " vertex, which stays" : " vertices, which stay") +
                         " in place";
  }

  void renew_normals() {
    if (mesh_.normals_domain == Domain::FACE) return;
    std::vector<Vec3> sums(mesh_.positions.size());
    std::vector<bool> is_renewed(sums.size());
    for (size_t t = 0; t < mesh_.triangle_count(); ++t) {
      const MaterialProgram* moving = program(t);
      if (moving == nullptr || moving->keeps_normals()) continue;
      const Vec3 normal = normalize_or(area_vector(mesh_, t), {});
      for (const uint32_t v : mesh_.vertices[t]) {
        sums[v] += normal;
        is_renewed[v] = true;
      }
    }
    for (size_t v = 0; v < sums.size(); ++v)
      if (is_renewed[v])
        mesh_.normals[v] = encode_octahedral(normalize_or(sums[v], decode_octahedral(mesh_.normals[v])));
  }

  void keep_normals_for_bump() {
    const auto keeps = [](const auto& program) { return program && program->keeps_normals(); };
    if (flat_normals_.empty() || std::ranges::none_of(displaced_.programs, keeps)) return;
    for (const Vec3& normal : flat_normals_) mesh_.undisplaced_normals.push_back(encode_octahedral(normal));
  }

  DisplacedMesh& displaced_;
  const Mesh& source_;
  const Scene& scene_;
  uint32_t index_;
  Mesh mesh_;
  std::vector<Vec3> flat_normals_;   // of a flat mesh, at its points
  std::vector<uint32_t> corner_of_;  // by vertex: three times the triangle that moves it, and its place there
};

}  // namespace

void displace_mesh(DisplacedMesh& displaced, const Scene& scene, uint32_t instance,
                   const std::function<bool()>& is_stopped) {
  Displacer(displaced, scene, instance).run(is_stopped);
}

}  // namespace cistern
