#include "transport/path_walk.h"

namespace cistern {

PathRecord trace_media_path(const PathContext& context, const Ray& ray, PathSampler& sampler, PathScratch& scratch) {
  return Walk<MediaWalk>(context, ray, sampler, scratch, nullptr).run();
}

}  // namespace cistern
