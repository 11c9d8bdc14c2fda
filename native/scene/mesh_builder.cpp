#include "scene/mesh_builder.h"

#include "base/check.h"
#include "base/parallel.h"
#include "scene/triangulate.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 1 << 14;                     // elements per task
constexpr Vec3 kNormalWithoutDirection{0.0f, 0.0f, 1.0f};  // where the input has a zero or non-finite normal

const char* domain_name(Domain domain) {
  constexpr const char* kNames[] = {"POINT", "FACE", "CORNER"};
  return kNames[static_cast<int>(domain)];
}

size_t domain_size(const MeshInput& input, Domain domain) {
  switch (domain) {
    case Domain::POINT:
      return input.positions.size();
    case Domain::CORNER:
      return input.corner_vertices.size();
    case Domain::FACE:
      break;
  }
  return polygon_count(input);
}

void check_length(const MeshInput& input, const char* what, size_t length, size_t expected) {
  if (length == expected) return;
  throw Error(input.name, std::string(what) + " have " + std::to_string(length) + " elements: must have " +
                              std::to_string(expected));
}

void check_input(const MeshInput& input) {
  check_topology(input);
  const size_t polygons = polygon_count(input);
  if (!input.material_indices.empty()) check_length(input, "material indices", input.material_indices.size(), polygons);
  if (!input.sharp_faces.empty()) check_length(input, "sharp faces", input.sharp_faces.size(), polygons);
  const size_t normals = input.normals_domain == Domain::FACE ? 0 : domain_size(input, input.normals_domain);
  const std::string what = std::string("normals of domain ") + domain_name(input.normals_domain);
  check_length(input, what.c_str(), input.normals.size(), normals);
  for (const MeshAttribute& attribute : input.attributes) {
    if (attribute.components < 1 || attribute.components > 4) {
      throw Error(input.name, "attribute \"" + attribute.name + "\" has " + std::to_string(attribute.components) +
                                  " components: must be 1 to 4");
    }
    if (!attribute.values && domain_size(input, attribute.domain) > 0) {
      throw Error(input.name, "attribute \"" + attribute.name + "\" has no values");
    }
  }
}

uint32_t encode_normal(Vec3 n) { return encode_octahedral(normalize_or(n, kNormalWithoutDirection)); }

/// Range of corners of a polygon.
struct CornerRange {
  size_t begin, end;
};

CornerRange corners_of(const MeshInput& input, size_t polygon) {
  if (input.polygon_offsets.empty()) return {3 * polygon, 3 * polygon + 3};
  return {static_cast<size_t>(input.polygon_offsets[polygon]), static_cast<size_t>(input.polygon_offsets[polygon + 1])};
}

void encode_normals(const MeshInput& input, Mesh& mesh) {
  mesh.normals.resize(input.normals.size());
  parallel_blocks(input.normals.size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) mesh.normals[i] = encode_normal(input.normals[i]);
  });
}

/// With CORNER normals nothing is to be done about sharp faces, for Blender's are flat there already; but where the
/// mesh is to be subdivided, it has no such normals then.
void set_normals(const MeshInput& input, Mesh& mesh) {
  const auto is_sharp = [](uint8_t flag) { return flag != 0; };
  if (input.normals_domain == Domain::FACE || (input.normals_domain == Domain::POINT && !input.sharp_faces.empty() &&
                                               std::ranges::all_of(input.sharp_faces, is_sharp)))
    return;
  mesh.normals_domain = input.normals_domain;
  encode_normals(input, mesh);
  const bool is_smoothed = input.subdivision && input.subdivision->scheme == SubdivisionScheme::CATMULL_CLARK;
  const bool stay_flat = input.normals_domain == Domain::POINT || is_smoothed;
  if (stay_flat && std::ranges::any_of(input.sharp_faces, is_sharp))
    mesh.sharp_polygons.assign(input.sharp_faces.begin(), input.sharp_faces.end());
}

MeshAttribute expand_to_corners(const MeshInput& input, const MeshAttribute& attribute) {
  const size_t components = static_cast<size_t>(attribute.components);
  const std::shared_ptr<float[]> values = std::make_shared<float[]>(input.corner_vertices.size() * components);
  parallel_blocks(polygon_count(input), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t polygon = begin; polygon < end; ++polygon) {
      const CornerRange corners = corners_of(input, polygon);
      for (size_t c = corners.begin; c < corners.end; ++c) {
        std::copy_n(&attribute.values[polygon * components], components, &values[c * components]);
      }
    }
  });
  return {attribute.name, Domain::CORNER, attribute.components, values, attribute.name_hash};
}

void set_attributes(const MeshInput& input, Mesh& mesh) {
  mesh.attributes.reserve(input.attributes.size());
  for (const MeshAttribute& attribute : input.attributes) {
    mesh.attributes.push_back(attribute.domain == Domain::FACE ? expand_to_corners(input, attribute) : attribute);
    mesh.attributes.back().name_hash = attribute_name_hash(attribute.name);
    if (attribute.name == kGeneratedAttribute) mesh.generated_attribute = static_cast<int>(mesh.attributes.size()) - 1;
  }
}

/// Slots beyond 16 bits are beyond any material set too, which then takes its last entry; negative ones mean 0.
uint16_t to_slot(int32_t index) { return static_cast<uint16_t>(std::clamp(index, 0, int32_t{UINT16_MAX})); }

void set_material_slots(const MeshInput& input, Mesh& mesh) {
  const std::span<const int32_t> indices = input.material_indices;
  if (std::ranges::all_of(indices, [](int32_t i) { return i <= 0; })) return;
  mesh.material_slots.resize(mesh.triangle_count());
  parallel_blocks(mesh.triangle_count(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      mesh.material_slots[i] = to_slot(indices[mesh.polygons.empty() ? i : mesh.polygons[i]]);
    }
  });
}

