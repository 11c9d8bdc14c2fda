#pragma once

#include <cstdint>

namespace cistern {

/// Kinds of ray that something can be seen by. A ray has one.
enum RayVisibility : uint8_t {
  kVisibleToCamera = 1,
  kVisibleToDiffuse = 2,       // rays that diffuse lobes reflected
  kVisibleToGlossy = 4,        // that glossy ones reflected
  kVisibleToTransmission = 8,  // that glossy ones let through: glass
  kVisibleToShadow = 16,
  kVisibleToVolume = 32,       // that a medium scattered
  kVisibleToTranslucent = 64,  // that diffuse ones let through
  kVisibleToAll = 127,
  kVisibleToReflected = kVisibleToDiffuse | kVisibleToGlossy,
  kVisibleToTransmitted = kVisibleToTransmission | kVisibleToTranslucent,
  kVisibleToScattered = kVisibleToReflected | kVisibleToTransmitted | kVisibleToVolume,
};

// Users have one switch for all that surfaces let through, Transmission, and none for kVisibleToTranslucent. As in
// Cycles, rays that diffuse lobes let through meet objects that transmission rays see, but lamps and worlds that
// diffuse rays see: so its light samples find these, while its scattered rays ask for both kinds.

constexpr uint8_t with_translucent(uint8_t switches, uint8_t asked) {
  return static_cast<uint8_t>((switches & ~kVisibleToTranslucent) |
                              ((switches & asked) != 0 ? kVisibleToTranslucent : 0));
}
constexpr uint8_t object_visibility(uint8_t switches) { return with_translucent(switches, kVisibleToTransmission); }
constexpr uint8_t light_visibility(uint8_t switches) { return with_translucent(switches, kVisibleToDiffuse); }

}  // namespace cistern
