#include "render/settings.h"

#include <algorithm>

#include "base/check.h"
#include "transport/clear_panes.h"

namespace cistern {
namespace {

constexpr int kMaxResolution = 65536;
/// Pixels are counted in 31 bits.
constexpr int64_t kMaxPixels = (int64_t{1} << 31) - 1;
/// From edge to edge: of Cycles' widest Gaussian, three times the 10 that users set.
constexpr float kMaxFilterWidth = 30.0f;

template <class T>
void require(const char* setting, T value, T low, T high) {
  if (value >= low && value <= high) return;
  throw Error(std::string("setting '") + setting + "'",
              std::to_string(value) + " is not between " + std::to_string(low) + " and " + std::to_string(high));
}

void check_region(const Settings& s) {
  const Region& r = s.region;
  require("region x", r.x, 0, s.width - 1);
  require("region y", r.y, 0, s.height - 1);
  require("region width", r.width, 1, s.width - r.x);
  require("region height", r.height, 1, s.height - r.y);
  require("region pixels", int64_t{r.width} * r.height, int64_t{1}, kMaxPixels);
}

void check_shutter_curve(const std::vector<float>& curve) {
  for (float openness : curve) require("shutter_curve", openness, 0.0f, 1e6f);
  const bool lets_light_in = std::ranges::any_of(curve, [](float openness) { return openness > 0.0f; });
  if (!curve.empty() && (curve.size() < 2 || !lets_light_in))
    throw Error("setting 'shutter_curve'", "needs two numbers or more, of which one is larger than 0");
}

void check_limits(const PathLimits& limits) {
  constexpr int kMaxBounces = 1024;
  require("max_bounces", limits.max_bounces, 0, kMaxBounces);
  require("max_diffuse_bounces", limits.max_diffuse_bounces, 0, kMaxBounces);
  require("max_glossy_bounces", limits.max_glossy_bounces, 0, kMaxBounces);
  require("max_transmission_bounces", limits.max_transmission_bounces, 0, kMaxBounces);
  require("max_volume_bounces", limits.max_volume_bounces, 0, kMaxBounces);
  require("max_transparent_bounces", limits.max_transparent_bounces, 0, kMaxBounces);
  require("min_bounces", limits.min_bounces, 0, kMaxBounces);
  require("clamp_direct", limits.clamp_direct, 0.0f, 1e10f);
  require("clamp_indirect", limits.clamp_indirect, 0.0f, 1e10f);
  require("filter_glossy", limits.filter_glossy, 0.0f, 1e10f);
}

/// The parameters of each answer as its paper gives them.
DirectReuse paper_parameters(DirectAnswer direct, Bias bias) {
  DirectReuse p;
  const bool has_cache = direct == DirectAnswer::RESTIR_CACHE;
  p.light_candidates = direct == DirectAnswer::RESTIR ? 32 : 8;
  p.confidence_cap = has_cache ? 10.0f : 20.0f;
  p.spatial_neighbours = has_cache ? 8 : 5;
  p.spatial_radius = has_cache ? 5.0f : 30.0f;
  p.spatial_rounds = bias == Bias::FAST && !has_cache ? 2 : 1;
  return p;
}

void fill_direct_reuse(Settings& s) {
  DirectReuse& reuse = s.direct_reuse;
  const DirectReuse paper = paper_parameters(s.direct, reuse.bias);
  const auto fill = [](auto& value, auto of_paper) {
    if (value == 0) value = of_paper;
  };
  fill(reuse.light_candidates, paper.light_candidates);
  fill(reuse.confidence_cap, paper.confidence_cap);
  fill(reuse.spatial_neighbours, paper.spatial_neighbours);
  fill(reuse.spatial_radius, paper.spatial_radius);
  fill(reuse.spatial_rounds, paper.spatial_rounds);
  if (s.direct == DirectAnswer::RIS) reuse.temporal_reuse = reuse.spatial_reuse = reuse.visibility_reuse = false;
}

void check_direct_reuse(const DirectReuse& reuse) {
  require("light_candidates", reuse.light_candidates, 0, 1024);
  require("confidence_cap", reuse.confidence_cap, 0.0f, 1e6f);
  require("spatial_neighbours", reuse.spatial_neighbours, 0, kMaxSpatialNeighbours);
  require("spatial_radius", reuse.spatial_radius, 0.0f, 1e4f);
  require("spatial_rounds", reuse.spatial_rounds, 0, 16);
}

void check_screen_paths(ScreenPathReuse& reuse) {
  if (reuse.multi_bounce_share == 0.0f) reuse.multi_bounce_share = 1.0f;
  require("path_validation", reuse.validation_frames, 0, 1 << 16);
  require("path_multi_bounce", reuse.multi_bounce_share, 0.01f, 1.0f);
  require("path_spatial_cap", reuse.spatial_cap, 0.0f, 1e6f);
}

void check_world_paths(const WorldPathReuse& reuse) {
  require("path_cell_count", reuse.max_count, 1, static_cast<int>(PathCandidates::kMost) - 1);
}

void check_path_sharing(PathSharing& sharing) {
  constexpr int kMost = 256;
  const PathSharing ours;
  int &visible = sharing.visible.groups.size, &deep = sharing.deep.groups.size;
  if (visible == 0) visible = ours.visible.groups.size;
  if (deep == 0) deep = ours.deep.groups.size;
  require("share_visible", visible, 1, kMost);
  require("share_deep", deep, 1, kMost);
  require("share_visible_pixels", sharing.visible.pixels, 1.0f, 1e5f);
  require("share_deep_pixels", sharing.deep.pixels, 1.0f, 1e5f);
}

/// 10 % of the resolution for paths [Zhang and Wang 2023, §5.2], of which side it does not say; for all else a number,
/// since the other papers give none.
float default_cell_pixels(const Settings& s) {
  constexpr float kShare = 0.1f;
  if (s.indirect != IndirectAnswer::WORLD_REUSE) return GridSettings().cell_pixels;
  return std::max(kShare * static_cast<float>(std::max(s.width, s.height)), 1.0f);
}

void check_light_cache(LightCacheSettings& cache) {
  const LightCacheSettings paper;
  if (cache.merged == 0) cache.merged = paper.merged;
  if (cache.candidates == 0) cache.candidates = paper.candidates;
  if (cache.refresh_frames == 0) cache.refresh_frames = paper.refresh_frames;
  require("cache_merged", cache.merged, 1, 32);
  require("cache_candidates", cache.candidates, 1, 1 << 16);
  require("cache_refresh", cache.refresh_frames, 1, 1 << 16);
}

}  // namespace

EnvironmentDensity Settings::environment_density() const {
  return uses_reservoirs(direct) || uses_reservoirs(secondary) ? EnvironmentDensity::COMPLETE
                                                               : EnvironmentDensity::COMPENSATED;
}

bool Settings::passes_panes(const Scene& scene) const {
  const bool has_path_reservoirs = indirect != IndirectAnswer::PATH && indirect != IndirectAnswer::CELL_SHARED;
  const bool has_reservoirs = uses_reservoirs(direct) || uses_reservoirs(secondary) || has_path_reservoirs;
  return light_through_panes && !has_reservoirs && may_pass_panes(scene, limits);
}

bool Settings::has_temporal_reuse() const {
  if (uses_reservoirs(direct) && direct_reuse.temporal_reuse) return true;
  if (secondary == SecondaryAnswer::CELL_RESERVOIRS && secondary_reuse.temporal_reuse) return true;
  switch (indirect) {
    case IndirectAnswer::PATH:
      return false;
    case IndirectAnswer::SCREEN_REUSE:
      return screen_paths.temporal_reuse;
    case IndirectAnswer::WORLD_REUSE:
      return world_paths.temporal_reuse;
    case IndirectAnswer::CELL_SHARED:
      return path_sharing.temporal_reuse;
  }
  return true;
}

Settings Settings::of_later_frames() const {
  Settings later = *this;
  const bool has_reservoirs = uses_reservoirs(direct) || uses_reservoirs(secondary);
  if (path_sharing.first_frame_history && indirect == IndirectAnswer::CELL_SHARED && !has_reservoirs)
    later.path_sharing.temporal_reuse = false;
  return later;
}

Settings Settings::by_path_tracing() const {
  Settings plain = *this;
  plain.direct = DirectAnswer::NEE;
  plain.secondary = SecondaryAnswer::NEE;
  plain.indirect = IndirectAnswer::PATH;
  plain.guiding = Guiding::OFF;
  plain.caustic_guide = false;
  return plain;
}

bool Settings::uses_earlier_frames() const {
  return has_temporal_reuse() || (indirect == IndirectAnswer::WORLD_REUSE && world_paths.spatial_reuse);
}

bool Settings::tells_noise() const {
  return direct != DirectAnswer::RESTIR_CACHE && !of_later_frames().uses_earlier_frames();
}

void check_settings(Settings& s) {
  require("width", s.width, 1, kMaxResolution);
  require("height", s.height, 1, kMaxResolution);
  if (s.region.width == 0 && s.region.height == 0) s.region = {0, 0, s.width, s.height};
  check_region(s);
  require("samples", s.samples, 1, 1 << 24);
  require("threads", s.threads, 0, 1024);
  if (s.light_samples == 0) s.light_samples = 1;
  require("light_samples", s.light_samples, 1, 64);
  require("filter_width", s.filter_width, 0.01f, kMaxFilterWidth);
  require("light_groups", s.light_groups, 0, kMaxLightGroups);
  require("time_limit", s.time_limit, 0.0, 1e9);
  require("noise_threshold", s.noise_threshold, 0.0, 1e9);
  require("display_exposure", s.display_exposure, 0.0, 1e30);
  require("film_exposure", s.film_exposure, 0.0f, 1e10f);
  check_shutter_curve(s.shutter_curve);
  check_limits(s.limits);
  check_direct_reuse(s.direct_reuse);
  check_light_cache(s.light_cache);
  check_path_sharing(s.path_sharing);
  check_screen_paths(s.screen_paths);
  check_world_paths(s.world_paths);
  if (s.grid.min_cell_size == 0.0f) s.grid.min_cell_size = kDefaultMinCellShare;
  if (s.grid.cell_pixels == 0.0f) s.grid.cell_pixels = default_cell_pixels(s);
  require("min_cell_size", s.grid.min_cell_size, 1e-6f, 1.0f);
  require("cell_pixels", s.grid.cell_pixels, 1.0f, 1e5f);
  fill_direct_reuse(s);
  const Bias bias = s.direct_reuse.bias;
  const Reflection reflection = bias == Bias::FAST ? Reflection::AS_FOUND : Reflection::EVALUATED;
  s.secondary_reuse.bias = bias;
  s.secondary_reuse.cell_reuse = s.secondary == SecondaryAnswer::CELL_RESERVOIRS;
  s.path_sharing.weights = bias == Bias::FAST ? PairWeights::EQUAL : PairWeights::BALANCE;
  s.screen_paths.rules = {bias, s.screen_paths.rules.target, reflection};
  s.world_paths.rules = {bias, s.world_paths.rules.target, reflection};
}

}  // namespace cistern
