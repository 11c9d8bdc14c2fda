#pragma once

#include <unordered_map>

#include "subdivision/limit_surface.h"

namespace cistern {

inline constexpr uint32_t kNowhere = 0xffffffffu;

/// Corners of a square, and of the parts of polygons as CagePlace has them.
inline constexpr std::array<Vec2, 4> kSquare{Vec2{0.0f, 0.0f}, Vec2{1.0f, 0.0f}, Vec2{1.0f, 1.0f}, Vec2{0.0f, 1.0f}};

/// Squares that cover a cage: its quads and the parts of its other polygons, or quarters of quarters of these. Points
/// are those of the cage, then others.
class SquareGrid {
 public:
  struct Square {
    uint32_t polygon, part;
    Vec2 low;    // its corner (0, 0) in the part
    float side;  // there
    int levels;  // how often it has been halved
    std::array<uint32_t, 4> points;

    CagePlace place(Vec2 inside) const { return {polygon, part, low + side * inside}; }
  };

  explicit SquareGrid(const Mesh& mesh);

  /// Quarters all squares.
  void refine();

  const std::vector<Square>& squares() const { return squares_; }
  /// Of points, each on one of the squares there; a point of no polygon is anywhere.
  const std::vector<CagePlace>& places() const { return places_; }
  /// The point between two others, if a square has it, or kNowhere.
  uint32_t middle_of(uint32_t a, uint32_t b) const;

 private:
  uint32_t add_middle(uint32_t a, uint32_t b, const CagePlace& place);

  std::vector<Square> squares_;
  std::vector<CagePlace> places_;
  std::unordered_map<uint64_t, uint32_t> middles_;
};

}  // namespace cistern
