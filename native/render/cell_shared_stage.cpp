#include "render/cell_shared_stage.h"

#include "render/cell_layout.h"

namespace cistern {
namespace {

constexpr size_t kPixelBlock = 1024;
constexpr uint32_t kChoiceStreams = 0x63686f69;

/// CellSharedPaths::Group::handed_on: groups of hundreds then take about as long as groups of 16 that hand on all.
/// Fewer leave noise that pixels have in common, where all samples have much the same light.
constexpr size_t kHandedOn = 8;
/// Samples from the history of their pixels have much the same light, so that roulette could not choose among them.
constexpr int kMostResampled = 16;
/// PathSharing::for_denoiser. (Denoised, groups of 64 leave 1.1 to 1.4 times the error in the Cornell box, Sponza and
/// the bright interior, and 0.87 to 1.03 times in both doors and with a far lamp.)
constexpr int kMostForDenoisers = 16;

template <class T>
void prefetch(const T& object) {
  constexpr size_t kCacheLine = 64;
  const char* bytes = reinterpret_cast<const char*>(&object);
  for (size_t i = 0; i < sizeof(T); i += kCacheLine) __builtin_prefetch(bytes + i);
}

}  // namespace

CellSharedStage::CellSharedStage(const FrameContext& context)
    : context_(context),
      paths_(context.paths),
      temporal_paths_(context.paths, context.settings.screen_paths, image_region(context.settings),
                      context.settings.seed) {}

size_t CellSharedStage::pixel_count() const {
  return static_cast<size_t>(region_.width) * static_cast<size_t>(region_.height);
}

void CellSharedStage::set_region(const Region& region) {
  region_ = region;
  const size_t pixels = pixel_count();
  for (auto& links : links_) links.resize(pixels);
  reflected_.resize(pixels);
  reuse_counts_.resize(pixels);
  if (splits_at(VISIBLE)) {
    link_shares_.resize(pixels);
    reflected_by_kind_.resize(pixels);
  }
  for (GroupTable& continuations : continuations_) continuations.resize(context_.paths, pixels);
  group_sums_.resize(context_.paths, pixels);
  group_evens_.resize(context_.paths, pixels);
  if (keeps_history()) current_.temporal.resize(pixels);
  if (keeps_history()) temporal_groups_.resize(context_.paths, pixels);
  keys_.resize(pixels);
  classes_.resize(pixels);
}

void CellSharedStage::take_over(PathStage&& earlier, const HistorySource& source) {
  auto& stage = static_cast<CellSharedStage&>(earlier);
  std::swap(links_, stage.links_);
  std::swap(reflected_, stage.reflected_);
  std::swap(keys_, stage.keys_);
  std::swap(classes_, stage.classes_);
  std::swap(current_, stage.current_);
  std::swap(previous_, stage.previous_);
  temporal_groups_ = std::move(stage.temporal_groups_);
  set_region(region_);
  set_source(source);
}

void CellSharedStage::swap_history(PathStage& other) {
  auto& stage = static_cast<CellSharedStage&>(other);
  std::swap(previous_.temporal, stage.previous_.temporal);
  temporal_groups_.swap_earlier(stage.temporal_groups_);
}

void CellSharedStage::set_source(const HistorySource& source) {
  previous_.view = source.view();
  is_history_void_ = source.earlier() != nullptr;
}

void CellSharedStage::start_pixel(const PathCapture& capture, uint32_t pixel) {
  for (size_t i = 0; i < kMaxPathLinks; ++i) {
    PathLink& link = links_[i][pixel];
    link.from = capture.links[i].from;
    link.W = capture.links[i].W;
    if (!(link.W > 0.0f)) continue;
    link.to = capture.links[i].to;
    link.response = capture.links[i].response;
    link.even_response = capture.links[i].even_response;
    if (splits_groups()) continuations_[i].set(pixel, capture.continuation_by_group[i]);
  }
  reuse_counts_[pixel] = 0;
  if (splits_at(VISIBLE)) link_shares_[pixel] = capture.link_shares;
}

std::array<PathSample*, kMaxPathLinks> CellSharedStage::samples(uint32_t pixel) {
  return {&links_[VISIBLE][pixel].to, &links_[DEEP][pixel].to};
}

std::array<std::span<Rgb>, kMaxPathLinks> CellSharedStage::continuation_groups(uint32_t pixel) {
  return {continuations_[VISIBLE].of(pixel), continuations_[DEEP].of(pixel)};
}

const SharingCells& CellSharedStage::cells(Vertex vertex) const {
  const PathSharing& sharing = context_.settings.path_sharing;
  return vertex == VISIBLE ? sharing.visible : sharing.deep;
}

/// At the deeper vertex first: what it reflects is part of what visible points share.
bool CellSharedStage::share(uint32_t frame, const StopCondition& stop) {
  return divide_samples(DEEP, stop) && share_at(DEEP, frame, stop) && divide_samples(VISIBLE, stop) &&
         share_at(VISIBLE, frame, stop);
}

bool CellSharedStage::reuse(const FrameRun& run, std::span<const VisiblePoint> visible,
                            std::span<const VisiblePoint> previous) {
  const bool has_history = !is_history_void_ && !previous_.temporal.empty();
  previous_.visible_points = has_history ? previous : std::span<const VisiblePoint>();
  const bool done = divide_samples(DEEP, run.stop) && share_at(DEEP, run.frame, run.stop) &&
                    divide_samples(VISIBLE, run.stop) && (!keeps_history() || merge_with_history(run, visible)) &&
                    share_at(VISIBLE, run.frame, run.stop);
  run.stage_times.lap("Paths: sharing");
  return done;
}

/// Links of visible points then hold the temporal reservoirs.
bool CellSharedStage::merge_with_history(const FrameRun& run, std::span<const VisiblePoint> visible) {
  return run.for_pixels([&](uint32_t pixel, uint64_t& non_finite) {
    PathReservoir& temporal = current_.temporal[pixel];
    temporal.c = 0.0f;
    temporal.W = 0.0f;
    if (!visible[pixel].exists) return;
    PathLink& link = links_[VISIBLE][pixel];
    PathReservoir found = ScreenSpacePaths::initial_sample(link);
    temporal_groups_.start(pixel, found.sample, continuations_[VISIBLE].of(pixel));
    temporal = temporal_paths_.reuse_in_time(visible[pixel], found, previous_, pixel, run.frame, non_finite,
                                             reuse_counts_[pixel]);
    link.to = temporal.sample;
    link.W = temporal.W;
    const std::span<const Rgb> groups = temporal_groups_.of(temporal.sample);
    if (groups.empty() || !(temporal.W > 0.0f)) return;
    continuations_[VISIBLE].set(pixel, groups);
    temporal_groups_.start(pixel, temporal.sample, continuations_[VISIBLE].of(pixel));  // history may be given back
  });
}

void CellSharedStage::keep_history() {
  if (!keeps_history()) return;
  temporal_groups_.keep({current_.temporal});
  current_.view = {context_.paths.scene.camera, image_region(context_.settings)};
  std::swap(current_, previous_);
  is_history_void_ = false;
  current_.temporal.resize(pixel_count());
}

/// What is left of samples is then for all. Visible points go second: their samples end where deep vertices have
/// shared.
bool CellSharedStage::divide_samples(Vertex vertex, const StopCondition& stop) {
  const bool is_shared = shares_at(vertex);
  return for_each_block(pixel_count(), kPixelBlock, stop, [&](size_t begin, size_t end) {
    for (size_t pixel = begin; pixel < end; ++pixel) {
      const ReflectedPaths deep = vertex == VISIBLE ? reflected_[pixel] : ReflectedPaths();
      reflected_[pixel] = {};
      if (splits_at(vertex)) reflected_by_kind_[pixel] = {};
      PathLink& link = links_[vertex][pixel];
      if (splits_groups()) divide_groups(vertex, static_cast<uint32_t>(pixel), is_shared);
      if (!link.from.exists || !(link.W > 0.0f)) continue;
      if (is_shared) {
        CellSharedPaths::divide(link, deep, reflected_[pixel]);
        if (keeps_history()) reflected_[pixel].even = {};  // may be negative, and history picks by light
      } else {
        CellSharedPaths::keep(link, deep, reflected_[pixel]);
      }
      if (splits_at(vertex)) reflected_by_kind_[pixel] = link_shares_[pixel] * reflected_[pixel].sum;
    }
  });
}

/// Of a pixel. What deep vertices reflect makes room for what visible points do.
void CellSharedStage::divide_groups(Vertex vertex, uint32_t pixel, bool is_shared) {
  const PathLink& link = links_[vertex][pixel];
  const ReflectedGroups reflected = reflected_groups(pixel);
  LightByGroup deep_sum(reflected.sum.size()), deep_even(reflected.even.size());
  const ReflectedGroups deep{deep_sum, deep_even};
  if (vertex == VISIBLE) {
    std::ranges::copy(reflected.sum, deep.sum.begin());
    std::ranges::copy(reflected.even, deep.even.begin());
  }
  group_sums_.clear(pixel);
  group_evens_.clear(pixel);
  if (!link.from.exists || !(link.W > 0.0f)) return;
  const std::span<Rgb> continuation = continuations_[vertex].of(pixel);
  if (!is_shared) return CellSharedPaths::keep_groups(link, continuation, deep, reflected);
  CellSharedPaths::divide_groups(link, continuation, deep, reflected);
  if (keeps_history()) group_evens_.clear(pixel);  // as below
}

bool CellSharedStage::share_at(Vertex vertex, uint32_t frame, const StopCondition& stop) {
  if (!shares_at(vertex)) return true;
  if (!make_groups(vertex, frame, stop)) return false;
  const size_t block = std::max<size_t>(kPixelBlock / static_cast<size_t>(cells(vertex).groups.size), 1);
  return for_each_block(groups_.count(), block, stop, [&](size_t begin, size_t end) {
    CellSharedPaths::Group group = empty_group(vertex);
    CellSharedPaths::Scratch scratch;
    for (size_t g = begin; g < end; ++g) {
      if (g + 1 < end) prefetch_group(vertex, groups_.members(g + 1));
      group.u_choice = choice(vertex, static_cast<uint32_t>(g), frame);
      share_group(vertex, groups_.members(g), group, scratch);
    }
  });
}

uint64_t CellSharedStage::seed_of_region() const {
  const uint64_t place = (static_cast<uint64_t>(region_.x) << 32) + static_cast<uint64_t>(region_.y);
  return hash_combine(mix_bits(context_.settings.seed), place);
}

double CellSharedStage::choice(Vertex vertex, uint32_t group, uint32_t frame) const {
  return Rng(seed_of_region(), group, frame, kChoiceStreams + static_cast<uint32_t>(vertex)).next_double();
}

bool CellSharedStage::make_groups(Vertex vertex, uint32_t frame, const StopCondition& stop) {
  const SharingCells& cells = this->cells(vertex);
  const float fine = std::ldexp(1.0f, -cells.groups.fine_levels);
  GridSettings grid;
  grid.cell_pixels = cells.pixels * fine;
  grid.min_cell_size = cells.smallest * fine;
  const GridLayout layout = cell_layout(context_, grid, frame);
  constexpr size_t kAhead = 8;
  const bool done = for_each_block(pixel_count(), kPixelBlock, stop, [&](size_t begin, size_t end) {
    for (size_t pixel = begin; pixel < end; ++pixel) {
      if (pixel + kAhead < end) prefetch(links_[vertex][pixel + kAhead].from);
      const VisiblePoint& point = links_[vertex][pixel].from;
      keys_[pixel] = point.exists ? cell_key(layout, point.receiver.position, point.receiver.n) : kNoCell;
      classes_[pixel] = point.exists ? CellSharedPaths::group_class(point) : 0;
    }
  });
  GroupRules rules = cells.groups;
  if (is_resampled(vertex)) rules.size = std::min(rules.size, kMostResampled);
  if (vertex == VISIBLE && context_.settings.path_sharing.for_denoiser)
    rules.size = std::min(rules.size, kMostForDenoisers);
  if (done) groups_.build(keys_, classes_, rules, hash_combine(seed_of_region(), frame));
  return done;
}

/// Members of a group lie anywhere in memory.
void CellSharedStage::prefetch_group(Vertex vertex, std::span<const uint32_t> pixels) const {
  for (const uint32_t pixel : pixels) {
    prefetch(links_[vertex][pixel]);
    prefetch(reflected_[pixel]);
  }
}

CellSharedPaths::Group CellSharedStage::empty_group(Vertex vertex) const {
  CellSharedPaths::Group group;
  group.weights = context_.settings.path_sharing.weights;
  group.is_fresh = !is_resampled(vertex);
  if (!group.is_fresh && group.weights == PairWeights::BALANCE) group.weights = PairWeights::TARGETS;
  group.handed_on = kHandedOn;
  return group;
}

void CellSharedStage::share_group(Vertex vertex, std::span<const uint32_t> pixels, CellSharedPaths::Group& group,
                                  CellSharedPaths::Scratch& scratch) {
  group.links.clear();
  group.confidences.clear();
  group.reflected.clear();
  group.reflected_by_kind.clear();
  group.continuations.clear();
  group.reflected_groups.clear();
  for (const uint32_t pixel : pixels) {
    group.links.push_back(&links_[vertex][pixel]);
    group.confidences.push_back(is_resampled(vertex) ? current_.temporal[pixel].c : 1.0f);
    group.reflected.push_back(&reflected_[pixel]);
    if (splits_at(vertex)) group.reflected_by_kind.push_back(&reflected_by_kind_[pixel]);
    if (splits_groups()) {
      group.continuations.emplace_back(continuations_[vertex].of(pixel));
      group.reflected_groups.push_back(reflected_groups(pixel));
    }
  }
  const auto handed_on = static_cast<uint32_t>(paths_.share(group, scratch));
  for (size_t i = 0; i < pixels.size(); ++i) {
    const bool is_own = scratch.factors[i] > 0.0f;
    reuse_counts_[pixels[i]] += handed_on - static_cast<uint32_t>(is_own);
  }
}

Rgb CellSharedStage::shade(const VisiblePoint& visible, uint32_t pixel) const {
  return visible.throughput * reflected_[pixel].sum;
}

KindColors CellSharedStage::shade_by_kind(const VisiblePoint& visible, uint32_t pixel, Rgb) const {
  return reflected_by_kind_[pixel] * visible.throughput;
}

void CellSharedStage::shade_groups(const VisiblePoint& visible, uint32_t pixel, float factor,
                                   std::span<Rgb> sums) const {
  add_to_groups(sums, group_sums_.of(pixel), visible.throughput * factor);
}

std::optional<Rgb> CellSharedStage::shade_alone(const VisiblePoint& visible, uint32_t pixel) const {
  return visible.throughput * reflected_[pixel].own;
}

size_t CellSharedStage::memory_bytes() const {
  const size_t reservoirs = current_.temporal.capacity() + previous_.temporal.capacity();
  return reservoirs * sizeof(PathReservoir) +
         (links_[VISIBLE].capacity() + links_[DEEP].capacity()) * sizeof(PathLink) +
         reflected_.capacity() * sizeof(ReflectedPaths) + keys_.capacity() * sizeof(CellKey) +
         (link_shares_.capacity() + reflected_by_kind_.capacity()) * sizeof(KindColors) +
         continuations_[VISIBLE].memory_bytes() + continuations_[DEEP].memory_bytes() + group_sums_.memory_bytes() +
         group_evens_.memory_bytes() + temporal_groups_.memory_bytes() +
         (classes_.capacity() + reuse_counts_.capacity()) * sizeof(uint32_t) + groups_.memory_bytes();
}

}  // namespace cistern
