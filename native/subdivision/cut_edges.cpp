#include "subdivision/cut_edges.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "base/parallel.h"

namespace cistern {
namespace {

constexpr size_t kEdgesAtOnce = 64;
constexpr size_t kEnoughSquares = 4096;  // to keep threads busy

}  // namespace

CutEdges::CutEdges(SquareGrid& grid, const LimitSurface& surface, const LongestEdge& longest, int most_levels,
                   TriangleBudget& budget)
    : grid_(grid), budget_(budget) {
  while (true) {
    find_edges(most_levels);
    grid_points_ = surface.points(grid.places());
    if (grid.squares().size() >= kEnoughSquares || !are_all_exceeded(longest)) break;
    grid.refine();
  }
  cuts_.resize(edges_.size());
  std::vector<uint32_t> by_square(edges_.size());  // patches are costly to go to
  std::iota(by_square.begin(), by_square.end(), 0u);
  std::ranges::sort(by_square, {}, [&](uint32_t i) { return std::pair(edges_[i].square, i); });
  parallel_blocks(edges_.size(), kEdgesAtOnce, [&](size_t, size_t begin, size_t end) {
    LimitSurface::Patch patch(surface);
    for (size_t i = begin; i < end; ++i) {
      const Edge& edge = edges_[by_square[i]];
      if (budget_.is_stopped()) return;
      if (edge.middle != kNowhere) continue;
      halve(edge, patch, longest, {0.0f, grid_points_[edge.low]}, {1.0f, grid_points_[edge.high]}, edge.levels,
            cuts_[by_square[i]]);
    }
  });
  first_cut_.resize(edges_.size() + 1);
  first_cut_[0] = static_cast<uint32_t>(grid_points_.size());
  for (size_t i = 0; i < edges_.size(); ++i) first_cut_[i + 1] = first_cut_[i] + static_cast<uint32_t>(cuts_[i].size());
}

void CutEdges::find_edges(int most_levels) {
  struct Side {
    uint32_t low, high, square, side;
  };
  std::vector<Side> sides;
  sides.reserve(4 * grid_.squares().size());
  for (uint32_t square = 0; square < grid_.squares().size(); ++square)
    for (uint32_t side = 0; side < 4; ++side) {
      const auto& points = grid_.squares()[square].points;
      const auto [low, high] = std::minmax(points[side], points[(side + 1) % 4]);
      sides.push_back({low, high, square, side});
    }
  std::ranges::sort(sides, [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.square, a.side) < std::tie(b.low, b.high, b.square, b.side);
  });
  edges_.clear();
  edge_at_.assign(sides.size(), kNowhere);
  for (const auto& [low, high, square, side] : sides) {
    const int levels = std::max(most_levels - grid_.squares()[square].levels, 0);
    if (edges_.empty() || edges_.back().low != low || edges_.back().high != high)
      edges_.push_back({low, high, square, side, levels});
    edges_.back().levels = std::min(edges_.back().levels, levels);
    edge_at_[4 * size_t{square} + side] = static_cast<uint32_t>(edges_.size() - 1);
  }
  const auto number_of = [&](uint32_t a, uint32_t b) {
    const auto ends = std::minmax(a, b);
    const auto found = std::ranges::lower_bound(edges_, std::pair<uint32_t, uint32_t>(ends), {},
                                                [](const Edge& edge) { return std::pair(edge.low, edge.high); });
    return static_cast<uint32_t>(found - edges_.begin());
  };
  for (Edge& edge : edges_) {
    edge.middle = grid_.middle_of(edge.low, edge.high);
    if (edge.middle == kNowhere) continue;
    edge.first = number_of(edge.low, edge.middle);
    edge.second = number_of(edge.middle, edge.high);
  }
}

bool CutEdges::are_all_exceeded(const LongestEdge& longest) const {
  return std::ranges::all_of(edges_, [&](const Edge& edge) {
    return edge.levels > 0 && longest.is_exceeded(grid_points_[edge.low].position, grid_points_[edge.high].position);
  });
}

CagePlace CutEdges::place(const Edge& edge, float t) const {
  const SquareGrid::Square& square = grid_.squares()[edge.square];
  const float along = square.points[edge.side] == edge.low ? t : 1.0f - t;
  return square.place((1.0f - along) * kSquare[edge.side] + along * kSquare[(edge.side + 1) % 4]);
}

void CutEdges::halve(const Edge& edge, LimitSurface::Patch& patch, const LongestEdge& longest, const Cut& from,
                     const Cut& to, int levels, std::vector<Cut>& cuts) {
  if (levels == 0 || budget_.is_exceeded() || !longest.is_exceeded(from.at.position, to.at.position)) return;
  const float t = 0.5f * (from.t + to.t);
  const Cut half{t, patch.at(place(edge, t))};
  halve(edge, patch, longest, from, half, levels - 1, cuts);
  cuts.push_back(half);
  budget_.take(1);  // a triangle beside it at least
  halve(edge, patch, longest, half, to, levels - 1, cuts);
}

CutEdges::Found CutEdges::find(uint32_t number, float t) const {
  const Edge& edge = edges_[number];
  if (edge.middle != kNowhere) {
    if (t == 0.5f) return {edge.middle, grid_points_[edge.middle]};
    const bool is_first = t < 0.5f;
    const uint32_t half = is_first ? edge.first : edge.second;
    const float along = is_first ? 2.0f * t : 2.0f * t - 1.0f;
    return find(half, edges_[half].low == (is_first ? edge.low : edge.middle) ? along : 1.0f - along);
  }
  const std::vector<Cut>& cuts = cuts_[number];
  const auto found = std::ranges::lower_bound(cuts, t, {}, &Cut::t);
  if (found == cuts.end() || found->t != t) return {};
  return {first_cut_[number] + static_cast<uint32_t>(found - cuts.begin()), found->at};
}

}  // namespace cistern
