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
  bool has_old_cells;  // see VoronoiSettings

  Lookup(const Point<N>& p, bool old_cells) : has_old_cells(old_cells) {
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

/// What tells points of old cells apart, and their colours.
inline Point<2> old_hash(const Point<2>& c) { return {hash_floats(c[0], c[1]), hash_floats(c[0], c[1], 1.0f)}; }
inline Point<3> old_hash(const Point<3>& c) {
  const auto [x, y, z] = c;
  return {hash_floats(x, y, z), hash_floats(x, y, z, 1.0f), hash_floats(x, y, z, 2.0f)};
}
inline Point<4> old_hash(const Point<4>& c) {
  const auto [x, y, z, w] = c;
  return {hash_floats(x, y, z, w), hash_floats(w, x, y, z), hash_floats(z, w, x, y), hash_floats(y, z, w, x)};
}
inline Vec3 old_color(const Point<2>& c) {
  return {hash_floats(c[0], c[1]), hash_floats(c[0], c[1], 1.0f), hash_floats(c[0], c[1], 2.0f)};
}
inline Vec3 old_color(const Point<3>& c) {
  const Point<3> h = old_hash(c);
  return {h[0], h[1], h[2]};
}
inline Vec3 old_color(const Point<4>& c) {
  const auto [x, y, z, w] = c;
  return {hash_floats(x, y, z, w), hash_floats(z, x, w, y), hash_floats(w, z, y, x)};
}

/// Coordinates of a cell as numbers that are hashed.
template <size_t N>
Point<N> old_cell(const Lookup<N>& at, const Cell<N>& offset) {
  Point<N> r;
  for (size_t i = 0; i < N; ++i) r[i] = at.base[i] + static_cast<float>(offset[i]);
  return r;
}

template <size_t N>
Point<N> cell_hash(const Lookup<N>& at, const Cell<N>& offset) {
  return at.has_old_cells ? old_hash(old_cell(at, offset)) : hash_pcg<N>(sum(at.cell, offset));
}

/// The point of the cell at `offset` from the looked up one, relative to that cell's corner.
template <size_t N>
Point<N> cell_point(const Lookup<N>& at, const Cell<N>& offset, float randomness) {
  Point<N> r;
  if constexpr (N == 1) {
    const float o = static_cast<float>(offset[0]);
    r[0] = o + hash_floats(at.base[0] + o) * randomness;
  } else {
    const Point<N> h = cell_hash(at, offset);
    for (size_t i = 0; i < N; ++i) r[i] = static_cast<float>(offset[i]) + h[i] * randomness;
  }
  return r;
}

template <size_t N>
Vec3 cell_color(const Lookup<N>& at, const Cell<N>& offset) {
  if constexpr (N == 1) {
    return hash_color(at.base[0] + static_cast<float>(offset[0]));
  } else {
    if (at.has_old_cells) return old_color(old_cell(at, offset));
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
    const Point<N> h = cell_hash(at, offset);
    CellFeature<N> feature{{}, {h[0], h[1], h[2]}};
    if (N == 4 && at.has_old_cells) feature.color = old_color(old_cell(at, offset));
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
