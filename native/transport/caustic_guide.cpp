#include "transport/caustic_guide.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/hash.h"
#include "base/sphere_map.h"

namespace cistern {
namespace {

/// Directions of a cell are told apart by so many parts of the sphere: 64 x 64 of equal solid angle, 3 degrees wide.
constexpr int kSide = 64;
/// Lobes of less than this share of a cell's light are not worth the directions.
constexpr double kLeastShare = 0.05;
/// Narrower lobes could not be told by directions in single precision.
constexpr double kLeastSquareRadius = 1e-8;

struct DVec3 {
  double x = 0.0, y = 0.0, z = 0.0;
  void add(const Vec3& v, double weight) {
    x += weight * v.x;
    y += weight * v.y;
    z += weight * v.z;
  }
  double length() const { return std::sqrt(x * x + y * y + z * z); }
  Vec3 over(double d) const {
    return {static_cast<float>(x / d), static_cast<float>(y / d), static_cast<float>(z / d)};
  }
};

/// The coarsest with lobes around a point's own.
NestedCellKey coarsest_around(NestedCellKey key) {
  for (int i = 0; i < CausticGuide::kDoublings; ++i) key = coarser_cell(key);
  return key;
}

uint32_t part_of(const Vec3& w) {
  const Vec2 p = equal_area_point(w);
  const auto coordinate = [](float u) { return std::clamp(static_cast<int>(u * kSide), 0, kSide - 1); };
  return static_cast<uint32_t>(coordinate(p.y) * kSide + coordinate(p.x));
}

/// A photon as the middle of its cell sees where it came from.
struct Seen {
  uint32_t part = 0;
  const CausticPhoton* photon = nullptr;
  Vec3 direction;
};

/// Of a lobe that is as strong as other light so many directions, over all others. Where most of its directions lead
/// past the lamp it is worth less, but some.
constexpr double kWorth = 1.5, kLeastWorth = 0.03, kMostWorth = 0.5;

/// `light`: of all the cell. Returns how strong the lobe is beside other light, times the share of its directions that
/// lead to the lamp, times its own share.
double add_lobe(DirectionLobes& lobes, std::span<const Seen> of_part, const Vec3& middle, double light) {
  DVec3 towards;
  double of_lobe = 0.0, spread = 0.0, nearness = 0.0, strength = 0.0;
  for (const Seen& seen : of_part) {
    const double weight = seen.photon->light;
    // Lengths in single precision would count as spread.
    const double length = std::hypot(double{seen.direction.x}, double{seen.direction.y}, double{seen.direction.z});
    towards.add(seen.direction, weight / length);
    of_lobe += weight;
    spread += weight * seen.photon->square_radius;
    nearness += weight * seen.photon->nearness;
    strength += weight * seen.photon->strength;
  }
  // Mean square of the distances from the mean direction, on the unit sphere.
  const double variance = 2.0 * (1.0 - towards.length() / of_lobe);
  const double square_radius = std::max({spread / of_lobe, variance, kLeastSquareRadius});
  lobes.add({.axis = normalize(towards.over(of_lobe)),
             .square_radius = static_cast<float>(square_radius),
             .share = static_cast<float>(of_lobe / light),
             .from = middle,
             .nearness = static_cast<float>(nearness / of_lobe)});
  const double hits = std::clamp(spread / of_lobe, kLeastSquareRadius, square_radius) / square_radius;
  return strength / light * hits;
}

/// About the directions of most light.
std::optional<DirectionLobes> lobes_of(std::span<const CausticPhoton* const> of_cell) {
  if (of_cell.size() < CausticGuide::kLeastPhotons) return std::nullopt;
  DVec3 places;
  double light = 0.0;
  for (const CausticPhoton* photon : of_cell) {
    places.add(photon->position, photon->light);
    light += photon->light;
  }
  const Vec3 middle = places.over(light);
  std::vector<Seen> all;
  all.reserve(of_cell.size());
  for (const CausticPhoton* photon : of_cell) {
    const Vec3 direction =
        normalize_or(photon->direction + photon->nearness * (photon->position - middle), photon->direction);
    all.push_back({part_of(direction), photon, direction});
  }
  std::ranges::sort(all, {}, [](const Seen& seen) { return std::pair(seen.part, seen.photon); });
  struct Part {
    std::span<const Seen> photons;
    double light = 0.0;
  };
  std::vector<Part> parts;
  for (auto begin = all.cbegin(); begin != all.cend();) {
    const auto end = std::find_if(begin, all.cend(), [&](const Seen& seen) { return seen.part != begin->part; });
    Part& part = parts.emplace_back(Part{{begin, end}});
    for (const Seen& seen : part.photons) part.light += seen.photon->light;
    begin = end;
  }
  std::ranges::sort(parts, {}, [](const Part& part) { return std::pair(-part.light, part.photons.data()); });
  DirectionLobes lobes;
  double strength = 0.0;
  for (const Part& part : std::span(parts).first(std::min(parts.size(), DirectionLobes::kMost)))
    if (part.light >= kLeastShare * light) strength += add_lobe(lobes, part.photons, middle, light);
  const double worth = kWorth * strength / (1.0 + kWorth * strength);
  lobes.set_worth(static_cast<float>(std::clamp(worth, kLeastWorth, kMostWorth)));
  return lobes.lobes().empty() ? std::nullopt : std::optional(lobes);
}

}  // namespace

CausticGuide::CausticGuide(const NestedCells& cells, std::span<const CausticPhoton> photons) : cells_(cells) {
  std::vector<PlacedPhoton> placed;
  placed.reserve(photons.size());
  for (const CausticPhoton& photon : photons)
    if (photon.cell != kNoNestedCell) placed.emplace_back(photon.cell, &photon);
  std::ranges::sort(placed);
  std::vector<NestedCellKey> own_cells;
  for (const auto& [cell, photon] : placed) {
    if (own_cells.empty() || own_cells.back() != cell) own_cells.push_back(cell);
    marks_.set(mix_bits(coarsest_around(cell)) % kMarks);
  }
  std::vector<NestedCellIndex::Entry> entries;
  for (int doublings = 0; doublings <= kDoublings; ++doublings) {
    if (doublings > 0) {
      for (PlacedPhoton& photon : placed) photon.first = coarser_cell(photon.first);
      std::ranges::sort(placed);
    }
    add_rows(placed, entries);
  }
  index_.build(std::move(entries), own_cells);
}

void CausticGuide::add_rows(std::span<const PlacedPhoton> sorted, std::vector<NestedCellIndex::Entry>& entries) {
  std::vector<const CausticPhoton*> of_cell;
  for (size_t i = 0; i < sorted.size(); ++i) {
    const NestedCellKey cell = sorted[i].first;
    of_cell.push_back(sorted[i].second);
    if (i + 1 < sorted.size() && sorted[i + 1].first == cell) continue;
    if (const std::optional<DirectionLobes> lobes = lobes_of(of_cell)) {
      entries.push_back({cell, static_cast<uint32_t>(rows_.size())});
      rows_.push_back(*lobes);
    }
    of_cell.clear();
  }
}

NestedCellKey CausticGuide::cell(const Vec3& position, const Vec3& normal) const {
  const NestedCellKey key = cells_.key(position, normal);
  if (key == kNoNestedCell || !marks_.test(mix_bits(coarsest_around(key)) % kMarks)) return kNoNestedCell;
  index_.prefetch(key);
  return key;
}

const DirectionLobes* CausticGuide::find(NestedCellKey key) const {
  const auto row = index_.find(key);
  return row ? &rows_[*row] : nullptr;
}

}  // namespace cistern
