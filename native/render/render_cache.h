#pragma once

#include <memory>
#include <mutex>

#include "restir/light_cache_cells.h"

namespace cistern {

/// What a render can take over from an earlier one of a scene with the same surfaces: the cells of the light cache,
/// which depend on geometry alone. What depends on lights and materials is made anew. May be used by several sessions
/// at once.
class RenderCache {
 public:
  /// The cells kept, if they were built from the very surfaces of `scene`, else newly built ones, which are kept from
  /// then on. Null when stopped.
  std::shared_ptr<const LightCacheCells> light_cache_cells(const Scene& scene, uint32_t point_count, uint64_t seed,
                                                           const WorkMonitor& monitor);
  size_t memory_bytes() const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const LightCacheCells> cells_;
};

}  // namespace cistern
