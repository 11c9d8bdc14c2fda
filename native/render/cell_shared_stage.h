#pragma once

#include "render/path_stage.h"
#include "restir/cell_shared_paths.h"

namespace cistern {

/// Indirect light by sharing in cells, at the vertex after the visible point and then at the visible point.
class CellSharedStage final : public PathStage {
 public:
  explicit CellSharedStage(const FrameContext& context);

  int link_count() const override { return 2; }
  bool leaves_deep_link() const override { return true; }
  void start_pixel(const PathCapture& capture, uint32_t pixel) override;
  std::array<PathSample*, kMaxPathLinks> samples(uint32_t pixel) override;
  bool reuse(const FrameRun& run, std::span<const VisiblePoint> visible,
             std::span<const VisiblePoint> previous) override;
  Rgb shade(const VisiblePoint& visible, uint32_t pixel) const override;
  std::optional<Rgb> shade_alone(const VisiblePoint& visible, uint32_t pixel) const override;
  void keep_history() override {}
  void take_over(PathStage&& earlier, const HistorySource& source) override;
  size_t memory_bytes() const override;

 private:
  enum Vertex : size_t { VISIBLE, DEEP };
  bool make_keys(const FrameRun& run, Vertex vertex);
  bool share(const FrameRun& run, Vertex vertex);
  struct Group;
  void share_group(const FrameRun& run, Vertex vertex, std::span<const uint32_t> pixels, Group& group);

  const FrameContext& context_;
  CellSharedPaths paths_;
  void resize();

  std::array<LazyVector<PathLink>, kMaxPathLinks> links_;  // by vertex and pixel; `to` means nothing where W is 0
  LazyVector<ReflectedPaths> reflected_;                   // by pixel, of the last vertex shared at
  LazyVector<CellKey> keys_;
  LazyVector<uint32_t> classes_;
  CellGroups groups_;
};

}  // namespace cistern
