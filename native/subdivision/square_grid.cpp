#include "subdivision/square_grid.h"

#include <algorithm>

namespace cistern {
namespace {

uint64_t key_of(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

}  // namespace

SquareGrid::SquareGrid(const Mesh& mesh) : places_(mesh.positions.size()) {
  const SubdivisionCage& cage = *mesh.cage;
  for (uint32_t polygon = 0; polygon < cage.polygon_count(); ++polygon) {
    const uint32_t size = cage.size(polygon), first = cage.offsets[polygon];
    const auto point = [&](uint32_t corner) { return cage.vertices[first + corner % size]; };
    if (size == 4) {
      for (uint32_t corner = 0; corner < 4; ++corner) places_[point(corner)] = {polygon, 0, kSquare[corner]};
      squares_.push_back({polygon, 0, {}, 1.0f, 0, {point(0), point(1), point(2), point(3)}});
      continue;
    }
    const auto centre = static_cast<uint32_t>(places_.size());
    places_.push_back({polygon, 0, kSquare[2]});
    for (uint32_t part = 0; part < size; ++part) {
      places_[point(part)] = {polygon, part, kSquare[0]};
      const uint32_t after = add_middle(point(part), point(part + 1), {polygon, part, kSquare[1]});
      const uint32_t before = add_middle(point(part + size - 1), point(part), {polygon, part, kSquare[3]});
      squares_.push_back({polygon, part, {}, 1.0f, 1, {point(part), after, centre, before}});
    }
  }
}

void SquareGrid::refine() {
  std::vector<Square> quarters;
  quarters.reserve(4 * squares_.size());
  for (const Square& square : squares_) {
    const auto& p = square.points;
    std::array<uint32_t, 4> middles;
    for (size_t i = 0; i < 4; ++i)
      middles[i] = add_middle(p[i], p[(i + 1) % 4], square.place(0.5f * (kSquare[i] + kSquare[(i + 1) % 4])));
    const auto centre = static_cast<uint32_t>(places_.size());
    places_.push_back(square.place({0.5f, 0.5f}));
    const float side = 0.5f * square.side;
    for (size_t i = 0; i < 4; ++i) {
      // Its corners in order from its own (0, 0), which is the square's for the first quarter alone.
      std::array<uint32_t, 4> points;
      points[i] = p[i];
      points[(i + 1) % 4] = middles[i];
      points[(i + 2) % 4] = centre;
      points[(i + 3) % 4] = middles[(i + 3) % 4];
      quarters.push_back(
          {square.polygon, square.part, square.low + side * kSquare[i], side, square.levels + 1, points});
    }
  }
  squares_ = std::move(quarters);
}

uint32_t SquareGrid::middle_of(uint32_t a, uint32_t b) const {
  const auto found = middles_.find(key_of(a, b));
  return found == middles_.end() ? kNowhere : found->second;
}

uint32_t SquareGrid::add_middle(uint32_t a, uint32_t b, const CagePlace& place) {
  const auto [known, is_new] = middles_.try_emplace(key_of(a, b), static_cast<uint32_t>(places_.size()));
  if (is_new) places_.push_back(place);
  return known->second;
}

}  // namespace cistern
