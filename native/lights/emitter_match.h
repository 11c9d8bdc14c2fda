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

/// Whether a LightSet of the earlier scene serves the later one as well: nothing that emits has changed, and what moved
/// or came in its place emits nothing. The power of suns may then be estimated by a scene of another size.
bool has_same_emitters(const Scene& earlier, const Scene& later, const SceneChange& change);

}  // namespace cistern
