#include "restir/secondary_light_reservoirs.h"

#include <array>

#include "base/rng.h"
#include "grid/stride_selection.h"
#include "resampling/resample.h"
#include "restir/initial_light.h"

namespace cistern {
namespace {

/// Normals of reservoirs that are merged differ by less than this: 25 degrees. The paper gives no number.
constexpr float kSmallestNormalCosine = 0.9063f;

}  // namespace

LightReservoir SecondaryLightReservoirs::initial_candidates(const VisiblePoint& vertex, Rng& rng,
                                                            uint64_t& non_finite) const {
  return resample_light_candidates(context_, vertex, reuse_.light_candidates, rng, non_finite);
}

CellKey SecondaryLightReservoirs::jittered_key(const GridLayout& layout, const VisiblePoint& vertex, Rng& rng) {
  const Vec3 n = vertex.receiver.n;
  return cell_key(layout, jitter_in_tangent_plane(layout, vertex.receiver.position, n, rng.next_vec2()), n);
}

LightReservoir SecondaryLightReservoirs::reuse(const VisiblePoint& vertex, const LightReservoir& own,
                                               const VertexCells& cells, std::optional<uint32_t> self, Rng& rng,
                                               uint64_t& non_finite, uint32_t& others) const {
  std::array<LightReservoir, kMaxCellCount + 1> reservoirs;
  std::array<LightDomain, kMaxCellCount + 1> domains;
  reservoirs[0] = own;
  domains[0] = {&vertex};
  size_t count = 1;

  const std::span<const uint32_t> cell = cells.grid.find(jittered_key(cells.layout, vertex, rng));
  const auto max_count = static_cast<uint32_t>(reuse_.max_count);
  const StrideSelection drawn = select_by_stride(static_cast<uint32_t>(cell.size()), max_count, rng.next_double());
  const float cap = self ? INFINITY : reuse_.confidence_cap / static_cast<float>(std::max(drawn.count, 1u));
  for (uint32_t i = 0; i < drawn.count; ++i) {
    const uint32_t other = cell[drawn[i]];
    if (other == self || dot(cells.points[other].receiver.n, vertex.receiver.n) < kSmallestNormalCosine) continue;
    reservoirs[count] = cap_confidence(to_present(cells.world, cells.reservoirs[other]), cap);
    domains[count++] = {&cells.points[other], cells.world};
  }
  if (count == 1) return own;
  others += static_cast<uint32_t>(count) - 1;
  const auto p_hat = [&](size_t i, const LightSample& sample) {
    return domain_target(context_, candidate_count(), domains[i], sample);
  };
  // As in ReservoirDirectLight: counting what was found under other lights would leave their ghosts.
  const MisWeight weights = mis_weight_for(cells.world ? Bias::UNBIASED : reuse_.bias, static_cast<int>(count));
  return resample<LightSample>({reservoirs.data(), count}, p_hat, weights, rng, non_finite);
}

std::optional<ArrivingLight> SecondaryLightReservoirs::shade(const VisiblePoint& vertex,
                                                             const LightReservoir& reservoir) const {
  if (!(reservoir.W > 0.0f)) return std::nullopt;
  std::optional<ArrivingLight> light = arriving_light(context_, candidate_count(), vertex, reservoir.sample);
  if (light) light->radiance *= reservoir.W;
  return light;
}

}  // namespace cistern
