#include "lights/emitter_clusters.h"

#include <algorithm>
#include <numeric>

#include "base/morton.h"

namespace cistern {
namespace {

constexpr uint32_t kLastMorton = ~0u;

/// Position along the Z curve through the box; distant emitters come last.
uint32_t morton(const EmitterPlace& place, const Bounds3& box) {
  return place.is_distant ? kLastMorton : morton_code(place.center, box);
}

/// What emitters are sorted by: objects side by side, each in one piece.
struct Position {
  uint32_t object_morton, object, morton, emitter;
  friend auto operator<=>(const Position&, const Position&) = default;  // NOLINT(modernize-use-nullptr)
};

std::vector<Position> along_curve(std::span<const EmitterPlace> places) {
  Bounds3 box;
  for (const EmitterPlace& place : places)
    if (!place.is_distant) box.extend(place.center);
  std::vector<Position> order(places.size());
  for (uint32_t i = 0; i < places.size(); ++i) {
    const bool continues = i > 0 && places[i - 1].object == places[i].object;  // objects are runs in a light set
    const uint32_t code = morton(places[i], box);
    order[i] = {continues ? order[i - 1].object_morton : code, places[i].object, code, i};
  }
  std::ranges::sort(order);
  return order;
}

/// Where clusters start among `order`, and its end.
std::vector<uint32_t> cut(std::span<const Position> order, size_t most_clusters) {
  const auto count = static_cast<uint32_t>(order.size());
  std::vector<uint32_t> objects{0};
  for (uint32_t i = 1; i < count; ++i)
    if (order[i].object != order[i - 1].object) objects.push_back(i);
  objects.push_back(count);
  const size_t object_count = objects.size() - 1;
  std::vector<uint32_t> first;
  const auto cut_evenly = [&first](uint32_t begin, uint32_t end, uint64_t pieces) {
    for (uint64_t i = 0; i < pieces; ++i) first.push_back(begin + static_cast<uint32_t>((end - begin) * i / pieces));
  };
  if (object_count > most_clusters) {
    cut_evenly(0, count, most_clusters);
  } else {
    const size_t spare = most_clusters - object_count;
    for (size_t i = 0; i < object_count; ++i) {
      const uint64_t size = objects[i + 1] - objects[i];
      cut_evenly(objects[i], objects[i + 1], std::min(size, 1 + spare * size / count));
    }
  }
  first.push_back(count);
  return first;
}

}  // namespace

EmitterClusters::EmitterClusters(std::span<const EmitterPlace> places, std::span<const float> powers,
                                 size_t most_clusters)
    : cluster_of_(places.size()), pmf_(places.size()), members_(places.size()), cdf_(places.size()) {
  if (places.size() <= most_clusters) {
    first_.resize(places.size() + 1);
    std::iota(first_.begin(), first_.end(), 0u);
    std::iota(members_.begin(), members_.end(), 0u);
  } else {
    const std::vector<Position> order = along_curve(places);
    first_ = cut(order, most_clusters);
    for (size_t i = 0; i < order.size(); ++i) members_[i] = order[i].emitter;
  }
  fill_probabilities(powers);
}

void EmitterClusters::fill_probabilities(std::span<const float> powers) {
  for (uint32_t cluster = 0; cluster < count(); ++cluster) {
    double total = 0.0;
    for (uint32_t i = first_[cluster]; i < first_[cluster + 1]; ++i) total += powers[members_[i]];
    double sum = 0.0;
    for (uint32_t i = first_[cluster]; i < first_[cluster + 1]; ++i) {
      const uint32_t emitter = members_[i];
      const double pmf = total > 0.0 ? powers[emitter] / total : 1.0 / (first_[cluster + 1] - first_[cluster]);
      cluster_of_[emitter] = cluster;
      pmf_[emitter] = static_cast<float>(pmf);
      cdf_[i] = sum += pmf;
    }
  }
}

uint32_t EmitterClusters::choose(uint32_t cluster, double u) const {
  const auto begin = cdf_.begin() + first_[cluster], end = cdf_.begin() + first_[cluster + 1];
  auto found = std::upper_bound(begin, end, u);
  // Rounding may carry u past the end: then the last that has probability.
  while (found == end || (pmf_[members_[static_cast<size_t>(found - cdf_.begin())]] == 0.0f && found != begin)) --found;
  return members_[static_cast<size_t>(found - cdf_.begin())];
}

size_t EmitterClusters::memory_bytes() const {
  return (cluster_of_.capacity() + first_.capacity() + members_.capacity()) * sizeof(uint32_t) +
         pmf_.capacity() * sizeof(float) + cdf_.capacity() * sizeof(double);
}

}  // namespace cistern