std::vector<float> to_sharpness(std::span<const float> values) {
  std::vector<float> sharpness(values.begin(), values.end());
  for (float& s : sharpness) s = std::isfinite(s) ? std::clamp(s, 0.0f, SubdivisionCage::kSharpest) : 0.0f;
  return sharpness;
}

void check_points(const MeshInput& input, const char* what, std::span<const int32_t> points) {
  const auto count = static_cast<int32_t>(input.positions.size());
  for (const int32_t point : points)
    if (point < 0 || point >= count)
      throw Error(input.name, std::string(what) + " have point " + std::to_string(point) +
                                  ": must be at least 0 and less than " + std::to_string(count));
}

void check_subdivision(const MeshInput& input) {
  const SubdivisionInput& s = *input.subdivision;
  check_points(input, "creases", s.creases);
  check_points(input, "sharp vertices", s.sharp_vertices);
  check_length(input, "creases", s.creases.size(), 2 * s.crease_sharpness.size());
  check_length(input, "sharp vertices", s.sharp_vertices.size(), s.vertex_sharpness.size());
  if (!(s.pixels > 0.0f) || !(s.length >= 0.0f) || !std::isfinite(s.pixels) || !std::isfinite(s.length))
    throw Error(input.name, "is subdivided to edges of " + std::to_string(s.pixels) + " pixels and a length of " +
                                std::to_string(s.length) + ": must be above 0, and at least 0");
  if (s.uv_maps < 0) throw Error(input.name, "has " + std::to_string(s.uv_maps) + " UV maps: must be at least 0");
  for (int i = 0; i < s.uv_maps; ++i)
    if (i >= static_cast<int>(input.attributes.size()) || input.attributes[static_cast<size_t>(i)].components != 2)
      throw Error(input.name, "attribute " + std::to_string(i) + " is no UV map");
}

std::shared_ptr<const SubdivisionCage> make_cage(const MeshInput& input) {
  const SubdivisionInput& s = *input.subdivision;
  auto cage = std::make_shared<SubdivisionCage>();
  cage->scheme = s.scheme;
  cage->uv_smoothing = s.uv_smoothing;
  cage->keeps_corners = s.keeps_corners;
  cage->uv_maps = static_cast<uint32_t>(s.uv_maps);
  for (uint32_t i = 0; i < input.attributes.size(); ++i)
    if (input.attributes[i].domain == Domain::CORNER &&
        std::ranges::find(s.encoded_colors, input.attributes[i].name) != s.encoded_colors.end())
      cage->encoded_colors.push_back(i);
  cage->pixels = s.pixels;
  cage->length = s.length;
  for (size_t polygon = 0; polygon < polygon_count(input); ++polygon)
    cage->offsets.push_back(static_cast<uint32_t>(corners_of(input, polygon).begin));
  cage->offsets.push_back(static_cast<uint32_t>(input.corner_vertices.size()));
  cage->vertices.assign(input.corner_vertices.begin(), input.corner_vertices.end());
  if (std::ranges::any_of(input.material_indices, [](int32_t i) { return i > 0; }))
    for (const int32_t index : input.material_indices) cage->slots.push_back(to_slot(index));
  for (size_t i = 0; i + 1 < s.creases.size(); i += 2)
    cage->creases.push_back({static_cast<uint32_t>(s.creases[i]), static_cast<uint32_t>(s.creases[i + 1])});
  cage->crease_sharpness = to_sharpness(s.crease_sharpness);
  cage->sharp_vertices.assign(s.sharp_vertices.begin(), s.sharp_vertices.end());
  cage->vertex_sharpness = to_sharpness(s.vertex_sharpness);
  return cage;
}

Bounds3 finite_bounds(const std::vector<Vec3>& positions) {
  std::vector<Bounds3> parts(block_count(positions.size(), kBlockSize));
  parallel_blocks(positions.size(), kBlockSize, [&](size_t block, size_t begin, size_t end) {
    Bounds3 bounds;
    for (size_t i = begin; i < end; ++i) {
      if (is_finite(positions[i])) bounds.extend(positions[i]);
    }
    parts[block] = bounds;
  });
  Bounds3 bounds;
  for (const Bounds3& part : parts) bounds.extend(part);
  return bounds;
}

}  // namespace

Mesh build_mesh(const MeshInput& input) {
  check_input(input);
  if (input.subdivision) check_subdivision(input);
  Mesh mesh;
  mesh.name = input.name;
  mesh.corner_count = static_cast<uint32_t>(input.corner_vertices.size());
  set_normals(input, mesh);
  set_attributes(input, mesh);
  const auto is_per_corner = [](const MeshAttribute& a) { return a.domain == Domain::CORNER; };
  const bool with_corners =
      mesh.normals_domain == Domain::CORNER || std::ranges::any_of(mesh.attributes, is_per_corner);
  Triangulation triangulation = triangulate(input, with_corners);
  mesh.vertices = std::move(triangulation.vertices);
  mesh.corners = std::move(triangulation.corners);
  mesh.polygons = std::move(triangulation.polygons);
  mesh.dropped_triangles = triangulation.dropped;
  set_material_slots(input, mesh);
  mesh.positions.reserve(input.positions.size() + 1);
  mesh.positions.assign(input.positions.begin(), input.positions.end());
  mesh.bounds = finite_bounds(mesh.positions);
  mesh.texture_space = input.texture_space;
  if (input.subdivision && mesh.triangle_count() > 0) mesh.cage = make_cage(input);
  return mesh;
}

}  // namespace cistern
