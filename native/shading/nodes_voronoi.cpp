#include "shading/nodes_voronoi.h"

#include <cfloat>

#include "shading/nodes_hash.h"
#include "shading/nodes_math.h"

// Cellular texture after [Worley 1996, A Cellular Texture Basis Function]: one point per cell of the integer grid.

namespace cistern {
namespace {

template <size_t N>
using Point = std::array<float, N>;
template <size_t N>
using Cell = std::array<int32_t, N>;

constexpr float kMaxCoordinate = 1e9f;        // cells stay within int32
constexpr float kSamePointDistance2 = 1e-4f;  // closer cell points share no edge worth measuring

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

/// A monotone function of the distance, cheaper than the distance.
template <size_t N>
float distance_key(const Point<N>& a, const Point<N>& b, const VoronoiSettings& s) {
  const Point<N> d = a - b;
  float key = 0.0f;
  if (N == 1) return std::abs(d[0]);  // every metric is the same on a line
  switch (s.metric) {
    case VoronoiMetric::EUCLIDEAN:
      return dot(d, d);
    case VoronoiMetric::MANHATTAN:
      for (float x : d) key += std::abs(x);
      return key;
    case VoronoiMetric::CHEBYCHEV:
      for (float x : d) key = std::max(key, std::abs(x));
      return key;
    default:
      for (float x : d) key += std::pow(std::abs(x), s.exponent);
      return key;
  }
}

template <size_t N>
float distance_of_key(float key, const VoronoiSettings& s) {
  if (N == 1) return key;
  if (s.metric == VoronoiMetric::EUCLIDEAN) return std::sqrt(key);
  return s.metric == VoronoiMetric::MINKOWSKI ? std::pow(key, 1.0f / s.exponent) : key;
}

template <size_t N>
VoronoiResult make_result(const Lookup<N>& at, float distance, Vec3 color, const Point<N>& relative) {
  Point<N> p;
  for (size_t i = 0; i < N; ++i) p[i] = at.base[i] + relative[i];
  VoronoiResult r{distance, color, {}, 0.0f};
  if constexpr (N == 1) r.w = p[0];
  if constexpr (N == 2) r.position = {p[0], p[1], 0.0f};
  if constexpr (N >= 3) r.position = {p[0], p[1], p[2]};
  if constexpr (N == 4) r.w = p[3];
  return r;
}

/// Distance key below which no point of the cell at `offset` can lie: that of the nearest place a point can be at.
template <size_t N>
float least_key(const Lookup<N>& at, const Cell<N>& offset, const VoronoiSettings& s) {
  Point<N> nearest;
  for (size_t i = 0; i < N; ++i) {
    const float corner = static_cast<float>(offset[i]);
    nearest[i] = std::clamp(at.local[i], corner, corner + s.randomness);
  }
  return distance_key(nearest, at.local, s);
}

/// Nearest (rank 0) or second nearest (rank 1) point. The own cell first: it rules out most of the others.
template <size_t N>
VoronoiResult ranked(const Lookup<N>& at, const VoronoiSettings& s, int rank) {
  std::array<float, 2> key{FLT_MAX, FLT_MAX};
  std::array<Cell<N>, 2> cell{};
  std::array<Point<N>, 2> place{};
  const size_t r = static_cast<size_t>(rank);
  const auto consider = [&](const Cell<N>& offset) {
    const Point<N> p = cell_point(at, offset, s.randomness);
    const float k = distance_key(p, at.local, s);
    if (k < key[0]) {
      key[1] = key[0], cell[1] = cell[0], place[1] = place[0];
      key[0] = k, cell[0] = offset, place[0] = p;
    } else if (k < key[1]) {
      key[1] = k, cell[1] = offset, place[1] = p;
    }
  };
  consider(Cell<N>{});
  for_each_cell<N>(1, [&](const Cell<N>& offset) {
    if (offset != Cell<N>{} && least_key(at, offset, s) < key[r]) consider(offset);
  });
  return make_result(at, distance_of_key<N>(key[r], s), cell_color(at, cell[r]), place[r]);
}

/// Points blended by a polynomial smooth minimum, in the order of the cells.
template <size_t N>
VoronoiResult smooth_nearest(const Lookup<N>& at, const VoronoiSettings& s, float smoothness) {
  float distance = 0.0f;
  Vec3 color;
  Point<N> place{};
  bool is_first = true;
  for_each_cell<N>(2, [&](const Cell<N>& offset) {
    // A point further than the blend by more than the smoothness leaves it as it is.
    const float reach = distance + smoothness;
    if (!is_first && distance_of_key<N>(least_key(at, offset, s), s) >= reach) return;
    const auto [p, cell_colors] = cell_feature(at, offset, s.randomness);
    const float d = distance_of_key<N>(distance_key(p, at.local, s), s);
    if (!is_first && d >= reach) return;
    const float h = is_first ? 1.0f : smoothstep01(0.5f + 0.5f * (distance - d) / smoothness);
    is_first = false;
    const float correction = smoothness * h * (1.0f - h);
    distance = lerp(distance, d, h) - correction;
    const float weak = correction / (1.0f + 3.0f * smoothness);
    color = lerp(color, cell_colors, h) - Vec3{weak, weak, weak};
    for (size_t i = 0; i < N; ++i) place[i] = lerp(place[i], p[i], h) - weak;
  });
  return make_result(at, distance, color, place);
}

float distance_to_edge(const Lookup<1>& at, float randomness) {
  const float middle = cell_point<1>(at, {0}, randomness)[0];
  const float left = cell_point<1>(at, {-1}, randomness)[0];
  const float right = cell_point<1>(at, {1}, randomness)[0];
  return std::min(std::abs(0.5f * (middle + left) - at.local[0]), std::abs(0.5f * (middle + right) - at.local[0]));
}

/// Distance to the nearest bisector of the nearest point and its neighbours. [Quilez 2012, Voronoi edges]
template <size_t N>
float distance_to_edge(const Lookup<N>& at, float randomness) {
  Point<N> closest{};
  float least = FLT_MAX;
  for_each_cell<N>(1, [&](const Cell<N>& offset) {
    const Point<N> to_point = cell_point(at, offset, randomness) - at.local;
    const float d2 = dot(to_point, to_point);
    if (d2 < least) least = d2, closest = to_point;
  });
  float distance = FLT_MAX;
  for_each_cell<N>(1, [&](const Cell<N>& offset) {
    const Point<N> to_point = cell_point(at, offset, randomness) - at.local;
    const Point<N> across = to_point - closest;
    const float l2 = dot(across, across);
    if (l2 <= kSamePointDistance2) return;
    distance = std::min(distance, 0.5f * (dot(closest, across) + dot(to_point, across)) / std::sqrt(l2));
  });
  return distance;
}

/// Half the distance from the nearest point to its own nearest neighbour.
template <size_t N>
float sphere_radius(const Lookup<N>& at, float randomness) {
  Point<N> closest{};
  Cell<N> closest_cell{};
  float least = FLT_MAX;
  for_each_cell<N>(1, [&](const Cell<N>& offset) {
    const Point<N> p = cell_point(at, offset, randomness);
    const Point<N> d = p - at.local;
    if (dot(d, d) < least) least = dot(d, d), closest = p, closest_cell = offset;
  });
  least = FLT_MAX;
  for_each_cell<N>(1, [&](const Cell<N>& offset) {
    if (offset == Cell<N>{}) return;
    const Point<N> d = cell_point(at, sum(offset, closest_cell), randomness) - closest;
    least = std::min(least, dot(d, d));
  });
  return 0.5f * std::sqrt(least);
}

template <size_t N>
VoronoiResult voronoi(const Point<N>& p, const VoronoiSettings& s) {
  const Lookup<N> at(p);
  const float smoothness = 0.5f * clamp01(s.smoothness);
  switch (s.feature) {
    case VoronoiFeature::F2:
      return ranked(at, s, 1);
    case VoronoiFeature::DISTANCE_TO_EDGE:
      return {distance_to_edge(at, s.randomness), {}, {}, 0.0f};
    case VoronoiFeature::N_SPHERE_RADIUS:
      return {sphere_radius(at, s.randomness), {}, {}, 0.0f};
    case VoronoiFeature::SMOOTH_F1:
      if (smoothness != 0.0f) return smooth_nearest(at, s, smoothness);
      [[fallthrough]];
    default:
      return ranked(at, s, 0);
  }
}

}  // namespace

VoronoiResult voronoi_node(Vec3 p, float w, int dimensions, const VoronoiSettings& settings) {
  VoronoiSettings s = settings;
  s.randomness = clamp01(s.randomness);
  switch (dimensions) {
    case 1:
      return voronoi<1>({w}, s);
    case 2:
      return voronoi<2>({p.x, p.y}, s);
    case 3:
      return voronoi<3>({p.x, p.y, p.z}, s);
    default:
      return voronoi<4>({p.x, p.y, p.z, w}, s);
  }
}

}  // namespace cistern
