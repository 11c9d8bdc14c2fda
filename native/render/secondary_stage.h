#pragma once

#include <mutex>

#include "render/frame_run.h"
#include "render/pixel_kinds.h"
#include "render/render_history.h"
#include "restir/secondary_light_reservoirs.h"

namespace cistern {

/// Light at path vertices beyond the visible point by reservoirs, over the frames of a render.
class SecondaryStage {
 public:
  explicit SecondaryStage(const FrameContext& context);
  /// Goes on with the history of another render, and with its memory. `source` stays until keep_history.
  void take_over(SecondaryStage&& earlier, const HistorySource& source);

  /// The vertices of some pixels of a frame that were traced together, in the order of their paths.
  struct Batch {
    std::vector<LightVertex> vertices;
    std::vector<LightVertexKinds> kinds;                // beside `vertices`, where paths split kinds
    std::vector<std::pair<uint32_t, uint32_t>> counts;  // pixel and how many of the vertices are its
    void add(uint32_t pixel, const PathCapture& capture);
  };
  void begin_frame();
  /// From any thread.
  void add_batch(Batch&& batch);
  /// All reuse, after the last batch. False if stopped.
  bool reuse(const FrameRun& run);
  /// Light groups of a pixel and of the continuations of its samples, empty where paths split none.
  struct PixelGroups {
    std::span<Rgb> light;
    std::array<std::span<Rgb>, kMaxPathLinks> continuations;
  };
  /// Adds the light of a pixel's vertices to its record, to the samples of its links and, if not null, to light by
  /// kinds; all that by groups as well.
  void shade(uint32_t pixel, PathRecord& record, std::span<PathSample* const> samples, PixelLight* by_kind,
             const PixelGroups& groups = {}) const;
  /// Of other vertices, merged into those of a pixel's vertices.
  uint32_t reuse_count(uint32_t pixel) const;
  void keep_history();
  size_t memory_bytes() const;

 private:
  LightGroup group_of(const LightSample& sample) const {
    return context_.paths.light_groups > 0 ? light_group_of(context_.paths, sample.emitter) : kNoLightGroup;
  }
  void add_by_kind(uint32_t vertex, const ArrivingLight& light, LightByKind& by_kind) const;
  bool join_batches(const FrameRun& run);
  Rng random_numbers(uint32_t vertex, uint32_t frame, uint32_t pass) const;
  template <class Body>
  bool for_vertices(const FrameRun& run, const Body& body) const;
  bool build_cells(const FrameRun& run);
  bool merge_with_cells(const FrameRun& run, const VertexCells& cells, uint32_t pass);

  const FrameContext& context_;
  SecondaryLightReservoirs light_;
  std::mutex mutex_;  // guards batches_
  std::vector<Batch> batches_;
  LazyVector<LightVertex> vertices_;            // those of a pixel side by side
  LazyVector<LightVertexKinds> kinds_;          // beside them, where paths split kinds
  LazyVector<uint32_t> pixels_, reuse_counts_;  // by vertex
  LazyVector<uint32_t> first_vertex_, counts_;  // by pixel
  VertexCells cells_, previous_;
  LazyVector<LightReservoir> scratch_;  // by vertex
  LazyVector<CellKey> keys_;
};

}  // namespace cistern
