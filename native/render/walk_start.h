#pragma once

#include <optional>

#include "accel/accel.h"
#include "base/rng.h"

namespace cistern {

/// The first ray of a walk, through a random place of the picture.
struct WalkStart {
  Ray ray;
  std::optional<Hit> hit;  // where that is known
};
/// None where the picture shows nothing.
std::optional<WalkStart> start_walk(const Scene& scene, Rng& rng);

}  // namespace cistern
