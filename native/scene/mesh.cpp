#include "scene/mesh.h"

#include "scene/diced_mesh.h"

namespace cistern {
namespace {

constexpr float kSnormScale = 32767.0f;

/// The octahedron unfolded: the lower half is mirrored outwards about the diagonals.
Vec2 wrap_lower_half(Vec2 p) {
  return {(1.0f - std::abs(p.y)) * std::copysign(1.0f, p.x), (1.0f - std::abs(p.x)) * std::copysign(1.0f, p.y)};
}

uint32_t to_snorm16(float x) {
  const float scaled = std::clamp(x, -1.0f, 1.0f) * kSnormScale;
  return static_cast<uint16_t>(static_cast<int16_t>(scaled + std::copysign(0.5f, scaled)));
}

float from_snorm16(uint32_t code) { return static_cast<float>(static_cast<int16_t>(code & 0xffffu)) / kSnormScale; }

}  // namespace

bool Mesh::is_flat(size_t triangle) const {
  if (normals_domain == Domain::FACE || normals.empty()) return true;
  return !sharp_polygons.empty() && sharp_polygons[polygons.empty() ? triangle : polygons[triangle]] != 0;
}

TriangleIndices Mesh::elements(uint32_t triangle, Domain domain) const {
  switch (domain) {
    case Domain::POINT:
      return vertices[triangle];
    case Domain::CORNER:
      return corners[triangle];
    case Domain::FACE:
      break;
  }
  const uint32_t polygon = polygons.empty() ? triangle : polygons[triangle];
  return {polygon, polygon, polygon};
}

int Mesh::find_attribute(const std::string& attribute_name) const {
  for (size_t i = 0; i < attributes.size(); ++i) {
    if (attributes[i].name == attribute_name) return static_cast<int>(i);
  }
  return -1;
}

int Mesh::find_attribute(uint32_t name_hash) const {
  for (size_t i = 0; i < attributes.size(); ++i)
    if (attributes[i].name_hash == name_hash) return static_cast<int>(i);
  return -1;
}

int Mesh::first_uv_map() const { return !attributes.empty() && attributes[0].components == 2 ? 0 : -1; }

const Bounds3& Mesh::generated_bounds() const {
  return original().dicing ? original().dicing->source->bounds : original().bounds;
}

uint32_t encode_octahedral(Vec3 n) {
  const float inv_l1 = 1.0f / (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
  Vec2 p{n.x * inv_l1, n.y * inv_l1};
  if (n.z < 0.0f) p = wrap_lower_half(p);
  return to_snorm16(p.x) | (to_snorm16(p.y) << 16);
}

Vec3 decode_octahedral(uint32_t code) {
  const Vec2 p{from_snorm16(code), from_snorm16(code >> 16)};
  const float z = 1.0f - std::abs(p.x) - std::abs(p.y);
  const Vec2 q = z < 0.0f ? wrap_lower_half(p) : p;
  return normalize({q.x, q.y, z});
}

namespace {

size_t element_count(const Mesh& mesh, const MeshAttribute& attribute) {
  return attribute.domain == Domain::POINT ? mesh.positions.size() : mesh.corner_count;
}

/// Of meshes with equally many points and corners.
bool is_same_attribute(const Mesh& mesh, const MeshAttribute& a, const MeshAttribute& b) {
  if (a.name != b.name || a.domain != b.domain || a.components != b.components) return false;
  const size_t count = element_count(mesh, a) * static_cast<size_t>(a.components);
  return a.values == b.values || std::equal(a.values.get(), a.values.get() + count, b.values.get());
}

}  // namespace

bool is_same_mesh(const Mesh& a, const Mesh& b) {
  const bool has_same_surface =
      a.name == b.name && a.positions == b.positions && a.vertices == b.vertices && a.corners == b.corners &&
      a.polygons == b.polygons && a.material_slots == b.material_slots && a.corner_count == b.corner_count &&
      a.radii == b.radii && a.texture_space == b.texture_space && a.strand_shape == b.strand_shape &&
      is_same_cloud(a.splats.get(), b.splats.get()) && a.dropped_triangles == b.dropped_triangles;
  const bool has_same_volume = a.volume == b.volume || (a.volume && b.volume && is_same_volume(*a.volume, *b.volume));
  const bool has_same_cage = a.cage == b.cage || (a.cage && b.cage && *a.cage == *b.cage);
  return has_same_surface && has_same_volume && has_same_cage && a.normals_domain == b.normals_domain &&
         a.normals == b.normals && a.sharp_polygons == b.sharp_polygons &&
         std::ranges::equal(a.attributes, b.attributes,
                            [&](const MeshAttribute& x, const MeshAttribute& y) { return is_same_attribute(a, x, y); });
}

size_t memory_bytes(const SubdivisionCage& cage) {
  return (cage.offsets.capacity() + cage.vertices.capacity() + cage.sharp_vertices.capacity()) * sizeof(uint32_t) +
         cage.slots.capacity() * sizeof(uint16_t) + cage.creases.capacity() * sizeof(cage.creases[0]) +
         (cage.crease_sharpness.capacity() + cage.vertex_sharpness.capacity()) * sizeof(float);
}

size_t memory_bytes(const Mesh& mesh) {
  size_t bytes = mesh.positions.capacity() * sizeof(Vec3) + mesh.vertices.capacity() * sizeof(TriangleIndices) +
                 mesh.corners.capacity() * sizeof(TriangleIndices) + mesh.polygons.capacity() * sizeof(uint32_t) +
                 mesh.material_slots.capacity() * sizeof(uint16_t) + mesh.normals.capacity() * sizeof(uint32_t) +
                 mesh.sharp_polygons.capacity() + mesh.radii.capacity() * sizeof(float) +
                 mesh.undisplaced_normals.capacity() * sizeof(uint32_t);
  if (mesh.cage) bytes += memory_bytes(*mesh.cage);
  if (mesh.volume) bytes += mesh.volume->memory_bytes();
  if (mesh.splats) bytes += mesh.splats->memory_bytes();
  for (const MeshAttribute& attribute : mesh.attributes) {
    bytes += element_count(mesh, attribute) * static_cast<size_t>(attribute.components) * sizeof(float);
  }
  return bytes;
}

}  // namespace cistern
