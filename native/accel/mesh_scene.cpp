#include "accel/mesh_scene.h"

#include "accel/splat_geometry.h"
#include "accel/strand_geometry.h"
#include "base/parallel.h"

namespace cistern {
namespace {

constexpr size_t kBlockSize = 1 << 14;  // vertices per task

/// A geometry over the mesh's triangles, without positions.
EmbreeGeometry new_geometry(const EmbreeDevice& device, const Mesh& mesh) {
  EmbreeGeometry geometry(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.vertices.data(), 0,
                             sizeof(TriangleIndices), mesh.vertices.size());
  device.check("sharing triangles of \"" + mesh.name + "\"");
  return geometry;
}

/// Embree reads 16 bytes at the last position: shared where the mesh has that room, else transformed into Embree's own.
void set_positions(RTCGeometry geometry, const Mesh& mesh, const Transform& object_to_world) {
  const bool has_room = mesh.positions.capacity() > mesh.positions.size();
  if (has_room && object_to_world == Transform{}) {
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.positions.data(), 0,
                               sizeof(Vec3), mesh.positions.size());
    return;
  }
  Vec3* const world_positions = static_cast<Vec3*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3), mesh.positions.size()));
  if (!world_positions) return;  // an error that the caller's check reports
  parallel_blocks(mesh.positions.size(), kBlockSize, [&](size_t, size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) world_positions[i] = object_to_world.point(mesh.positions[i]);
  });
}

EmbreeGeometry own_geometry(const EmbreeDevice& device, const Mesh& mesh) {
  if (mesh.splats) return splat_geometry(device, mesh);
  return mesh.is_strands() ? strand_geometry(device, mesh) : flattened_geometry(device, mesh, Transform{});
}

}  // namespace

EmbreeGeometry flattened_geometry(const EmbreeDevice& device, const Mesh& mesh, const Transform& object_to_world) {
  EmbreeGeometry geometry = new_geometry(device, mesh);
  set_positions(geometry.get(), mesh, object_to_world);
  device.check("sharing positions of \"" + mesh.name + "\"");
  return geometry;
}

std::shared_ptr<MeshScene> build_mesh_scene(std::shared_ptr<const EmbreeDevice> device,
                                            std::shared_ptr<const Mesh> mesh, bool is_filtered,
                                            const IsStopped& is_stopped) {
  const EmbreeGeometry geometry = own_geometry(*device, *mesh);
  rtcSetGeometryMask(geometry.get(), ~0u);  // visibility is the instance's
  rtcCommitGeometry(geometry.get());
  EmbreeScene scene = new_scene(*device, is_filtered);
  rtcAttachGeometryByID(scene.get(), geometry.get(), 0);
  if (!commit_scene(*device, scene.get(), is_stopped, "building \"" + mesh->name + "\"")) return nullptr;
  return std::make_shared<MeshScene>(MeshScene{std::move(device), std::move(mesh), std::move(scene), is_filtered, 0});
}

}  // namespace cistern
