#include "subdivision/dice_mesh.h"

#include <algorithm>
#include <optional>

#include "base/parallel.h"
#include "subdivision/dicing_pattern.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 1 << 14;       // elements per task
constexpr float kSameNormal = 0.9995f;       // cosine; what lies beyond is a crease
constexpr float kFarthestCagePoint = 1e15f;  // in object space
constexpr float kDoubled = 2.0f;

bool is_near(Vec3 p) {
  return std::abs(p.x) <= kFarthestCagePoint && std::abs(p.y) <= kFarthestCagePoint &&
         std::abs(p.z) <= kFarthestCagePoint;  // false for what is not a number
}

/// How many a SquareGrid has at least.
size_t least_squares(const SubdivisionCage& cage) {
  size_t count = 0;
  for (size_t i = 0; i < cage.polygon_count(); ++i) count += cage.size(i) == 4 ? 1 : cage.size(i);
  return count;
}

/// Empty where nothing speaks against it.
std::string reason_against_dicing(const Mesh& mesh, size_t most_triangles) {
  constexpr size_t kMostOfSquare = 6;  // triangles, of one whose sides are all halved for others
  if (kMostOfSquare * least_squares(*mesh.cage) > most_triangles) return "has too many polygons";
  for (size_t i = 0; i < mesh.cage->polygon_count(); ++i)
    if (mesh.cage->size(i) < 3) return "has polygons with fewer than three corners";
  if (!std::ranges::all_of(mesh.positions, is_near)) return "has points that are not finite or too far away";
  return "";
}

/// Whether more than two polygons share an edge, which then is a crease.
bool has_edges_of_many(const SubdivisionCage& cage) {
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  edges.reserve(cage.vertices.size());
  for (size_t polygon = 0; polygon < cage.polygon_count(); ++polygon) {
    const uint32_t size = cage.size(polygon), first = cage.offsets[polygon];
    for (uint32_t i = 0; i < size; ++i)
      edges.push_back(std::minmax(cage.vertices[first + i], cage.vertices[first + (i + 1) % size]));
  }
  std::ranges::sort(edges);
  for (size_t i = 2; i < edges.size(); ++i)
    if (edges[i] == edges[i - 2]) return true;
  return false;
}

class Dicer {
 public:
  Dicer(const Dicing& dicing, const LimitSurface& surface, DicingPattern pattern)
      : source_(*dicing.source), surface_(surface), pattern_(std::move(pattern)) {
    mesh_.name = source_.name;
    mesh_.dicing = std::make_shared<const Dicing>(dicing);
    mesh_.generated_attribute = source_.generated_attribute;
    mesh_.texture_space = source_.texture_space;
    mesh_.normals_domain = normals_domain();
  }

  Mesh run() {
    set_points();
    const auto is_per_corner = [](const MeshAttribute& a) { return a.domain == Domain::CORNER; };
    has_corners_ = mesh_.normals_domain == Domain::CORNER || std::ranges::any_of(source_.attributes, is_per_corner);
    set_triangles();
    if (mesh_.normals_domain == Domain::CORNER) set_corner_normals();
    for (size_t i = 0; i < source_.attributes.size(); ++i)
      mesh_.attributes.push_back(surface_.attribute(i, places(source_.attributes[i].domain)));
    return std::move(mesh_);
  }

 private:
  std::span<const CagePlace> places(Domain domain) const {
    return domain == Domain::POINT ? pattern_.points : pattern_.corners;
  }
  bool is_linear() const { return source_.cage->scheme == SubdivisionScheme::LINEAR; }

  /// Normals are smooth across all edges but creases that stay.
  Domain normals_domain() const {
    if (source_.normals_domain == Domain::FACE || is_linear()) return source_.normals_domain;
    const auto stays = [](float sharpness) { return sharpness >= SubdivisionCage::kSharpest; };
    const bool has_creases = std::ranges::any_of(source_.cage->crease_sharpness, stays);
    return has_creases || has_edges_of_many(*source_.cage) ? Domain::CORNER : Domain::POINT;
  }

