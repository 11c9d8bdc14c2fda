#pragma once

#include "scene/scene.h"

namespace cistern {

/// Whether what may be panes of an instance (MaterialProgram::may_be_pane) has the shape of panes: most of it is flat
/// and lies in few directions, as the windows of a house do. Light samples need not ask a wine glass. Looks at some
/// thousands of triangles at most.
bool has_pane_shape(const Scene& scene, const Instance& instance);

}  // namespace cistern
