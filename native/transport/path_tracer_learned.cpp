#include "transport/path_walk.h"

namespace cistern {

PathRecord trace_learned_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch,
                              PathCapture* capture) {
  if (capture) return Walk<LearnedCapturingWalk>(context, ray, sampler, scratch, capture).run();
  if (knowledge_of(context, scratch) == Knowledge::LEARNED)
    return Walk<LearnedWalk>(context, ray, sampler, scratch, nullptr).run();
  return Walk<CausticWalk>(context, ray, sampler, scratch, nullptr).run();
}

}  // namespace cistern
