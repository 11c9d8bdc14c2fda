#pragma once

#include <cstdint>

namespace cistern {

/// Number of the group that an emitter belongs to: light of each group can be had as a pass of its own. Which groups
/// there are is said by who asks for them; see Settings::light_groups.
using LightGroup = int16_t;
inline constexpr LightGroup kNoLightGroup = -1;

/// As many as renders can be asked for.
inline constexpr int kMaxLightGroups = 1024;

}  // namespace cistern
