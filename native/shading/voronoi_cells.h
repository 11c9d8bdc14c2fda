#pragma once

#include <cmath>

#include "shading/nodes_hash.h"

// The grid behind the Voronoi texture: a point and a colour in every cell, by the hashes of nodes_hash.h.

namespace cistern::voronoi {

template <size_t N>
using Point = std::array<float, N>;
template <size_t N>
using Cell = std::array<int32_t, N>;

inline constexpr float kMaxCoordinate = 1e9f;  // cells stay within int32

template <size_t N>
Point<N> operator-(const Point<N>& a, const Point<N>& b) {
  Point<N> r;
  for (size_t i = 0; i < N; ++i) r[i] = a[i] - b[i];
  return r;
}

template <size_t N>
float dot(const Point<N>& a, const Point<N>& b) {
  float sum = 0.0f;
  for (size_t i = 0; i < N; ++i) sum += a[i] * b[i];
  return sum;
}

/// The grid cell that holds a coordinate and the place inside it.
template <size_t N>
struct Lookup {
  Cell<N> cell;
  Point<N> base, local;

  explicit Lookup(const Point<N>& p) {
    for (size_t i = 0; i < N; ++i) {
      const float x = std::abs(p[i]) < kMaxCoordinate ? p[i] : 0.0f;
      base[i] = std::floor(x);
      cell[i] = static_cast<int32_t>(base[i]);
      local[i] = x - base[i];
    }
  }
};

template <size_t N>
Cell<N> sum(const Cell<N>& a, const Cell<N>& b) {
  Cell<N> r;
  for (size_t i = 0; i < N; ++i) r[i] = a[i] + b[i];
  return r;
}

/// The point of the cell at `offset` from the looked up one, relative to that cell's corner.
template <size_t N>
Point<N> cell_point(const Lookup<N>& at, const Cell<N>& offset, float randomness) {
  Point<N> r;
  if constexpr (N == 1) {
    const float o = static_cast<float>(offset[0]);
    r[0] = o + hash_floats(at.base[0] + o) * randomness;
  } else {
    const std::array<float, N> h = hash_pcg<N>(sum(at.cell, offset));
    for (size_t i = 0; i < N; ++i) r[i] = static_cast<float>(offset[i]) + h[i] * randomness;
  }
  return r;
}

template <size_t N>
Vec3 cell_color(const Lookup<N>& at, const Cell<N>& offset) {
  if constexpr (N == 1) {
    return hash_color(at.base[0] + static_cast<float>(offset[0]));
  } else {
    const Cell<N> cell = sum(at.cell, offset);
    if constexpr (N == 2) {
      const auto h = hash_pcg<3>({cell[0], cell[1], 0});
      return {h[0], h[1], h[2]};
    } else {
      const auto h = hash_pcg<N>(cell);
      return {h[0], h[1], h[2]};
    }
  }
}

template <size_t N>
struct CellFeature {
  Point<N> place;
  Vec3 color;
};

/// cell_point and cell_color together; from three dimensions on they are the same hash.
template <size_t N>
CellFeature<N> cell_feature(const Lookup<N>& at, const Cell<N>& offset, float randomness) {
  if constexpr (N < 3) {
    return {cell_point(at, offset, randomness), cell_color(at, offset)};
  } else {
    const std::array<float, N> h = hash_pcg<N>(sum(at.cell, offset));
    CellFeature<N> feature{{}, {h[0], h[1], h[2]}};
    for (size_t i = 0; i < N; ++i) feature.place[i] = static_cast<float>(offset[i]) + h[i] * randomness;
    return feature;
  }
}

/// Calls visit(offset) for all cells within `reach`, the first axis running fastest.
template <size_t N, typename Visit>
void for_each_cell(int32_t reach, Visit visit) {
  Cell<N> offset;
  offset.fill(-reach);
  for (;;) {
    visit(offset);
    size_t axis = 0;
    while (axis < N && offset[axis] == reach) offset[axis++] = -reach;
    if (axis == N) return;
    ++offset[axis];
  }
}

}  // namespace cistern::voronoi
