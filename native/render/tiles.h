#pragma once

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <chrono>

#include "accel/accel.h"
#include "base/parallel.h"

namespace cistern {

/// When to leave a frame early.
struct StopCondition {
  const std::atomic<bool>& cancelled;
  std::chrono::steady_clock::time_point deadline;

  bool deadline_passed() const { return std::chrono::steady_clock::now() >= deadline; }
};

/// Calls body(x, y, scratch) for each pixel of width x height, in parallel over tiles on the calling thread's TBB
/// arena; each tile has a Scratch of its own, which goes to finish(scratch) when all its pixels are done. Returns
/// early, within milliseconds, once cancelled or past the deadline; true if every pixel was visited.
template <class Scratch, class Body, class Finish>
bool for_each_pixel(int width, int height, const StopCondition& stop, const Body& body, const Finish& finish) {
  constexpr int kTileSize = 8;  // small: coarse pictures and bands are to keep many threads busy
  const tbb::blocked_range2d<int> tiles(0, height, kTileSize, 0, width, kTileSize);
  std::atomic<bool> stopped{false};
  const auto visit_tile = [&](const tbb::blocked_range2d<int>& tile) {
    const FlushDenormals flush;
    Scratch scratch{};
    for (int y = tile.rows().begin(); y != tile.rows().end(); ++y) {
      if (stop.deadline_passed()) stopped = true;
      for (int x = tile.cols().begin(); x != tile.cols().end(); ++x) {
        if (stop.cancelled.load(std::memory_order_relaxed)) stopped = true;
        if (stopped.load(std::memory_order_relaxed)) return;
        body(x, y, scratch);
      }
    }
    finish(scratch);
  };
  tbb::parallel_for(tiles, visit_tile, tbb::simple_partitioner());
  return !stopped;
}

/// Calls body(begin, end) for each block of [0, count) as parallel_blocks does. Leaves out the blocks that are not
/// begun once cancelled or past the deadline; true if there were none.
template <class Body>
bool for_each_block(size_t count, size_t block_size, const StopCondition& stop, const Body& body) {
  std::atomic<bool> stopped{false};
  parallel_blocks(count, block_size, [&](size_t, size_t begin, size_t end) {
    if (stop.cancelled.load(std::memory_order_relaxed) || stop.deadline_passed()) stopped = true;
    if (stopped) return;
    const FlushDenormals flush;
    body(begin, end);
  });
  return !stopped;
}

}  // namespace cistern
