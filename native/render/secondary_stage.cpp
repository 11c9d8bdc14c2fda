#include "render/secondary_stage.h"

#include <algorithm>

#include "render/cell_layout.h"

namespace cistern {
namespace {

constexpr size_t kVertexBlock = 512;
/// Streams of a pixel's random numbers: this, plus kPasses for each vertex, plus the pass.
constexpr uint32_t kFirstStream = 0x10000, kPasses = 32;
enum MergePass : uint32_t { INITIAL, INSERTION, TEMPORAL, SPATIAL };

}  // namespace

SecondaryStage::SecondaryStage(const FrameContext& context)
    : context_(context), light_(context.paths, context.settings.secondary_reuse) {
  const Region& region = context.settings.region;
  first_vertex_.resize(static_cast<size_t>(region.width) * static_cast<size_t>(region.height));
  counts_.resize(first_vertex_.size());
}

void SecondaryStage::take_over(SecondaryStage&& earlier, const HistorySource& source) {
  std::swap(vertices_, earlier.vertices_);
  std::swap(pixels_, earlier.pixels_);
  std::swap(cells_, earlier.cells_);
  std::swap(previous_, earlier.previous_);
  std::swap(scratch_, earlier.scratch_);
  std::swap(keys_, earlier.keys_);
  previous_.world = source.earlier();
}

void SecondaryStage::Batch::add(uint32_t pixel, const PathCapture& capture) {
  counts.emplace_back(pixel, static_cast<uint32_t>(capture.vertices.size()));
  vertices.insert(vertices.end(), capture.vertices.begin(), capture.vertices.end());
  kinds.insert(kinds.end(), capture.vertex_kinds.begin(), capture.vertex_kinds.end());
}

void SecondaryStage::begin_frame() { batches_.clear(); }

void SecondaryStage::add_batch(Batch&& batch) {
  if (batch.counts.empty()) return;
  const std::lock_guard lock(mutex_);
  batches_.push_back(std::move(batch));
}

/// In the order of their first pixels: whichever thread was faster.
bool SecondaryStage::join_batches(const FrameRun& run) {
  std::ranges::sort(batches_, {}, [](const Batch& batch) { return batch.counts.front().first; });
  std::vector<size_t> first{0};  // vertex of each batch, and the end
  for (const Batch& batch : batches_) first.push_back(first.back() + batch.vertices.size());
  const size_t count = first.back();
  vertices_.resize(count);
  if (context_.paths.splits_kinds) kinds_.resize(count);
  pixels_.resize(count);
  reuse_counts_.resize(count);
  cells_.points.resize(count);
  cells_.reservoirs.resize(count);
  scratch_.resize(count);
  const bool done = for_each_block(batches_.size(), 1, run.stop, [&](size_t i, size_t) {
    Batch& batch = batches_[i];
    auto vertex = static_cast<uint32_t>(first[i]);
    for (const auto& [pixel, vertex_count] : batch.counts) {
      first_vertex_[pixel] = vertex;
      counts_[pixel] = vertex_count;
      std::fill_n(pixels_.begin() + vertex, vertex_count, pixel);
      vertex += vertex_count;
    }
    std::ranges::copy(batch.vertices, vertices_.begin() + static_cast<std::ptrdiff_t>(first[i]));
    std::ranges::copy(batch.kinds, kinds_.begin() + static_cast<std::ptrdiff_t>(kinds_.empty() ? 0 : first[i]));
    batch = {};
  });
  batches_.clear();
  return done;
}

Rng SecondaryStage::random_numbers(uint32_t vertex, uint32_t frame, uint32_t pass) const {
  const uint32_t pixel = pixels_[vertex], ordinal = vertex - first_vertex_[pixel];
  return pixel_random_numbers(image_region(context_.settings), context_.settings.seed, pixel, frame,
                              kFirstStream + ordinal * kPasses + pass);
}

/// body(vertex, non_finite)
template <class Body>
bool SecondaryStage::for_vertices(const FrameRun& run, const Body& body) const {
  return for_each_block(vertices_.size(), kVertexBlock, run.stop, [&](size_t begin, size_t end) {
    uint64_t non_finite = 0;
    for (size_t i = begin; i < end; ++i) body(static_cast<uint32_t>(i), non_finite);
    run.non_finite_weights.fetch_add(non_finite, std::memory_order_relaxed);
  });
}

bool SecondaryStage::reuse(const FrameRun& run) {
  if (!join_batches(run)) return false;
  const SecondaryReuse& reuse = context_.settings.secondary_reuse;
  const bool started = for_vertices(run, [&](uint32_t vertex, uint64_t& non_finite) {
    Rng rng = random_numbers(vertex, run.frame, INITIAL);
    cells_.points[vertex] = vertices_[vertex].point;
    reuse_counts_[vertex] = 0;
    cells_.reservoirs[vertex] = light_.initial_candidates(vertices_[vertex].point, rng, non_finite);
  });
  if (!started) return false;
  run.stage_times.lap("Later points: candidates");
  if (!reuse.cell_reuse) return true;
  if (!build_cells(run)) return false;
  run.stage_times.lap("Later points: grid");
  if (reuse.temporal_reuse && !previous_.points.empty() && !merge_with_cells(run, previous_, TEMPORAL)) return false;
  run.stage_times.lap("Later points: temporal reuse");
  for (uint32_t pass = 0; pass < static_cast<uint32_t>(reuse.spatial_passes); ++pass)
    if (!merge_with_cells(run, cells_, SPATIAL + pass)) return false;
  run.stage_times.lap("Later points: spatial reuse");
  return true;
}

bool SecondaryStage::build_cells(const FrameRun& run) {
  cells_.layout = cell_layout(context_, run.frame);
  keys_.resize(vertices_.size());
  const bool done = for_vertices(run, [&](uint32_t vertex, uint64_t&) {
    Rng rng = random_numbers(vertex, run.frame, INSERTION);
    keys_[vertex] = SecondaryLightReservoirs::jittered_key(cells_.layout, cells_.points[vertex], rng);
  });
  if (done) cells_.grid.build(keys_);
  return done;
}

bool SecondaryStage::merge_with_cells(const FrameRun& run, const VertexCells& cells, uint32_t pass) {
  const bool is_own = &cells == &cells_;
  const bool done = for_vertices(run, [&](uint32_t vertex, uint64_t& non_finite) {
    Rng rng = random_numbers(vertex, run.frame, pass);
    const std::optional<uint32_t> self = is_own ? std::optional(vertex) : std::nullopt;
    scratch_[vertex] = light_.reuse(cells_.points[vertex], cells_.reservoirs[vertex], cells, self, rng, non_finite,
                                    reuse_counts_[vertex]);
  });
  if (done) std::swap(cells_.reservoirs, scratch_);
  return done;
}

void SecondaryStage::shade(uint32_t pixel, PathRecord& record, std::span<PathSample* const> samples,
                           PixelLight* by_kind, const PixelGroups& groups) const {
  const PathLimits& limits = context_.paths.limits;
  for (uint32_t i = first_vertex_[pixel]; i < first_vertex_[pixel] + counts_[pixel]; ++i) {
    const LightVertex& vertex = vertices_[i];
    const std::optional<ArrivingLight> light = light_.shade(vertex.point, cells_.reservoirs[i]);
    if (!light) continue;
    const Rgb reflected = light->f_cos * light->radiance;
    const LightGroup group = group_of(cells_.reservoirs[i].sample);
    const float limit = limits.clamp_after(vertex.point.state.depth + 1);
    const Rgb direct = clamp_contribution(vertex.to_direct * reflected, limit);
    const Rgb indirect = clamp_contribution(vertex.to_indirect * reflected, limit);
    record.add_left(direct, indirect, vertex.point.is_caught);
    if (!vertex.point.is_caught) add_to_group(groups.light, group, direct + indirect);
    if (by_kind && !vertex.point.is_caught) add_by_kind(i, *light, by_kind->light);
    for (size_t link = 0; link < samples.size(); ++link) {
      if (static_cast<int>(link) == vertex.sample_point_of) {
        samples[link]->light = {light->wi, light->radiance, light->f_cos, light->even_cos};
        samples[link]->light_visibility = light->visibility;
        samples[link]->light_group = group;
      } else {
        const Rgb continuation = vertex.to_continuation[link] * reflected;
        samples[link]->continuation.radiance += continuation;
        add_to_group(groups.continuations[link], group, continuation);
      }
    }
  }
}

/// Vertices behind a visible point that lets light through may be first vertices as well.
void SecondaryStage::add_by_kind(uint32_t i, const ArrivingLight& light, LightByKind& by_kind) const {
  const PathLimits& limits = context_.paths.limits;
  const LightVertex& vertex = vertices_[i];
  const Rgb reflected = light.f_cos * light.radiance;
  const float limit = limits.clamp_after(vertex.point.state.depth + 1);
  const Rgb direct = reflected * clamp_factor(vertex.to_direct * reflected, limit);
  if (is_first_vertex(vertex.point)) {
    const KindColors shares =
        rough_shares(context_.paths.scene, vertex.point, light.wi, light.visibility, &context_.paths.accel);
    return by_kind.add_direct(shares * (vertex.to_direct * direct));
  }
  const Rgb indirect = reflected * clamp_factor(vertex.to_indirect * reflected, limit);
  by_kind.add_indirect(kinds_[i].to_direct * direct);
  by_kind.add_indirect(kinds_[i].to_indirect * indirect);
}

uint32_t SecondaryStage::reuse_count(uint32_t pixel) const {
  uint32_t sum = 0;
  for (uint32_t i = first_vertex_[pixel]; i < first_vertex_[pixel] + counts_[pixel]; ++i) sum += reuse_counts_[i];
  return sum;
}

void SecondaryStage::keep_history() {
  const SecondaryReuse& reuse = context_.settings.secondary_reuse;
  if (reuse.cell_reuse && reuse.temporal_reuse) std::swap(previous_, cells_);
  previous_.world = cells_.world = nullptr;
}

size_t SecondaryStage::memory_bytes() const {
  const auto bytes = [](const VertexCells& cells) {
    return cells.points.capacity() * sizeof(VisiblePoint) + cells.reservoirs.capacity() * sizeof(LightReservoir) +
           cells.grid.memory_bytes();
  };
  return bytes(cells_) + bytes(previous_) + vertices_.capacity() * sizeof(LightVertex) +
         kinds_.capacity() * sizeof(LightVertexKinds) + scratch_.capacity() * sizeof(LightReservoir) +
         keys_.capacity() * sizeof(CellKey) +
         (pixels_.capacity() + reuse_counts_.capacity() + first_vertex_.capacity() + counts_.capacity()) *
             sizeof(uint32_t);
}

}  // namespace cistern
