#include "transport/caustic_guide.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "base/sphere_map.h"
#include "grid/cell_statistics.h"

namespace cistern {
namespace {

/// Directions of a cell are told apart by so many parts of the sphere: 64 x 64 of equal solid angle, 3 degrees wide.
constexpr int kSide = 64;
/// Lobes of less than this share of a cell's light are not worth the directions.
constexpr double kLeastShare = 0.05;
/// Narrower lobes could not be told by directions in single precision.
constexpr double kLeastSquareRadius = 1e-8;

/// The coarsest that the index looks at, around a point's own.
NestedCellKey coarsest_around(NestedCellKey key) {
  for (int i = 0; i < NestedCellIndex::kDoublings; ++i) key = coarser_cell(key);
  return key;
}

uint32_t part_of(const Vec3& w) {
  const Vec2 p = equal_area_point(w);
  const auto coordinate = [](float u) { return std::clamp(static_cast<int>(u * kSide), 0, kSide - 1); };
  return static_cast<uint32_t>(coordinate(p.y) * kSide + coordinate(p.x));
}

/// Sums over the photons of a cell and part of the sphere.
struct PhotonStatistics {
  NestedCellKey cell = kNoNestedCell;
  uint32_t part = 0;
  double photons = 0.0, light = 0.0, spread = 0.0;  // the last: of square radii times light
  double x = 0.0, y = 0.0, z = 0.0;                 // of directions times light
  bool has_part_of(const PhotonStatistics& other) const { return part == other.part; }
  PhotonStatistics& operator+=(const PhotonStatistics& other) {
    photons += other.photons;
    light += other.light;
    spread += other.spread;
    x += other.x;
    y += other.y;
    z += other.z;
    return *this;
  }
  friend auto operator<=>(const PhotonStatistics&, const PhotonStatistics&) = default;  // NOLINT(modernize-use-nullptr)
};

PhotonStatistics statistics_of(const CausticPhoton& photon) {
  const double light = photon.light;
  const double x = photon.direction.x, y = photon.direction.y, z = photon.direction.z;
  const double scaled = light / std::sqrt(x * x + y * y + z * z);  // lengths in single precision would count as spread
  const uint32_t part = part_of(photon.direction);
  return {photon.cell, part, 1.0, light, photon.square_radius * light, x * scaled, y * scaled, z * scaled};
}

/// `light`: of all the cell.
void add_lobe(DirectionLobes& lobes, const PhotonStatistics& sums, double light) {
  const double length = std::sqrt(sums.x * sums.x + sums.y * sums.y + sums.z * sums.z);
  const Vec3 mean{static_cast<float>(sums.x / length), static_cast<float>(sums.y / length),
                  static_cast<float>(sums.z / length)};
  // Mean square of the distances from the mean direction, on the unit sphere.
  const double variance = 2.0 * (1.0 - length / sums.light);
  const double square_radius = std::max({sums.spread / sums.light, variance, kLeastSquareRadius});
  lobes.add(normalize(mean), static_cast<float>(square_radius), static_cast<float>(sums.light / light));
}

/// Of the parts with most light.
std::optional<DirectionLobes> lobes_of(std::span<const PhotonStatistics> of_cell) {
  double photons = 0.0, light = 0.0;
  for (const PhotonStatistics& s : of_cell) {
    photons += s.photons;
    light += s.light;
  }
  if (photons < CausticGuide::kLeastPhotons) return std::nullopt;
  std::vector<PhotonStatistics> best(std::min(of_cell.size(), DirectionLobes::kMost));
  std::ranges::partial_sort_copy(of_cell, best, std::ranges::greater{}, &PhotonStatistics::light,
                                 &PhotonStatistics::light);
  DirectionLobes lobes;
  for (const PhotonStatistics& part : best)
    if (part.light >= kLeastShare * light) add_lobe(lobes, part, light);
  return lobes.lobes().empty() ? std::nullopt : std::optional(lobes);
}

}  // namespace

CausticGuide::CausticGuide(const NestedCells& cells, std::span<const CausticPhoton> photons) : cells_(cells) {
  std::vector<PhotonStatistics> finest;
  finest.reserve(photons.size());
  for (const CausticPhoton& photon : photons)
    if (photon.cell != kNoNestedCell) finest.push_back(statistics_of(photon));
  sum_equal(finest);
  for (const PhotonStatistics& s : finest) marks_.set(mix_bits(coarsest_around(s.cell)) % kMarks);
  index_ = make_rows(std::move(finest), [this](auto of_cell) -> std::optional<uint32_t> {
    const std::optional<DirectionLobes> lobes = lobes_of(of_cell);
    if (!lobes) return std::nullopt;
    rows_.push_back(*lobes);
    return static_cast<uint32_t>(rows_.size() - 1);
  });
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
