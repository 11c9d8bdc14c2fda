#pragma once

#include <span>
#include <vector>

#include "base/rgb.h"
#include "scene/light_group.h"

namespace cistern {

// Light by the group of what emitted it, whatever it met on its way: seen straight, direct or indirect, clamped as
// Combined is. An array of it has an entry for each group that is asked for, and none where nobody asks; light of other
// groups, or of none, is not in it. Shadow catchers have none, as in Cycles, and the environment has it behind a
// transparent film only where PathContext asks for that. [Cycles, kernel/film/light_passes.h]
//
// All that is done to radiance between emitter and film multiplies it, so each group takes the way of the whole: what
// groups add up to is the light of all grouped emitters, to rounding, in every sample.
using LightByGroup = std::vector<Rgb>;

inline void add_to_group(std::span<Rgb> sums, LightGroup group, Rgb light) {
  if (group >= 0 && static_cast<size_t>(group) < sums.size()) sums[static_cast<size_t>(group)] += light;
}

/// To each group what it has, times a factor.
inline void add_to_groups(std::span<Rgb> sums, std::span<const Rgb> light, Rgb factor) {
  for (size_t group = 0; group < light.size(); ++group) sums[group] += factor * light[group];
}

}  // namespace cistern
