#include "accel/strand_geometry.h"

namespace cistern {
namespace {

struct Key {
  Vec3 position;
  float radius;
};

Key key_of(const Mesh& mesh, uint32_t i) { return {mesh.positions[i], mesh.radii[i]}; }

RTCGeometryType embree_type(StrandShape shape) {
  switch (shape) {
    case StrandShape::LINES:
      return RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE;
    case StrandShape::BALLS:
      return RTC_GEOMETRY_TYPE_SPHERE_POINT;
    default:
      return RTC_GEOMETRY_TYPE_ROUND_CATMULL_ROM_CURVE;
  }
}

void refuse_insides(const RTCFilterFunctionNArguments* arguments) {
  RTCRayN* const ray = arguments->ray;
  RTCHitN* const hit = arguments->hit;
  const unsigned n = arguments->N;
  for (unsigned i = 0; i < n; ++i) {
    const Vec3 direction{RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i)};
    const Vec3 normal{RTCHitN_Ng_x(hit, n, i), RTCHitN_Ng_y(hit, n, i), RTCHitN_Ng_z(hit, n, i)};
    if (!(dot(direction, normal) <= 0.0f)) arguments->valid[i] = 0;  // nor what is no number
  }
}

bool is_first(const Mesh& mesh, size_t i) { return i == 0 || mesh.polygons[i] != mesh.polygons[i - 1]; }
bool is_last(const Mesh& mesh, size_t i) {
  return i + 1 == mesh.vertices.size() || mesh.polygons[i] != mesh.polygons[i + 1];
}

size_t count_strands(const Mesh& mesh) {
  size_t count = 0;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) count += is_first(mesh, i);
  return count;
}

/// Embree reads four keys from each segment's index on: every strand has its first and its last key twice. Of straight
/// segments it reads two keys, and the flags tell which of them goes on.
void fill(const Mesh& mesh, Key* keys, uint32_t* indices, uint8_t* flags) {
  const auto key = [&](uint32_t i) { return key_of(mesh, i); };
  const bool repeats = mesh.strand_shape == StrandShape::SPLINES;
  uint32_t next = 0;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (is_first(mesh, i)) {
      keys[next++] = key(mesh.vertices[i][0]);
      if (repeats) keys[next++] = key(mesh.vertices[i][0]);
    }
    indices[i] = repeats ? next - 2 : next - 1;
    keys[next++] = key(mesh.vertices[i][1]);
    if (is_last(mesh, i) && repeats) keys[next++] = key(mesh.vertices[i][1]);
    if (flags != nullptr)
      flags[i] = static_cast<uint8_t>((is_first(mesh, i) ? 0 : RTC_CURVE_FLAG_NEIGHBOR_LEFT) |
                                      (is_last(mesh, i) ? 0 : RTC_CURVE_FLAG_NEIGHBOR_RIGHT));
  }
}

}  // namespace

EmbreeGeometry strand_geometry(const EmbreeDevice& device, const Mesh& mesh) {
  const StrandShape shape = mesh.strand_shape;
  EmbreeGeometry geometry(rtcNewGeometry(device.get(), embree_type(shape)));
  device.check("making strands of \"" + mesh.name + "\"");
  const auto new_buffer = [&](RTCBufferType type, RTCFormat format, size_t stride, size_t count) {
    return rtcSetNewGeometryBuffer(geometry.get(), type, 0, format, stride, count);
  };
  const size_t segments = mesh.vertices.size();
  const size_t keys =
      shape == StrandShape::BALLS ? segments : segments + (shape == StrandShape::LINES ? 1 : 3) * count_strands(mesh);
  auto* const key_buffer = static_cast<Key*>(new_buffer(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, sizeof(Key), keys));
  void *indices = nullptr, *flags = nullptr;
  if (shape != StrandShape::BALLS)
    indices = new_buffer(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, sizeof(uint32_t), segments);
  if (shape == StrandShape::LINES) flags = new_buffer(RTC_BUFFER_TYPE_FLAGS, RTC_FORMAT_UCHAR, 1, segments);
  device.check("sharing strands of \"" + mesh.name + "\"");
  if (shape == StrandShape::BALLS) {
    for (size_t i = 0; i < segments; ++i) key_buffer[i] = key_of(mesh, mesh.vertices[i][0]);
  } else {
    fill(mesh, key_buffer, static_cast<uint32_t*>(indices), static_cast<uint8_t*>(flags));
  }
  rtcSetGeometryIntersectFilterFunction(geometry.get(), refuse_insides);
  rtcSetGeometryOccludedFilterFunction(geometry.get(), refuse_insides);
  return geometry;
}

}  // namespace cistern
