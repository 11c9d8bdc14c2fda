#pragma once

#include "subdivision/longest_edge.h"
#include "subdivision/square_grid.h"
#include "subdivision/triangle_budget.h"

namespace cistern {

/// The sides of a grid's squares, and the points that halve them where they are too long. Each runs from its lower to
/// its higher point. One that has two shorter ones beside it is cut as these are.
class CutEdges {
 public:
  struct Cut {
    float t;
    LimitSurface::Point at;
  };

  /// `grid` is refined for as long as all sides would be halved anyway, and there are few squares. Incomplete where
  /// the budget ends, of which each cut takes one triangle.
  CutEdges(SquareGrid& grid, const LimitSurface& surface, const LongestEdge& longest, int most_levels,
           TriangleBudget& budget);

  /// Of a side of a square.
  uint32_t edge_at(size_t square, size_t side) const { return edge_at_[4 * square + side]; }
  uint32_t low(uint32_t edge) const { return edges_[edge].low; }
  const std::vector<LimitSurface::Point>& grid_points() const { return grid_points_; }

  struct Found {
    uint32_t number = kNowhere;  // among the points of the grid and all cuts after them; kNowhere: there is none
    LimitSurface::Point at;
  };
  Found find(uint32_t edge, float t) const;

  uint32_t point_count() const { return first_cut_.back(); }
  /// Calls body(place, point) for all points in their order.
  template <class Body>
  void for_each_point(const Body& body) const {
    for (size_t i = 0; i < grid_points_.size(); ++i) body(grid_.places()[i], grid_points_[i]);
    for (size_t i = 0; i < edges_.size(); ++i)
      for (const Cut& cut : cuts_[i]) body(place(edges_[i], cut.t), cut.at);
  }

 private:
  struct Edge {
    uint32_t low, high, square, side;  // of one of its squares
    int levels;                        // how often it may be halved
    uint32_t middle = kNowhere;        // of the two shorter ones:
    uint32_t first = kNowhere, second = kNowhere;
  };

  void find_edges(int most_levels);
  bool are_all_exceeded(const LongestEdge& longest) const;
  CagePlace place(const Edge& edge, float t) const;
  void halve(const Edge& edge, LimitSurface::Patch& patch, const LongestEdge& longest, const Cut& from, const Cut& to,
             int levels, std::vector<Cut>& cuts);

  const SquareGrid& grid_;
  TriangleBudget& budget_;
  std::vector<Edge> edges_;
  std::vector<uint32_t> edge_at_;
  std::vector<LimitSurface::Point> grid_points_;
  std::vector<std::vector<Cut>> cuts_;  // by edge
  std::vector<uint32_t> first_cut_;     // by edge, and the end
};

}  // namespace cistern
