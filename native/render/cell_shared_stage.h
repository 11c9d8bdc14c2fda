#pragma once

#include "render/path_stage.h"
#include "restir/cell_shared_paths.h"

namespace cistern {

/// Indirect light by sharing in cells, at the vertex after the visible point and then at the visible point.
class CellSharedStage final : public PathStage {
 public:
  /// Of no pixels: set_region comes first.
  explicit CellSharedStage(const FrameContext& context);

  int link_count() const override { return 2; }
  bool leaves_deep_link() const override { return true; }
  void start_pixel(const PathCapture& capture, uint32_t pixel) override;
  std::array<PathSample*, kMaxPathLinks> samples(uint32_t pixel) override;
  std::array<std::span<Rgb>, kMaxPathLinks> continuation_groups(uint32_t pixel) override;
  bool reuse(const FrameRun& run, std::span<const VisiblePoint> visible,
             std::span<const VisiblePoint> previous) override;
  Rgb shade(const VisiblePoint& visible, uint32_t pixel) const override;
  KindColors shade_by_kind(const VisiblePoint& visible, uint32_t pixel, Rgb shaded) const override;
  void shade_groups(const VisiblePoint& visible, uint32_t pixel, float factor, std::span<Rgb> sums) const override;
  std::optional<Rgb> shade_alone(const VisiblePoint& visible, uint32_t pixel) const override;
  uint32_t reuse_count(uint32_t pixel) const override { return reuse_counts_[pixel]; }
  void keep_history() override;
  void take_over(PathStage&& earlier, const HistorySource& source) override;
  void swap_history(PathStage& other) override;
  void set_source(const HistorySource& source) override;
  size_t memory_bytes() const override;

  /// Goes on with a part of the picture. Pixels are numbered within.
  void set_region(const Region& region);
  /// Where the path of a pixel started.
  const VisiblePoint& visible_point(uint32_t pixel) const { return links_[VISIBLE][pixel].from; }
  /// At both vertices, without history. False if stopped.
  bool share(uint32_t frame, const StopCondition& stop);

 private:
  enum Vertex : size_t { VISIBLE, DEEP };
  size_t pixel_count() const;
  const SharingCells& cells(Vertex vertex) const;
  /// Whether what vertices found went through the history of their pixels.
  bool is_resampled(Vertex vertex) const { return vertex == VISIBLE && keeps_history(); }
  /// Next vertices may be groups of one: what they reflect of samples that are for all is for all.
  bool shares_at(Vertex vertex) const {
    return vertex == DEEP || is_resampled(vertex) || cells(vertex).groups.size > 1;
  }
  bool splits_groups() const { return context_.paths.light_groups > 0; }
  ReflectedGroups reflected_groups(uint32_t pixel) { return {group_sums_.of(pixel), group_evens_.of(pixel)}; }
  void divide_groups(Vertex vertex, uint32_t pixel, bool is_shared);
  bool splits_at(Vertex vertex) const { return vertex == VISIBLE && context_.paths.splits_kinds; }
  bool divide_samples(Vertex vertex, const StopCondition& stop);
  bool share_at(Vertex vertex, uint32_t frame, const StopCondition& stop);
  /// Of a group of a frame, for roulette among its samples.
  double choice(Vertex vertex, uint32_t group, uint32_t frame) const;
  uint64_t seed_of_region() const;
  bool make_groups(Vertex vertex, uint32_t frame, const StopCondition& stop);
  void prefetch_group(Vertex vertex, std::span<const uint32_t> pixels) const;
  CellSharedPaths::Group empty_group(Vertex vertex) const;
  void share_group(Vertex vertex, std::span<const uint32_t> pixels, CellSharedPaths::Group& group,
                   CellSharedPaths::Scratch& scratch);
  bool keeps_history() const { return context_.settings.path_sharing.temporal_reuse; }
  bool merge_with_history(const FrameRun& run, std::span<const VisiblePoint> visible);

  const FrameContext& context_;
  Region region_;
  CellSharedPaths paths_;
  ScreenSpacePaths temporal_paths_;
  std::array<LazyVector<PathLink>, kMaxPathLinks> links_;  // by vertex and pixel; `to` means nothing where W is 0
  LazyVector<ReflectedPaths> reflected_;                   // by pixel, of the last vertex shared at
  LazyVector<uint32_t> reuse_counts_;                      // by pixel
  // By pixel, where paths split kinds: PathCapture::link_shares, and what the visible point reflects of paths by kinds.
  LazyVector<KindColors> link_shares_, reflected_by_kind_;
  // Light groups: by vertex and pixel of continuations; by pixel of what is reflected; of the history's samples.
  std::array<GroupTable, kMaxPathLinks> continuations_;
  GroupTable group_sums_, group_evens_;
  ContinuationGroups temporal_groups_;
  PathFrame current_, previous_;  // temporal reservoirs, with history alone
  bool is_history_void_ = false;  // light has changed since
  LazyVector<CellKey> keys_;
  LazyVector<uint32_t> classes_;
  CellGroups groups_;
};

}  // namespace cistern
