#pragma once

#include <span>

#include "base/moving_transform.h"
#include "scene/scene.h"

namespace cistern {

/// A scene while a shutter is open: as it stands when that is half over, and at other moments. Between these cameras
/// and instances go by MovingTransform, and points of meshes straight. Instances are the same thing where their keys
/// are equal, those without a key where their handles are. What is not there at a moment, meshes that are more than
/// other points and normals then, and cameras that are mirrored pass from the moment before to the one after, and stand
/// where there is none; but points of meshes that have a kDriftAttribute go as that says, where no moment knows them or
/// all have them as the middle has, and volumes as their VoxelDrift says; lamps, materials and the environment stand as
/// in the middle (as in Cycles). What is shrunk to nothing is there.
class Shutter {
 public:
  /// `moments`: at even steps from when the shutter opens to when it closes, without the middle one: an even number of
  /// them. Throws Error for another number, or none.
  Shutter(std::shared_ptr<const Scene> middle, std::span<const std::shared_ptr<const Scene>> moments);

  const std::shared_ptr<const Scene>& middle() const { return middle_; }
  bool moves_anything() const { return !cameras_.times.empty() || moves_surfaces(); }
  bool moves_surfaces() const { return !instances_.empty() || !meshes_.empty() || !volumes_.empty(); }

  /// The scene at a time between 0 (the shutter opens) and 1 (it closes). What rests is shared.
  std::shared_ptr<const Scene> at(float time) const;

 private:
  /// What something is at `times`, which rise: two at least, or none for what rests.
  template <class T>
  struct Track {
    std::vector<float> times;
    std::vector<T> values;
  };
  struct MovingInstance {
    size_t instance;
    std::vector<float> times;
    std::vector<MovingTransform> object_to_world;  // from each time to the next
  };
  struct MovingMesh {
    size_t mesh;
    Track<std::shared_ptr<const Mesh>> shapes;
  };
  class Matches;
  template <class T, class At>
  Track<T> track(const T& middle, At&& at) const;
  void add_instance(size_t index, std::span<const Matches> matches);
  /// By the first of those `instances` that show it which has it at a moment.
  void add_mesh(size_t handle, std::span<const size_t> instances, std::span<const Matches> matches);
  void move_camera(Camera& camera, float time) const;

  std::shared_ptr<const Scene> middle_;
  size_t steps_;  // from moment to moment, the middle among them
  Track<Camera> cameras_;
  std::vector<MovingTransform> eyes_;  // from each time of the cameras to the next
  std::vector<MovingInstance> instances_;
  std::vector<MovingMesh> meshes_;
  std::vector<size_t> volumes_;  // meshes: of volumes that drift
};

/// The time by which a share `u` in [0, 1) of the light is in that a shutter lets in between 0 and 1. `openness` (none
/// negative, some positive) is at even steps from opening to closing, and straight between; empty: the same all along.
float time_of_exposure(std::span<const float> openness, float u);

}  // namespace cistern
