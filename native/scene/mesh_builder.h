#pragma once

#include "scene/scene_builder.h"

namespace cistern {

/// The mesh that `input` describes; see SceneBuilder::add_mesh. Throws Error naming the mesh.
Mesh build_mesh(const MeshInput& input);

}  // namespace cistern
