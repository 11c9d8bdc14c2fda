#pragma once

#include "render/frame.h"

namespace cistern {

/// Fills Object Index and Material Index, where the film keeps them: of the first surface at least half opaque behind
/// the centre of each pixel, by the lens point of the first frame; 0 where there is none, or it is held out. Unlike
/// in Cycles chance has no part in whether a surface is passed. False if stopped.
bool show_indices(const FrameContext& context, Film& film, const StopCondition& stop);

}  // namespace cistern
