#pragma once

#include "grid/cell_key.h"
#include "render/frame.h"

namespace cistern {

/// The cells of a frame by the settings, displaced and turned at random.
GridLayout cell_layout(const FrameContext& context, uint32_t frame);

/// Those of the cell passes, the same in all frames: where paths are shared, the cells that bound groups of visible
/// points, else by the settings.
GridLayout shown_cell_layout(const FrameContext& context);

/// Cells of other sizes; `grid.min_cell_size` as in Settings.
GridLayout cell_layout(const FrameContext& context, GridSettings grid, uint32_t frame);

}  // namespace cistern
