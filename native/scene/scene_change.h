#pragma once

#include <optional>
#include <vector>

#include "scene/scene.h"

namespace cistern {

/// What differs between two snapshots, for those who keep what they found in the earlier one. Instances and lamps are
/// the same thing where their keys are equal, those without a key where their handles are; of things with one key the
/// first counts. Whatever has other handles counts as changed.
struct SceneChange {
  bool surfaces = false;   // some instance moved, came, went, or has another mesh, ray visibility, light links or group
  bool materials = false;  // of surfaces
  bool environment = false;
  bool lamps = false;
  bool camera = false;
  Camera earlier_camera;
  bool camera_is_shaded = false;  // by some material: then a change of camera is a change of materials

  static constexpr uint32_t kNone = 0xffffffffu;
  /// By instance: the earlier one's index, kNone for what was not there with this mesh. Empty: all are where they were.
  std::vector<uint32_t> earlier_instances;
  std::vector<Transform> to_earlier;  // beside them: from where a point of the instance is to where it was
  /// By light: the earlier one's index or kNone. Empty: all have the indices they had.
  std::vector<uint32_t> earlier_lights;

  /// Whether light that arrives anywhere may have changed.
  bool affects_light() const { return surfaces || materials || environment || lamps || (camera && camera_is_shaded); }
};

SceneChange compare_scenes(const Scene& earlier, const Scene& later);

}  // namespace cistern
