#pragma once

#include "film/film.h"
#include "render/frame.h"

namespace cistern {

/// Fills the passes Light Choice Entropy (nats, of the shares that lights have in what reaches the cell of a pixel's
/// visible point), Light Choice Samples (the effective number of samples that is known from) and Guided (1 where
/// bounces have a guide, else 0) of a film that keeps one of them, from the visible points of frame 0 and what was
/// learned last. Pixels where nothing was learned stay 0.
void show_learning(const FrameContext& context, Film& film, const StopCondition& stop);

}  // namespace cistern
