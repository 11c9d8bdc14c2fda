#pragma once

#include <cstdint>

namespace cistern {

// Which objects an emitter lights, and which throw shadows in its light, as Blender's light linking has it. Objects
// that emitters treat alike are one set; an emitter names the sets it works on by bits. Set 0 is that of objects which
// no emitter tells from others, and of media that fill the world.

inline constexpr uint8_t kLightSets = 64;
inline constexpr uint64_t kAllSets = ~uint64_t{0};
/// A receiver that sees every emitter: the camera, and whoever stands for receivers of all sets.
inline constexpr uint8_t kEveryLight = kLightSets;

inline constexpr bool has_set(uint64_t sets, uint8_t set) { return set >= kLightSets || ((sets >> set) & 1) != 0; }

/// Of an emitter.
struct LightLinks {
  uint64_t lit = kAllSets;       // sets of receivers (Instance::light_set)
  uint64_t blockers = kAllSets;  // sets of what throws shadows (Instance::shadow_set)
  friend bool operator==(const LightLinks&, const LightLinks&) = default;
};

}  // namespace cistern
