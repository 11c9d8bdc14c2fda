#include "shading/nodes_voronoi.h"

#include <cfloat>

#include "shading/nodes_math.h"
#include "shading/voronoi_cells.h"

// Cellular texture after [Worley 1996, A Cellular Texture Basis Function]: one point per cell of the integer grid.

namespace cistern {
namespace {

using namespace voronoi;

constexpr float kSamePointDistance2 = 1e-4f;  // closer cell points share no edge worth measuring
constexpr float kMaxDetail = 15.0f;
constexpr float kFarEdge = 8.0f;  // further than any

/// What an axis adds to the key of a distance, from the difference along it.
float key_part(float difference, const VoronoiSettings& s) {
  if (s.metric == VoronoiMetric::EUCLIDEAN) return difference * difference;
  const float x = std::abs(difference);
  return s.metric == VoronoiMetric::MINKOWSKI ? std::pow(x, s.exponent) : x;
}

/// The key from the parts of all axes.
template <size_t N>
float combine(const Point<N>& parts, const VoronoiSettings& s) {
  float key = 0.0f;
  for (const float part : parts) key = s.metric == VoronoiMetric::CHEBYCHEV ? std::max(key, part) : key + part;
  return key;
}

/// A monotone function of the distance, cheaper than the distance.
template <size_t N>
float distance_key(const Point<N>& a, const Point<N>& b, const VoronoiSettings& s) {
  Point<N> d = a - b;
  if (N == 1) return std::abs(d[0]);  // every metric is the same on a line
  for (float& x : d) x = key_part(x, s);
  return combine(d, s);
}

template <size_t N>
float distance_of_key(float key, const VoronoiSettings& s) {
  if (N == 1) return key;
  if (s.metric == VoronoiMetric::EUCLIDEAN) return std::sqrt(key);
  return s.metric == VoronoiMetric::MINKOWSKI ? std::pow(key, 1.0f / s.exponent) : key;
}

/// Below 0 for what is below 0.
template <size_t N>
float key_of_distance(float distance, const VoronoiSettings& s) {
  if (N == 1 || !(distance > 0.0f)) return distance;
  if (s.metric == VoronoiMetric::EUCLIDEAN) return distance * distance;
  return s.metric == VoronoiMetric::MINKOWSKI ? std::pow(distance, s.exponent) : distance;
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

/// Visits the cells of a block that may have points near the looked up place, the first axis running fastest.
template <size_t N, int32_t kReach>
class NearCells {
 public:
  NearCells(const Lookup<N>& at, const VoronoiSettings& s) : settings_(s) {
    for (size_t axis = 0; axis < N; ++axis) {
      for (int32_t i = -kReach; i <= kReach; ++i) {
        const float corner = static_cast<float>(i);
        const float gap = std::clamp(at.local[axis], corner, corner + s.randomness) - at.local[axis];
        least_[axis][place_of(i)] = N == 1 ? std::abs(gap) : key_part(gap, s);
      }
    }
  }

  /// Calls visit(offset), which may lower `most_key`: cells all of whose points are further than that are left out.
  template <typename Visit>
  void visit(const float& most_key, Visit visit) const {
    Cell<N> offset;
    descend<N - 1>(offset, 0.0f, most_key, visit);
  }

 private:
  static size_t place_of(int32_t i) {
    const int32_t place = i + kReach;
    return static_cast<size_t>(place);
  }
  static constexpr float kRounding = 1.0f - 1e-5f;  // keys of points add up in another order

  template <size_t kAxis, typename Visit>
  void descend(Cell<N>& offset, float key, const float& most_key, Visit& visit) const {
    for (int32_t i = -kReach; i <= kReach; ++i) {
      const float part = least_[kAxis][place_of(i)];
      const float least = settings_.metric == VoronoiMetric::CHEBYCHEV ? std::max(key, part) : key + part;
      if (least * kRounding > most_key) continue;
      offset[kAxis] = i;
      if constexpr (kAxis == 0)
        visit(offset);
      else
        descend<kAxis - 1>(offset, least, most_key, visit);
    }
  }

  const VoronoiSettings& settings_;
  std::array<std::array<float, 2 * kReach + 1>, N>
      least_;  // by axis and offset, of the nearest place a point can be at
};

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
  NearCells<N, 1>(at, s).visit(key[r], [&](const Cell<N>& offset) {
    if (offset != Cell<N>{}) consider(offset);
  });
  return make_result(at, distance_of_key<N>(key[r], s), cell_color(at, cell[r]), place[r]);
}

/// Points blended by a polynomial smooth minimum, in the order of the cells.
template <size_t N>
VoronoiResult smooth_nearest(const Lookup<N>& at, const VoronoiSettings& s, float smoothness) {
  float distance = 0.0f, most_key = INFINITY;
  Vec3 color;
  Point<N> place{};
  bool is_first = true;
  NearCells<N, 2>(at, s).visit(most_key, [&](const Cell<N>& offset) {
    const auto [p, cell_colors] = cell_feature(at, offset, s.randomness);
    const float d = distance_of_key<N>(distance_key(p, at.local, s), s);
    // A point further than the blend by more than the smoothness leaves it as it is.
    if (!is_first && d >= distance + smoothness) return;
    const float h = is_first ? 1.0f : smoothstep01(0.5f + 0.5f * (distance - d) / smoothness);
    is_first = false;
    const float correction = smoothness * h * (1.0f - h);
    distance = lerp(distance, d, h) - correction;
    most_key = key_of_distance<N>(distance + smoothness, s);
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
VoronoiResult octave(const Point<N>& p, const VoronoiSettings& s) {
  const Lookup<N> at(p, s.old_cells);
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

/// From a cell's middle to the farthest place that its point can have, twice that for the second nearest point.
template <size_t N>
float largest_distance(const VoronoiSettings& s) {
  const float reach = 0.5f + 0.5f * s.randomness;
  if (s.feature == VoronoiFeature::DISTANCE_TO_EDGE) return reach;
  Point<N> corner;
  corner.fill(reach);
  return (s.feature == VoronoiFeature::F2 ? 2.0f : 1.0f) * distance_of_key<N>(distance_key(corner, Point<N>{}, s), s);
}

/// Calls add(octave, frequency, amplitude) for each octave; the last one's amplitude is less where it is blended in.
template <size_t N, typename Add>
void for_each_octave(Point<N> p, const VoronoiSettings& s, Add add) {
  float amplitude = 1.0f, frequency = 1.0f;
  const int octaves = static_cast<int>(std::ceil(s.detail));
  for (int i = 0; i <= octaves; ++i) {
    Point<N> at = p;
    for (float& x : at) x *= frequency;
    add(octave(at, s), frequency, amplitude * std::min(1.0f, 1.0f + s.detail - static_cast<float>(i)));
    amplitude *= s.roughness;
    frequency *= s.lacunarity;
  }
}

/// The edges of all octaves together.
template <size_t N>
VoronoiResult fractal_edges(const Point<N>& p, const VoronoiSettings& s) {
  const float largest = largest_distance<N>(s);
  float distance = kFarEdge, most = largest;
  for_each_octave(p, s, [&](const VoronoiResult& r, float frequency, float amplitude) {
    distance = lerp(distance, std::min(distance, r.distance / frequency), amplitude);
    most = lerp(most, largest / frequency, amplitude);
  });
  return {s.normalize ? distance / most : distance, {}, {}, 0.0f};
}

/// Distances and colours of octaves add up, places are blended.
template <size_t N>
VoronoiResult fractal_points(const Point<N>& p, const VoronoiSettings& s) {
  VoronoiResult sum;
  float amplitudes = 0.0f;
  for_each_octave(p, s, [&](const VoronoiResult& r, float frequency, float amplitude) {
    amplitudes += amplitude;
    sum.distance += amplitude * r.distance;
    sum.color += amplitude * r.color;
    sum.position = lerp(sum.position, r.position / frequency, amplitude);
    sum.w = lerp(sum.w, r.w / frequency, amplitude);
  });
  if (!s.normalize) return sum;
  sum.distance /= amplitudes * largest_distance<N>(s);
  sum.color = sum.color / amplitudes;
  return sum;
}

template <size_t N>
VoronoiResult evaluate(const Point<N>& p, const VoronoiSettings& s) {
  if (s.feature == VoronoiFeature::N_SPHERE_RADIUS) return octave(p, s);
  if (s.detail == 0.0f || s.roughness == 0.0f) {
    VoronoiResult result = octave(p, s);
    if (s.normalize) result.distance /= largest_distance<N>(s);
    return result;
  }
  return s.feature == VoronoiFeature::DISTANCE_TO_EDGE ? fractal_edges(p, s) : fractal_points(p, s);
}

}  // namespace

VoronoiResult voronoi_node(Vec3 p, float w, int dimensions, const VoronoiSettings& settings) {
  VoronoiSettings s = settings;
  s.randomness = clamp01(s.randomness);
  s.detail = s.detail > 0.0f ? std::min(s.detail, kMaxDetail) : 0.0f;
  s.roughness = clamp01(s.roughness);
  switch (dimensions) {
    case 1:
      return evaluate<1>({w}, s);
    case 2:
      return evaluate<2>({p.x, p.y}, s);
    case 3:
      return evaluate<3>({p.x, p.y, p.z}, s);
    default:
      return evaluate<4>({p.x, p.y, p.z, w}, s);
  }
}

}  // namespace cistern
