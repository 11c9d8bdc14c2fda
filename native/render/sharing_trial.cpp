#include "render/sharing_trial.h"

namespace cistern {
namespace {

/// Frames that share take so many times as long as those that do not, about (City Grid, door ajar, Cornell box,
/// `tests/benchmark/efficiency.py`): 1.8 to 2.2, and 1.1 to 1.3.
constexpr double kCost = 2.0, kCostOfNextVerticesAlone = 1.25;
constexpr int kBox = 4;
/// Shorter pictures would spend too much of their time on it.
constexpr int kLeastSamples = 8 * static_cast<int>(FrameTrial::kFrames);

}  // namespace

SharingTrial::SharingTrial(const Settings& s) {
  const PathSharing& sharing = s.path_sharing;
  if (!sharing.on_trial || s.samples < kLeastSamples) return;
  if (sharing.visible.groups.size > 1) {
    trial_.emplace(s.region, 0, kCost, kBox);
  } else if (sharing.deep.groups.size > 1) {
    trial_.emplace(s.region, 0, kCostOfNextVerticesAlone);
  }
}

}  // namespace cistern
