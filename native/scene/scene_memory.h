#pragma once

#include <cstddef>

#include "scene/scene.h"

namespace cistern {

/// Bytes of the snapshot: meshes, images (pixels that NumPy lends included), instances, lights and programs. Names and
/// the like are left out. What snapshots share counts in each.
size_t memory_bytes(const Scene& scene);

}  // namespace cistern
