#pragma once

#include <span>

#include "base/moving_transform.h"
#include "scene/scene.h"

namespace cistern {

/// A scene while a shutter is open: as it stands when that is half over, when it opens and when it closes. Between
/// these instants cameras and instances go by MovingTransform, and points of meshes straight. Instances are the same
/// thing where their keys are equal, those without a key where their handles are. What is not there at an instant,
/// meshes that change more than their points and normals, and cameras that are mirrored stand as in the middle; so do
/// lamps, materials and the environment (as in Cycles). What is shrunk to nothing at an end is there.
class Shutter {
 public:
  Shutter(std::shared_ptr<const Scene> middle, const Scene& opening, const Scene& closing);

  const std::shared_ptr<const Scene>& middle() const { return middle_; }
  bool moves_anything() const { return moves_camera_ || moves_surfaces(); }
  bool moves_surfaces() const { return !instances_.empty() || !meshes_.empty(); }

  /// The scene at a time between 0 (the shutter opens) and 1 (it closes). What rests is shared.
  std::shared_ptr<const Scene> at(float time) const;

 private:
  /// Before and after the middle.
  template <class T>
  struct Halves {
    T before, after;
  };
  struct MovingInstance {
    size_t instance;
    Halves<MovingTransform> object_to_world;
  };
  struct MovingMesh {
    size_t mesh;
    Halves<std::shared_ptr<const Mesh>> ends;
  };
  static std::shared_ptr<const Mesh> between(const Mesh& middle, const Mesh& end, float t);

  std::shared_ptr<const Scene> middle_;
  Halves<Camera> cameras_;
  Halves<MovingTransform> eye_;
  bool moves_camera_;
  std::vector<MovingInstance> instances_;
  std::vector<MovingMesh> meshes_;
};

/// The time by which a share `u` in [0, 1) of the light is in that a shutter lets in between 0 and 1. `openness` (none
/// negative, some positive) is at even steps from opening to closing, and straight between; empty: the same all along.
float time_of_exposure(std::span<const float> openness, float u);

}  // namespace cistern
