#pragma once

#include "scene/scene_builder.h"

namespace cistern {

/// The box of a volume object; see SceneBuilder::add_volume. Throws Error naming the object.
Mesh build_volume(VolumeInput input);

}  // namespace cistern
