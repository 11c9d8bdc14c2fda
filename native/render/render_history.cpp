#include "render/render_history.h"

namespace cistern {
namespace {

/// Only what must agree.
Settings without_what_may_differ(Settings s) {
  const Settings any;
  s.width = any.width, s.height = any.height, s.region = any.region;
  s.samples = any.samples, s.threads = any.threads, s.time_limit = any.time_limit;
  s.passes = any.passes;
  return s;
}

}  // namespace

bool shares_history(const Settings& a, const Settings& b) {
  return without_what_may_differ(a) == without_what_may_differ(b);
}

}  // namespace cistern
