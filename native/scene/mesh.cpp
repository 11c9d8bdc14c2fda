#include "scene/mesh.h"

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

int Mesh::find_attribute(const std::string& attribute_name) const {
  for (size_t i = 0; i < attributes.size(); ++i) {
    if (attributes[i].name == attribute_name) return static_cast<int>(i);
  }
  return -1;
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

size_t memory_bytes(const Mesh& mesh) {
  size_t bytes = mesh.positions.capacity() * sizeof(Vec3) + mesh.vertices.capacity() * sizeof(TriangleIndices) +
                 mesh.corners.capacity() * sizeof(TriangleIndices) + mesh.polygons.capacity() * sizeof(uint32_t) +
                 mesh.material_slots.capacity() * sizeof(uint16_t) + mesh.normals.capacity() * sizeof(uint32_t);
  for (const MeshAttribute& attribute : mesh.attributes) {
    const size_t elements = attribute.domain == Domain::POINT ? mesh.positions.size() : mesh.corner_count;
    bytes += elements * static_cast<size_t>(attribute.components) * sizeof(float);
  }
  return bytes;
}

}  // namespace cistern
