#pragma once

#include <optional>

#include "accel/accel.h"
#include "base/rng.h"

namespace cistern {

/// The first ray of a walk, through a place of the picture.
struct WalkStart {
  Ray ray;
  std::optional<Hit> hit;  // where that is known
};
/// By a point of the full frame, in [0, 1]^2 with y up. None where the picture shows nothing.
std::optional<WalkStart> start_walk(const Scene& scene, Vec2 film, Rng& rng);

}  // namespace cistern
