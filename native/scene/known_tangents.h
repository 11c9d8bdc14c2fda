#pragma once

#include <map>
#include <utility>

#include "scene/scene.h"

namespace cistern {

/// Tangents of meshes, kept from one snapshot to the next.
class KnownTangents {
 public:
  KnownTangents() = default;
  /// Knows those of a snapshot.
  explicit KnownTangents(const Scene& scene);
  /// Scene::tangents: those that the materials of the scene's instances read of their meshes.
  std::vector<std::vector<MeshTangents>> of(const Scene& scene);

 private:
  struct Known {
    std::weak_ptr<const Mesh> mesh;
    std::shared_ptr<const CornerTangents> corners;
  };
  using Key = std::pair<const Mesh*, int>;  // and the attribute
  std::map<Key, Known> known_;
};

}  // namespace cistern
