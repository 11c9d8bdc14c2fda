#include "subdivision/dicing_pattern.h"

#include <algorithm>

#include "base/parallel.h"
#include "subdivision/cut_edges.h"

namespace cistern {
namespace {

constexpr size_t kBlocks = 256, kMostSquaresAtOnce = 16;

/// Cuts one square after the other.
class SquareCutter {
 public:
  /// What it has made so far.
  struct Result {
    std::vector<CagePlace> inside;  // new points
    std::vector<LimitSurface::Point> limits;
    std::vector<CagePlace> corners;          // of each square, all of its points
    std::vector<uint32_t> points;            // beside them: numbers; of new ones kInside and their place in `inside`
    std::vector<TriangleIndices> triangles;  // into `corners`
    std::vector<uint32_t> polygons;          // by triangle
  };
  static constexpr uint32_t kInside = 1u << 31;

  SquareCutter(const SquareGrid& grid, const LimitSurface& surface, const CutEdges& cuts, const LongestEdge& longest,
               int most_levels, TriangleBudget& budget)
      : grid_(grid), cuts_(cuts), longest_(longest), most_levels_(most_levels), budget_(budget), patch_(surface) {}

  /// Not to the end where there are too many triangles.
  void cut(size_t number) {
    square_ = &grid_.squares()[number];
    first_ = static_cast<uint32_t>(result_.corners.size());
    first_triangle_ = result_.triangles.size();
    vertices_.clear();
    edges_.clear();
    pieces_.clear();
    begin(number);
    size_t counted = 2;  // all squares have begun with as many
    while (!pieces_.empty()) {
      next_.clear();
      for (const Piece& piece : pieces_) cut(piece);
      std::swap(pieces_, next_);
      const size_t triangles = result_.triangles.size() - first_triangle_ + pieces_.size();
      if (!budget_.take(triangles - counted)) return;
      counted = triangles;
    }
  }
  Result& result() { return result_; }

 private:
  struct Vertex {
    Vec3 position;
    Vec2 inside;  // the square
  };
  /// Between two vertices. Its halves run from `from` and to `to`.
  struct Edge {
    uint32_t from, to;
    uint32_t side = kNowhere;  // of the grid, that it lies on from t_from to t_to; or inside of the square
    float t_from = 0.0f, t_to = 1.0f;
    int levels = 0;  // how often it may be halved, inside
    bool is_looked_at = false;
    uint32_t half = kNowhere, first = kNowhere, second = kNowhere;
  };
  /// A triangle that may be cut further. Edge i leaves vertex i.
  struct Piece {
    std::array<uint32_t, 3> v, e;
    int levels;
  };

  uint32_t add_vertex(Vec2 inside, Vec3 position, uint32_t point) {
    result_.corners.push_back(square_->place(inside));
    result_.points.push_back(point);
    vertices_.push_back({position, inside});
    return static_cast<uint32_t>(vertices_.size() - 1);
  }
  uint32_t add_inside(Vec2 inside) {
    result_.inside.push_back(square_->place(inside));
    result_.limits.push_back(patch_.at(result_.inside.back()));
    return add_vertex(inside, result_.limits.back().position,
                      kInside | static_cast<uint32_t>(result_.inside.size() - 1));
  }
  uint32_t add_edge(const Edge& edge) {
    edges_.push_back(edge);
    return static_cast<uint32_t>(edges_.size() - 1);
  }
  uint32_t add_inner_edge(uint32_t from, uint32_t to, int levels) {
    Edge edge{from, to};
    edge.levels = levels;
    return add_edge(edge);
  }

  void begin(size_t number) {
    for (size_t i = 0; i < 4; ++i)
      add_vertex(kSquare[i], cuts_.grid_points()[square_->points[i]].position, square_->points[i]);
    std::array<uint32_t, 4> sides;
    for (uint32_t i = 0; i < 4; ++i) {
      const uint32_t side = cuts_.edge_at(number, i);
      const bool is_along = cuts_.low(side) == square_->points[i];
      sides[i] = add_edge({i, (i + 1) % 4, side, is_along ? 0.0f : 1.0f, is_along ? 1.0f : 0.0f});
    }
    const int levels = std::max(most_levels_ - square_->levels, 0);
    const uint32_t diagonal = add_inner_edge(0, 2, levels);
    pieces_.push_back({{0, 1, 2}, {sides[0], sides[1], diagonal}, levels});
    pieces_.push_back({{0, 2, 3}, {diagonal, sides[2], sides[3]}, levels});
  }

