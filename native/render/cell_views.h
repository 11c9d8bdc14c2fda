#pragma once

#include "grid/cell_key.h"
#include "render/frame.h"

namespace cistern {

/// Fills the passes Cells (a colour per cell), Cell Occupancy (how many of the picture's visible points share the
/// cell), Cell Level (1 + its level; 1 in the light cache) and Normal Bin (a colour per bin) of a film that keeps one
/// of them, from the visible points of frame 0: the grid without its random offset, so that cells look alike from frame
/// to frame; or with `cache_cells` from those of the light cache. Pixels without a visible point stay black. False if
/// stopped early.
bool show_cells(const FrameContext& context, const LightCacheCells* cache_cells, Film& film, const StopCondition& stop);

}  // namespace cistern
