#include "render/frame.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include "transport/camera_ray.h"

namespace cistern {
namespace {

constexpr int kTileSize = 16;

void render_pixel(const FrameContext& context, int x, int y, uint32_t first_frame, uint32_t count, Film& film,
                  PathScratch& scratch) {
  const Settings& s = context.settings;
  const Camera& camera = context.paths.scene.camera;
  const uint32_t row = static_cast<uint32_t>(s.region.y + y) * static_cast<uint32_t>(s.width);  // below 2^32
  const uint32_t full_frame_pixel = row + static_cast<uint32_t>(s.region.x + x);
  for (uint32_t frame = first_frame; frame < first_frame + count; ++frame) {
    PathSampler sampler(s.seed, full_frame_pixel, frame, s.sequence);
    const Vec2 offset = context.filter.sample(sampler.filter());
    const Vec2 film_position{(static_cast<float>(s.region.x + x) + 0.5f + offset.x) / static_cast<float>(s.width),
                             (static_cast<float>(s.region.y + y) + 0.5f + offset.y) / static_cast<float>(s.height)};
    const Vec2 u_lens = camera.aperture_radius > 0.0f ? sampler.lens() : Vec2{};
    const Ray ray = camera_ray(camera, film_position, u_lens);
    film.add(static_cast<uint32_t>(y * film.width() + x), trace_path(context.paths, ray, sampler, scratch));
  }
}

}  // namespace

bool render_frames(const FrameContext& context, uint32_t first_frame, uint32_t count, Film& film,
                   const StopCondition& stop) {
  const tbb::blocked_range2d<int> tiles(0, film.height(), kTileSize, 0, film.width(), kTileSize);
  std::atomic<bool> stopped{false};
  const auto render_tile = [&](const tbb::blocked_range2d<int>& tile) {
    const FlushDenormals flush;
    PathScratch scratch;
    for (int y = tile.rows().begin(); y != tile.rows().end(); ++y) {
      if (stop.deadline_passed()) stopped = true;
      for (int x = tile.cols().begin(); x != tile.cols().end(); ++x) {
        if (stop.cancelled.load(std::memory_order_relaxed)) stopped = true;
        if (stopped.load(std::memory_order_relaxed)) return;
        render_pixel(context, x, y, first_frame, count, film, scratch);
      }
    }
  };
  tbb::parallel_for(tiles, render_tile, tbb::simple_partitioner());
  return !stopped;
}

}  // namespace cistern