  /// The vertex that halves an edge, or kNowhere.
  uint32_t half_of(uint32_t number) {
    Edge edge = edges_[number];
    if (edge.is_looked_at) return edge.half;
    edge.is_looked_at = true;
    const Vertex &from = vertices_[edge.from], &to = vertices_[edge.to];
    const Vec2 middle = 0.5f * (from.inside + to.inside);
    if (edge.side != kNowhere) {
      const float t = 0.5f * (edge.t_from + edge.t_to);
      const CutEdges::Found found = cuts_.find(edge.side, t);
      if (found.number != kNowhere) {
        edge.half = add_vertex(middle, found.at.position, found.number);
        edge.first = add_edge({edge.from, edge.half, edge.side, edge.t_from, t});
        edge.second = add_edge({edge.half, edge.to, edge.side, t, edge.t_to});
      }
    } else if (edge.levels > 0 && longest_.is_exceeded(from.position, to.position)) {
      edge.half = add_inside(middle);
      edge.first = add_inner_edge(edge.from, edge.half, edge.levels - 1);
      edge.second = add_inner_edge(edge.half, edge.to, edge.levels - 1);
    }
    edges_[number] = edge;
    return edge.half;
  }

  /// The part of a halved edge of a piece that its vertex `corner` has.
  uint32_t part_at(uint32_t edge, uint32_t corner) const {
    return edges_[edge].from == corner ? edges_[edge].first : edges_[edge].second;
  }

  void cut(const Piece& piece) {
    std::array<uint32_t, 3> h;
    for (size_t i = 0; i < 3; ++i) h[i] = half_of(piece.e[i]);
    const auto count = std::ranges::count_if(h, [](uint32_t v) { return v != kNowhere; });
    if (count == 0) return finish(piece);
    // Turned until the first edges are those that are halved.
    size_t turn = 0;
    while (h[turn] == kNowhere || (count == 2 && h[(turn + 1) % 3] == kNowhere)) ++turn;
    std::array<uint32_t, 3> v, e, m;
    for (size_t i = 0; i < 3; ++i) {
      const size_t from = (i + turn) % 3;
      v[i] = piece.v[from], e[i] = piece.e[from], m[i] = h[from];
    }
    const int levels = std::max(piece.levels - 1, 0);
    const auto emit = [&](const std::array<uint32_t, 3>& vertices, const std::array<uint32_t, 3>& edges) {
      next_.push_back({vertices, edges, levels});
    };
    const auto inner = [&](uint32_t from, uint32_t to) { return add_inner_edge(from, to, levels); };
    const uint32_t before_0 = part_at(e[0], v[0]), after_0 = part_at(e[0], v[1]);
    if (count == 1) {
      const uint32_t across = inner(m[0], v[2]);
      emit({v[0], m[0], v[2]}, {before_0, across, e[2]});
      emit({m[0], v[1], v[2]}, {after_0, e[1], across});
      return;
    }
    const uint32_t before_1 = part_at(e[1], v[1]), after_1 = part_at(e[1], v[2]), corner_1 = inner(m[0], m[1]);
    emit({m[0], v[1], m[1]}, {after_0, before_1, corner_1});
    if (count == 2) {
      const auto distance = [&](uint32_t a, uint32_t b) {
        return length_squared(vertices_[a].position - vertices_[b].position);
      };
      if (distance(v[0], m[1]) < distance(v[2], m[0])) {
        const uint32_t across = inner(v[0], m[1]);
        emit({v[0], m[0], m[1]}, {before_0, corner_1, across});
        emit({v[0], m[1], v[2]}, {across, after_1, e[2]});
      } else {
        const uint32_t across = inner(m[0], v[2]);
        emit({v[0], m[0], v[2]}, {before_0, across, e[2]});
        emit({m[0], m[1], v[2]}, {corner_1, after_1, across});
      }
      return;
    }
    const uint32_t before_2 = part_at(e[2], v[2]), after_2 = part_at(e[2], v[0]);
    const uint32_t corner_2 = inner(m[1], m[2]), corner_0 = inner(m[2], m[0]);
    emit({v[0], m[0], m[2]}, {before_0, corner_0, after_2});
    emit({m[2], m[1], v[2]}, {corner_2, after_1, before_2});
    emit({m[0], m[1], m[2]}, {corner_1, corner_2, corner_0});
  }

