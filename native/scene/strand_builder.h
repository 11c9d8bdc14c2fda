#pragma once

#include "scene/scene_builder.h"

namespace cistern {

/// The mesh of these strands; see SceneBuilder::add_strands. Throws Error naming them.
Mesh build_strands(const StrandInput& input);

}  // namespace cistern
