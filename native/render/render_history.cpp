#include "render/render_history.h"

namespace cistern {
namespace {

/// Only what must agree.
Settings without_what_may_differ(Settings s) {
  const Settings any;
  s.width = any.width, s.height = any.height, s.region = any.region;
  s.samples = any.samples, s.threads = any.threads, s.time_limit = any.time_limit;
  s.noise_threshold = any.noise_threshold, s.display_exposure = any.display_exposure;
  s.film_exposure = any.film_exposure, s.adaptive_sampling = any.adaptive_sampling;
  s.passes = any.passes, s.surface_passes = any.surface_passes;
  s.path_sharing.on_trial = any.path_sharing.on_trial;
  return s;
}

}  // namespace

bool shares_history(const Settings& a, const Settings& b) {
  return without_what_may_differ(a) == without_what_may_differ(b);
}

bool can_borrow_history(const Settings& draft, const Settings& finer) {
  if (!draft.is_draft || finer.is_draft || uses_reservoirs(draft.secondary)) return false;
  const bool direct = draft.direct == DirectAnswer::RESTIR;
  const bool paths = draft.indirect == IndirectAnswer::CELL_SHARED;
  if (!(direct || !uses_reservoirs(draft.direct)) || !(paths || draft.indirect == IndirectAnswer::PATH)) return false;
  Settings as_finer = draft;
  as_finer.is_draft = false;
  as_finer.keep_history = finer.keep_history;
  return draft.has_temporal_reuse() && shares_history(as_finer, finer);
}

}  // namespace cistern