  void finish(const Piece& piece) {
    result_.triangles.push_back({first_ + piece.v[0], first_ + piece.v[1], first_ + piece.v[2]});
    result_.polygons.push_back(square_->polygon);
  }

  const SquareGrid& grid_;
  const CutEdges& cuts_;
  const LongestEdge& longest_;
  int most_levels_;
  TriangleBudget& budget_;
  LimitSurface::Patch patch_;
  Result result_;
  const SquareGrid::Square* square_ = nullptr;
  uint32_t first_ = 0;         // of the square's points among the corners
  size_t first_triangle_ = 0;  // the same of its triangles
  std::vector<Vertex> vertices_;
  std::vector<Edge> edges_;
  std::vector<Piece> pieces_, next_;
};

/// Appends what a block of squares became.
void append(DicingPattern& pattern, const SquareCutter::Result& part) {
  const auto inside = static_cast<uint32_t>(pattern.points.size());
  const auto corners = static_cast<uint32_t>(pattern.corners.size());
  const auto point = [&](uint32_t corner) {
    const uint32_t number = part.points[corner];
    return (number & SquareCutter::kInside) == 0 ? number : inside + (number & ~SquareCutter::kInside);
  };
  pattern.points.insert(pattern.points.end(), part.inside.begin(), part.inside.end());
  pattern.limits.insert(pattern.limits.end(), part.limits.begin(), part.limits.end());
  pattern.corners.insert(pattern.corners.end(), part.corners.begin(), part.corners.end());
  pattern.polygons.insert(pattern.polygons.end(), part.polygons.begin(), part.polygons.end());
  for (const TriangleIndices& t : part.triangles) {
    pattern.point_triangles.push_back({point(t[0]), point(t[1]), point(t[2])});
    pattern.corner_triangles.push_back({corners + t[0], corners + t[1], corners + t[2]});
  }
}

}  // namespace

DicingPattern cut_polygons(const Mesh& mesh, const LimitSurface& surface, const LongestEdge& longest, int most_levels,
                           size_t most_triangles, const std::function<bool()>& is_stopped) {
  DicingPattern pattern;
  SquareGrid grid(mesh);
  TriangleBudget budget_of_cuts(most_triangles, is_stopped), budget(most_triangles, is_stopped);
  const CutEdges cuts(grid, surface, longest, most_levels, budget_of_cuts);
  const size_t squares = grid.squares().size(), at_once = std::clamp<size_t>(squares / kBlocks, 1, kMostSquaresAtOnce);
  std::vector<SquareCutter::Result> parts(block_count(squares, at_once));
  pattern.is_too_fine = budget_of_cuts.is_exceeded() || !budget.take(2 * squares);
  if (pattern.is_too_fine || budget.is_stopped()) return pattern;
  parallel_blocks(squares, at_once, [&](size_t block, size_t begin, size_t end) {
    SquareCutter cutter(grid, surface, cuts, longest, most_levels, budget);
    for (size_t i = begin; i < end && !budget.is_exceeded() && !budget.is_stopped(); ++i) cutter.cut(i);
    parts[block] = std::move(cutter.result());
  });
  pattern.is_too_fine = budget.is_exceeded();
  if (pattern.is_too_fine || budget.is_stopped()) return pattern;
  cuts.for_each_point([&](const CagePlace& place, const LimitSurface::Point& limit) {
    pattern.points.push_back(place);
    pattern.limits.push_back(limit);
  });
  for (SquareCutter::Result& part : parts) {
    append(pattern, part);
    part = {};
  }
  return pattern;
}

}  // namespace cistern
