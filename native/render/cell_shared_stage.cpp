#include "render/cell_shared_stage.h"

#include "base/parallel.h"
#include "render/cell_layout.h"

namespace cistern {
namespace {

constexpr size_t kGroupBlock = 16;
enum Stream : uint32_t { SHARING = 0x300 };

/// Of cells that bound groups of visible points: elsewhere the picture decides.
constexpr float kSmallestVisibleCell = 1e-3f;  // of the scene's diagonal

}  // namespace

/// What CellSharedPaths wants beside each other; memory of one thread.
struct CellSharedStage::Group {
  std::vector<const PathLink*> links;
  std::vector<ReflectedPaths*> reflected;
  std::vector<Rng> rngs;
  CellSharedPaths::Scratch scratch;
};

CellSharedStage::CellSharedStage(const FrameContext& context)
    : context_(context), paths_(context.paths, context.settings.path_sharing.weights) {
  resize();
}

void CellSharedStage::resize() {
  const Region& region = context_.settings.region;
  const size_t pixels = static_cast<size_t>(region.width) * static_cast<size_t>(region.height);
  for (auto& links : links_) links.resize(pixels);
  reflected_.resize(pixels);
  keys_.resize(pixels);
  classes_.resize(pixels);
}

/// There is no history, only memory.
void CellSharedStage::take_over(PathStage&& earlier, const HistorySource&) {
  auto& stage = static_cast<CellSharedStage&>(earlier);
  std::swap(links_, stage.links_);
  std::swap(reflected_, stage.reflected_);
  std::swap(keys_, stage.keys_);
  std::swap(classes_, stage.classes_);
  resize();
}

void CellSharedStage::start_pixel(const PathCapture& capture, uint32_t pixel) {
  for (size_t i = 0; i < kMaxPathLinks; ++i) {
    PathLink& link = links_[i][pixel];
    link.from = capture.links[i].from;
    link.W = capture.links[i].W;
    if (link.W > 0.0f) link.to = capture.links[i].to;
  }
}

std::array<PathSample*, kMaxPathLinks> CellSharedStage::samples(uint32_t pixel) {
  return {&links_[VISIBLE][pixel].to, &links_[DEEP][pixel].to};
}

bool CellSharedStage::reuse(const FrameRun& run, std::span<const VisiblePoint>, std::span<const VisiblePoint>) {
  if (!make_keys(run, DEEP) || !share(run, DEEP)) return false;
  const bool added = run.for_pixels([&](uint32_t pixel, uint64_t&) {
    PathLink& link = links_[VISIBLE][pixel];
    if (!(link.W > 0.0f) || !links_[DEEP][pixel].from.exists) return;
    Rng rng = pixel_random_numbers(image_region(context_.settings), context_.settings.seed, pixel, run.frame,
                                   SHARING + kMaxPathLinks);
    CellSharedPaths::add_to_sample(link.to, reflected_[pixel], rng.next_float());
  });
  return added && make_keys(run, VISIBLE) && share(run, VISIBLE);
}

bool CellSharedStage::make_keys(const FrameRun& run, Vertex vertex) {
  const PathSharing& sharing = context_.settings.path_sharing;
  const GroupRules& rules = vertex == VISIBLE ? sharing.visible : sharing.deep;
  const float fine = std::ldexp(1.0f, -rules.fine_levels);
  GridSettings grid;
  grid.cell_pixels = (vertex == VISIBLE ? sharing.visible_pixels : sharing.deep_pixels) * fine;
  grid.min_cell_size = (vertex == VISIBLE ? kSmallestVisibleCell : sharing.deep_size) * fine;
  const GridLayout layout = cell_layout(context_, grid, run.frame);
  return run.for_pixels([&](uint32_t pixel, uint64_t&) {
    reflected_[pixel] = {};
    const VisiblePoint& point = links_[vertex][pixel].from;
    keys_[pixel] = point.exists ? cell_key(layout, point.receiver.position, point.receiver.n) : kNoCell;
    classes_[pixel] = point.exists ? CellSharedPaths::group_class(point) : 0;
  });
}

bool CellSharedStage::share(const FrameRun& run, Vertex vertex) {
  const PathSharing& sharing = context_.settings.path_sharing;
  groups_.build(keys_, classes_, vertex == VISIBLE ? sharing.visible : sharing.deep);
  std::atomic<bool> stopped{false};
  parallel_blocks(groups_.count(), kGroupBlock, [&](size_t, size_t begin, size_t end) {
    if (run.stop.cancelled.load(std::memory_order_relaxed) || run.stop.deadline_passed()) stopped = true;
    if (stopped) return;
    const FlushDenormals flush;
    Group group;
    for (size_t g = begin; g < end; ++g) share_group(run, vertex, groups_.members(g), group);
  });
  return !stopped;
}

void CellSharedStage::share_group(const FrameRun& run, Vertex vertex, std::span<const uint32_t> pixels, Group& group) {
  group.links.clear();
  group.reflected.clear();
  group.rngs.clear();
  for (const uint32_t pixel : pixels) {
    group.links.push_back(&links_[vertex][pixel]);
    group.reflected.push_back(&reflected_[pixel]);
    group.rngs.push_back(pixel_random_numbers(image_region(context_.settings), context_.settings.seed, pixel, run.frame,
                                              SHARING + static_cast<uint32_t>(vertex)));
  }
  paths_.share(group.links, group.reflected, group.rngs, group.scratch);
}

Rgb CellSharedStage::shade(const VisiblePoint& visible, uint32_t pixel) const {
  return visible.throughput * reflected_[pixel].sum;
}

std::optional<Rgb> CellSharedStage::shade_alone(const VisiblePoint& visible, uint32_t pixel) const {
  return visible.throughput * reflected_[pixel].own;
}

size_t CellSharedStage::memory_bytes() const {
  return (links_[VISIBLE].capacity() + links_[DEEP].capacity()) * sizeof(PathLink) +
         reflected_.capacity() * sizeof(ReflectedPaths) + keys_.capacity() * sizeof(CellKey) +
         classes_.capacity() * sizeof(uint32_t) + groups_.memory_bytes();
}

}  // namespace cistern
