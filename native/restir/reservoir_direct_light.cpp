#include "restir/reservoir_direct_light.h"

#include <array>

#include "base/warp.h"
#include "resampling/resample.h"
#include "restir/initial_light.h"

namespace cistern {
namespace {

/// How much neighbours may differ: 25 degrees, 10 % of the distance. [Bitterli 2020] §5
constexpr Similarity kSimilarity{0.9063f, 1.1f};

/// Streams of random numbers of a pixel and frame; 0 is the path's.
enum Stream : uint32_t { INITIAL = 1, TEMPORAL, SPATIAL };

}  // namespace

/// Reservoirs to merge and where each comes from; the receiver is the first.
struct ReservoirDirectLight::Candidates {
  std::array<LightReservoir, kMaxSpatialNeighbours + 1> reservoirs;
  std::array<LightDomain, kMaxSpatialNeighbours + 1> domains;
  size_t count = 0;

  void add(const LightDomain& domain, const LightReservoir& reservoir) {
    domains[count] = domain;
    reservoirs[count++] = reservoir;
  }
};

LightReservoir ReservoirDirectLight::initial_candidates(const VisiblePoint& visible, uint32_t pixel, uint32_t frame,
                                                        uint64_t& non_finite) const {
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, INITIAL);
  LightReservoir initial = resample_light_candidates(context_, visible, reuse_.light_candidates, rng, non_finite);
  if (reuse_.visibility_reuse && initial.W > 0.0f && !is_visible(context_, visible, initial.sample)) initial.W = 0.0f;
  return initial;
}

LightReservoir ReservoirDirectLight::merge(const Candidates& candidates, Rng& rng, uint64_t& non_finite) const {
  // What was found under other lights says little by its number: counting it alone would leave their ghosts.
  const bool is_of_earlier_world = candidates.domains[candidates.count - 1].world != nullptr;
  const MisWeight weights =
      mis_weight_for(is_of_earlier_world ? Bias::UNBIASED : reuse_.bias, static_cast<int>(candidates.count));
  // A reservoir whose sample had to be visible can only have made what its own point sees.
  const bool needs_visibility = reuse_.visibility_reuse && weights != MisWeight::CONSTANT;
  const auto p_hat = [&](size_t i, const LightSample& sample) {
    const LightDomain& domain = candidates.domains[i];
    const float target = domain_target(context_, candidate_count(), domain, sample);
    return target > 0.0f && needs_visibility && !is_visible_in(context_, domain, sample) ? 0.0f : target;
  };
  const std::span reservoirs(candidates.reservoirs.data(), candidates.count);
  return resample<LightSample>(reservoirs, p_hat, weights, rng, non_finite);
}

LightReservoir ReservoirDirectLight::reuse_in_time(const VisiblePoint& visible, const LightReservoir& current,
                                                   const LightHistory& history, uint32_t pixel, uint32_t frame,
                                                   uint64_t& non_finite, uint32_t& others) const {
  if (history.visible_points.empty()) return current;
  const std::optional<EarlierPlace> before = reproject(history.view, image_, context_.scene.camera, visible, pixel);
  if (!before) return current;
  const VisiblePoint& previous = history.visible_points[before->pixel];
  if (!is_at(history.view, *before, previous, kSimilarity)) return current;
  Candidates candidates;
  candidates.add({&visible}, current);
  const LightReservoir kept = to_present(history.world, history.reservoirs[before->pixel]);
  candidates.add({&previous, history.world}, cap_confidence(kept, reuse_.confidence_cap * current.c));
  ++others;
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, TEMPORAL);
  return merge(candidates, rng, non_finite);
}

LightReservoir ReservoirDirectLight::reuse_in_space(std::span<const VisiblePoint> visible_points,
                                                    std::span<const LightReservoir> reservoirs, uint32_t pixel,
                                                    uint32_t frame, int round, uint64_t& non_finite,
                                                    uint32_t& others) const {
  const VisiblePoint& visible = visible_points[pixel];
  Rng rng = pixel_random_numbers(image_, seed_, pixel, frame, SPATIAL + static_cast<uint32_t>(round));
  Candidates candidates;
  candidates.add({&visible}, reservoirs[pixel]);
  for (int i = 0; i < reuse_.spatial_neighbours; ++i) {
    const std::optional<uint32_t> other =
        displaced_pixel(image_, pixel, square_to_disk(rng.next_vec2()) * reuse_.spatial_radius);
    if (!other || !visible_points[*other].exists || !is_similar(visible, visible_points[*other], kSimilarity)) continue;
    candidates.add({&visible_points[*other]}, reservoirs[*other]);
    ++others;
  }
  return candidates.count > 1 ? merge(candidates, rng, non_finite) : reservoirs[pixel];
}

Rgb ReservoirDirectLight::shade(const VisiblePoint& visible, const LightReservoir& reservoir) const {
  return reservoir.W > 0.0f ? reflected_light(context_, candidate_count(), visible, reservoir.sample) * reservoir.W
                            : Rgb();
}

}  // namespace cistern
