#include "render/sharing_trial.h"

namespace cistern {
namespace {

/// Frames that share at next vertices take 1.1 to 1.3 times as long as those that do not (City Grid, door ajar, Cornell
/// box, `tests/benchmark/efficiency.py`).
constexpr double kCost = 1.25;

}  // namespace

SharingTrial::SharingTrial(const Settings& s) {
  const bool is_tried = s.path_sharing.visible.groups.size == 1 && s.path_sharing.deep.groups.size > 1 &&
                        s.samples > static_cast<int>(FrameTrial::kFrames);
  if (is_tried) trial_.emplace(s.region, 0, kCost);
}

}  // namespace cistern
