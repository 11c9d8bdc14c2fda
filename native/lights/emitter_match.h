#pragma once

#include "lights/light_set.h"
#include "scene/scene_change.h"

namespace cistern {

/// Which emitters of two sets are the same thing, so that a light sample of one is a light sample of the other: lamps
/// by their keys or handles, triangles by those of their instances, the environment unless it changed. A sample keeps
/// its place on the emitter, wherever that has gone.
class EmitterMatch {
 public:
  EmitterMatch(const LightSet& earlier, const LightSet& later, const SceneChange& change);

  /// Empty where the other set lacks the emitter.
  std::optional<LightSample> to_earlier(const LightSample& later) const { return look_up(earlier_of_, later); }
  std::optional<LightSample> to_later(const LightSample& earlier) const { return look_up(later_of_, earlier); }

 private:
  static constexpr uint32_t kNone = 0xffffffffu;
  static std::optional<LightSample> look_up(const std::vector<uint32_t>& map, LightSample sample) {
    sample.emitter = map[sample.emitter];
    return sample.emitter == kNone ? std::nullopt : std::optional(sample);
  }

  std::vector<uint32_t> earlier_of_, later_of_;  // by emitter
};

}  // namespace cistern
