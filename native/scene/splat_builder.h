#pragma once

#include "scene/scene_builder.h"

namespace cistern {

/// The mesh of these splats; see SceneBuilder::add_splats. Throws Error naming them.
Mesh build_splats(const SplatInput& input);

}  // namespace cistern
