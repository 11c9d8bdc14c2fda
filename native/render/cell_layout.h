#pragma once

#include "grid/cell_key.h"
#include "render/frame.h"

namespace cistern {

/// The cells of a frame by the settings, displaced and turned at random; or those of the cell passes, which are the
/// same in all frames.
GridLayout cell_layout(const FrameContext& context, uint32_t frame, bool randomised = true);

/// Cells of other sizes; `grid.min_cell_size` as in Settings.
GridLayout cell_layout(const FrameContext& context, GridSettings grid, uint32_t frame);

}  // namespace cistern
