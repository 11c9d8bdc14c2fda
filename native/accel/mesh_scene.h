#pragma once

#include <memory>

#include "accel/embree_device.h"
#include "base/transform.h"
#include "scene/mesh.h"

namespace cistern {

/// Embree's scene of one mesh in object space, for instances; shared between snapshots.
struct MeshScene {
  std::shared_ptr<const EmbreeDevice> device;
  std::shared_ptr<const Mesh> mesh;
  EmbreeScene scene;
  bool is_filtered = false;
  size_t memory_bytes = 0;  // set once by the accel that had it built
};

/// Builds with the threads of the caller's arena; `is_filtered` as in new_scene. Null when stopped. Throws Error naming
/// the mesh.
std::shared_ptr<MeshScene> build_mesh_scene(std::shared_ptr<const EmbreeDevice> device,
                                            std::shared_ptr<const Mesh> mesh, bool is_filtered,
                                            const IsStopped& is_stopped);

/// Triangles of `mesh` in world space, committed. Refers to arrays of the mesh, which has to outlive it.
EmbreeGeometry flattened_geometry(const EmbreeDevice& device, const Mesh& mesh, const Transform& object_to_world);

}  // namespace cistern
