#include "render/render_cache.h"

namespace cistern {

std::shared_ptr<const LightCacheCells> RenderCache::light_cache_cells(const Scene& scene, uint32_t point_count,
                                                                      uint64_t seed, const WorkMonitor& monitor) {
  {
    const std::lock_guard lock(mutex_);
    if (cells_ && cells_->fits(scene)) return cells_;
  }
  std::shared_ptr<const LightCacheCells> cells = LightCacheCells::build(scene, point_count, seed, monitor);
  const std::lock_guard lock(mutex_);
  if (cells) cells_ = cells;
  return cells;
}

size_t RenderCache::memory_bytes() const {
  const std::lock_guard lock(mutex_);
  return cells_ ? cells_->memory_bytes() : 0;
}

}  // namespace cistern
