#pragma once

#include "scene/scene.h"
#include "shading/dispersion.h"
#include "transport/media.h"

namespace cistern::binding {

/// Python's `Scene`: shares an immutable snapshot.
struct SceneHandle {
  std::shared_ptr<const Scene> scene;
  std::vector<std::string> warnings;  // of displacement

  /// As rendered: every instance counts its mesh.
  size_t triangle_count() const {
    size_t count = 0;
    for (const Instance& instance : scene->instances)
      if (instance.mesh >= 0) count += scene->meshes[instance.mesh]->triangle_count();
    return count;
  }
  /// Name of a material with a volume, empty without any.
  std::string volume_name() const { return Media::find_name(*scene); }
  std::string dispersive_name() const { return find_dispersive_material(*scene); }
  /// What `change` makes of the snapshot; it brings no warnings of its own.
  SceneHandle with(Scene (*change)(const Scene&)) const { return {std::make_shared<const Scene>(change(*scene)), {}}; }
  size_t instance_count() const {
    size_t count = 0;
    for (const Instance& instance : scene->instances) count += instance.mesh >= 0;
    return count;
  }
};

}  // namespace cistern::binding