  void set_points() {
    const std::vector<LimitSurface::Point>& points = pattern_.limits;
    mesh_.positions.reserve(points.size() + 1);  // see Mesh
    mesh_.positions.resize(points.size());
    point_normals_.resize(points.size());
    parallel_blocks(points.size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        mesh_.positions[i] = points[i].position;
        point_normals_[i] = encode_octahedral(points[i].normal);
      }
    });
    if (mesh_.normals_domain != Domain::POINT) return;
    if (is_linear()) {
      mesh_.normals = interpolated_normals(pattern_.points);
    } else {
      mesh_.normals = std::move(point_normals_);
    }
  }

  /// Triangles without an area are left out.
  void set_triangles() {
    const SubdivisionCage& cage = *source_.cage;
    for (size_t t = 0; t < pattern_.point_triangles.size(); ++t) {
      const TriangleIndices& v = pattern_.point_triangles[t];
      const std::array<Vec3, 3> p{mesh_.positions[v[0]], mesh_.positions[v[1]], mesh_.positions[v[2]]};
      if (!(length_squared(cross(p[1] - p[0], p[2] - p[0])) > 0.0f)) continue;
      for (const Vec3& corner : p) mesh_.bounds.extend(corner);
      mesh_.vertices.push_back(v);
      if (has_corners_) mesh_.corners.push_back(pattern_.corner_triangles[t]);
      if (!source_.sharp_polygons.empty()) mesh_.polygons.push_back(pattern_.polygons[t]);
      if (!cage.slots.empty()) mesh_.material_slots.push_back(cage.slots[pattern_.polygons[t]]);
    }
    mesh_.sharp_polygons = source_.sharp_polygons;
    mesh_.corner_count = static_cast<uint32_t>(has_corners_ ? pattern_.corners.size() : 0);
  }

  /// As those of points where they are nearly the same.
  void set_corner_normals() {
    if (is_linear()) {
      mesh_.normals = interpolated_normals(pattern_.corners);
      return;
    }
    const std::vector<LimitSurface::Point> corners = surface_.points(pattern_.corners);
    mesh_.normals.resize(corners.size());
    for (size_t t = 0; t < mesh_.vertices.size(); ++t) {
      for (size_t j = 0; j < 3; ++j) {
        const uint32_t corner = mesh_.corners[t][j], of_point = point_normals_[mesh_.vertices[t][j]];
        const Vec3 normal = corners[corner].normal;
        mesh_.normals[corner] =
            dot(normal, decode_octahedral(of_point)) > kSameNormal ? of_point : encode_octahedral(normal);
      }
    }
  }

  /// The cage's own.
  std::vector<uint32_t> interpolated_normals(std::span<const CagePlace> at) const {
    const std::shared_ptr<float[]> values = std::make_shared<float[]>(3 * source_.normals.size());
    for (size_t i = 0; i < source_.normals.size(); ++i) {
      const Vec3 normal = decode_octahedral(source_.normals[i]);
      std::copy_n(&normal.x, 3, &values[3 * i]);
    }
    const MeshAttribute blended = surface_.interpolate({"", source_.normals_domain, 3, values}, at);
    std::vector<uint32_t> normals(at.size());
    for (size_t i = 0; i < normals.size(); ++i) {
      const float* n = &blended.values[3 * i];
      normals[i] = encode_octahedral(normalize_or({n[0], n[1], n[2]}, {0.0f, 0.0f, 1.0f}));
    }
    return normals;
  }

  const Mesh& source_;
  const LimitSurface& surface_;
  DicingPattern pattern_;
  Mesh mesh_;
  std::vector<uint32_t> point_normals_;
  bool has_corners_ = false;
};

}  // namespace

void dice_mesh(DicedMesh& diced, const std::function<bool()>& is_stopped, size_t most_triangles) {
  const Dicing& dicing = diced.dicing;
  const Mesh &source = *dicing.source, &shape = *dicing.cut_as;
  diced.mesh = dicing.source;
  const auto warn = [&](const std::string& text) { diced.warning = "Mesh '" + source.name + "' " + text; };
  const auto refuse = [&](const std::string& reason) { warn(reason + ": it is not subdivided adaptively"); };
  if (const std::string reason = reason_against_dicing(source, most_triangles); !reason.empty()) return refuse(reason);
  const LimitSurface surface(source);
  if (!surface.exists()) return refuse("has polygons that OpenSubdiv refuses");
  std::optional<LimitSurface> of_shape;
  if (&shape != &source) of_shape.emplace(shape);
  for (float coarsening = 1.0f;; coarsening *= kDoubled) {
    const LongestEdge longest(dicing.view, *shape.cage, dicing.object_to_world, coarsening);
    DicingPattern pattern = cut_polygons(shape, of_shape ? *of_shape : surface, longest, dicing.view.most_levels,
                                         most_triangles, is_stopped);
    if (is_stopped && is_stopped()) {
      diced.mesh = nullptr;
      return;
    }
    if (pattern.is_too_fine) continue;
    if (of_shape) pattern.limits = surface.points(pattern.points);
    diced.mesh = std::make_shared<const Mesh>(Dicer(dicing, surface, std::move(pattern)).run());
    if (coarsening > 1.0f)
      warn("would be subdivided into more than " + std::to_string(most_triangles) + " triangles: its edges are " +
           std::to_string(static_cast<int64_t>(std::min(coarsening, 1e9f))) + " times as long as asked for");
    return;
  }
}

}  // namespace cistern
