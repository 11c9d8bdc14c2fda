#include "transport/path_walk.h"

namespace cistern {

/// As without kinds, to the last bit: walks that learn round otherwise.
PathRecord trace_split_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                            PathCapture* capture) {
  if (context.media && !capture) return Walk<SplitWalk<MediaWalk>>(context, ray, sampler, scratch, nullptr).run();
  const Knowledge knowledge = knowledge_of(context, scratch);
  if (knowledge != Knowledge::NONE) {
    if (capture) return Walk<SplitWalk<LearnedCapturingWalk>>(context, ray, sampler, scratch, capture).run();
    if (knowledge == Knowledge::LEARNED)
      return Walk<SplitWalk<LearnedWalk>>(context, ray, sampler, scratch, nullptr).run();
    return Walk<SplitWalk<CausticWalk>>(context, ray, sampler, scratch, nullptr).run();
  }
  if (capture) return Walk<SplitWalk<CapturingWalk>>(context, ray, sampler, scratch, capture).run();
  return Walk<SplitWalk<ReferenceWalk>>(context, ray, sampler, scratch, nullptr).run();
}

}  // namespace cistern
