#include "lights/openings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>

namespace cistern {
namespace {

constexpr int kCells = 48;  // along the longest side of the origins' box
constexpr int kMargin = 4;  // cells around that: openings lie in walls, which have some thickness
constexpr size_t kMostRays = 4096, kMostOpenings = 8, kLeastOfSeed = 4;
constexpr double kFewVotes = 0.002;     // share of all rays: chance may bring as many to faces between openings
constexpr double kLeastShare = 0.04;    // of all rays, that an opening must have
constexpr double kLeastPassing = 0.95;  // of an opening's rays, that pass its plane, all in one direction
constexpr double kOutliers = 0.005;     // of those, that may pass beside it, at each edge
constexpr double kOutliersOfGrowing = 0.02,
                 kOutliersOfSeeds = 0.1;                 // the same before it is known which rays are its own
constexpr int kMostSteps = 32;                           // of growing
constexpr double kLeastDensity = 0.5;                    // of rays after a step, over that before
constexpr float kReach = 2.0f;                           // cells around the faces voted for, in which its plane may be
constexpr float kCoarseStep = 1.0f, kFineStep = 0.125f;  // cells from one plane that is tried to the next
/// Openings are a little wider than what rays show of them, and what lies beside is left to few samples of great
/// weight: with 1.08, variance of Final is 0.76 and 0.81 of that with 1.02 in a room with a window, with 1.15 0.84 and
/// 0.92.
constexpr float kWider = 1.08f;

/// The face between a cell and the one before along an axis.
struct Face {
  int axis = 0;
  std::array<int, 3> cell{};
};

/// Rays in a frame whose axes are those of the walls, in units of cells.
class GridRays {
 public:
  GridRays(std::span<const EscapedRay> rays, float yaw) : cosine_(std::cos(yaw)), sine_(std::sin(yaw)) {
    const size_t count = std::min(rays.size(), kMostRays);
    for (size_t i = 0; i < count; ++i) {
      const EscapedRay& ray = rays[i * rays.size() / count];
      rays_.push_back({to_frame(ray.origin), to_frame(ray.direction)});
    }
    Bounds3 box;
    for (const EscapedRay& ray : rays_) box.extend(ray.origin);
    const Vec3 extent = box.diagonal();
    const float longest = std::max({extent.x, extent.y, extent.z});
    edge_ = longest > 0.0f ? longest / kCells : 1.0f;
    lower_ = box.lower - Vec3{1, 1, 1} * (kMargin * edge_);
    for (int axis = 0; axis < 3; ++axis)
      size_[static_cast<size_t>(axis)] = static_cast<int>(std::ceil(extent[axis] / edge_)) + 2 * kMargin;
    for (EscapedRay& ray : rays_) ray.origin = (ray.origin - lower_) * (1.0f / edge_);
  }

  std::span<const EscapedRay> all() const { return rays_; }
  const EscapedRay& operator[](uint32_t i) const { return rays_[i]; }

  /// Of what is in the grid's units; the latter is no point.
  Vec3 point_to_world(Vec3 p) const { return to_world(lower_ + p * edge_); }
  Vec3 offset_to_world(Vec3 v) const { return to_world(v * edge_); }
  Vec3 to_world(Vec3 v) const { return {cosine_ * v.x - sine_ * v.y, sine_ * v.x + cosine_ * v.y, v.z}; }

  uint32_t number(const Face& face) const {
    const auto [x, y, z] = face.cell;
    const int cell = (z * (size_[1] + 1) + y) * (size_[0] + 1) + x;
    return static_cast<uint32_t>(3 * cell + face.axis);
  }
  size_t face_count() const {
    return 3 * static_cast<size_t>(size_[0] + 1) * static_cast<size_t>(size_[1] + 1) *
           static_cast<size_t>(size_[2] + 1);
  }

  /// Calls body(face) for the faces that a ray crosses inside the grid. [Amanatides and Woo 1987]
  template <class Body>
  void for_each_face(const EscapedRay& ray, const Body& body) const {
    std::array<int, 3> cell{}, step{};
    std::array<float, 3> next{}, per_cell{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<size_t>(axis);
      const float o = ray.origin[axis], d = ray.direction[axis];
      cell[a] = std::clamp(static_cast<int>(o), 0, size_[a] - 1);
      step[a] = d > 0.0f ? 1 : -1;
      per_cell[a] = d != 0.0f ? std::abs(1.0f / d) : INFINITY;
      const float to_face = std::abs(static_cast<float>(d > 0.0f ? cell[a] + 1 : cell[a]) - o);
      next[a] = d != 0.0f ? to_face * per_cell[a] : INFINITY;
    }
    for (;;) {
      const auto a = static_cast<size_t>(std::ranges::min_element(next) - next.begin());
      if (!std::isfinite(next[a])) return;
      Face face{static_cast<int>(a), cell};
      if (step[a] > 0) ++face.cell[a];
      body(face);
      cell[a] += step[a];
      if (cell[a] < 0 || cell[a] >= size_[a]) return;
      next[a] += per_cell[a];
    }
  }

 private:
  Vec3 to_frame(Vec3 v) const { return {cosine_ * v.x + sine_ * v.y, cosine_ * v.y - sine_ * v.x, v.z}; }

  std::vector<EscapedRay> rays_;
  float cosine_, sine_;
  float edge_ = 1.0f;  // of a cell, m
  Vec3 lower_;         // corner of the grid, in the frame
  std::array<int, 3> size_{};
};

/// A face and the rays that voted for it.
struct Votes {
  Face face;
  std::vector<uint32_t> rays;
};
using VotesByFace = std::map<uint32_t, Votes>;

VotesByFace vote(const GridRays& grid) {
  std::vector<uint32_t> crossings(grid.face_count());
  for (const EscapedRay& ray : grid.all())
    grid.for_each_face(ray, [&](const Face& face) { ++crossings[grid.number(face)]; });
  VotesByFace votes;
  for (uint32_t i = 0; i < grid.all().size(); ++i) {
    uint32_t most = 0;
    Face best;
    grid.for_each_face(grid[i], [&](const Face& face) {
      if (crossings[grid.number(face)] <= most) return;
      most = crossings[grid.number(face)];
      best = face;
    });
    if (most == 0) continue;
    Votes& of_face = votes[grid.number(best)];
    of_face.face = best;
    of_face.rays.push_back(i);
  }
  return votes;
}

/// A vector by its components along an axis and the two after it, in turn.
Vec3 from_axis(int axis, float along, float second, float third) {
  if (axis == 0) return {along, second, third};
  return axis == 1 ? Vec3{third, along, second} : Vec3{second, third, along};
}

/// A rectangle across an axis; the first coordinate of its corners is along the next axis.
struct Rectangle {
  int axis = 0;
  float plane = 0.0f;
  Vec2 lower, upper;
  bool is_forwards = true;  // do rays pass it

  float area() const { return (upper.x - lower.x) * (upper.y - lower.y); }
  /// With the size of a cell added: rectangles of few rays are too small.
  float area_with_doubt() const { return (upper.x - lower.x + 1.0f) * (upper.y - lower.y + 1.0f); }
};

/// Rays that have an opening in common, as far as known, and where it may be.
struct Cluster {
  std::vector<uint32_t> rays;
  Bounds3 faces;
};

bool has_more_rays(const Cluster& a, const Cluster& b) {
  return a.rays.size() != b.rays.size() ? a.rays.size() > b.rays.size() : a.rays < b.rays;
}

/// Interval of all values but this share of them at either end.
std::pair<float, float> extent_of(std::vector<float>& values, double outliers) {
  const auto skipped = static_cast<std::ptrdiff_t>(outliers * static_cast<double>(values.size()));
  const auto low = values.begin() + skipped, high = values.end() - 1 - skipped;
  std::ranges::nth_element(values, low);
  const float lowest = *low;
  std::ranges::nth_element(values, high);
  return {lowest, *high};
}

/// The smallest of those that nearly all rays pass, in planes `step` cells apart; of rays that pass a plane, this share
/// may pass beside each edge.
std::optional<Rectangle> smallest_rectangle(const GridRays& grid, const Cluster& cluster, float step, double outliers) {
  std::optional<Rectangle> best;
  const auto least = static_cast<size_t>(std::ceil(kLeastPassing * static_cast<double>(cluster.rays.size())));
  std::vector<float> u, v;
  for (int axis = 0; axis < 3; ++axis) {
    const auto forwards = static_cast<size_t>(
        std::ranges::count_if(cluster.rays, [&](uint32_t i) { return grid[i].direction[axis] > 0.0f; }));
    const bool is_forwards = 2 * forwards > cluster.rays.size();
    if ((is_forwards ? forwards : cluster.rays.size() - forwards) < least) continue;
    const int planes = static_cast<int>((cluster.faces.diagonal()[axis] + 2.0f * kReach) / step) + 1;
    for (int i = 0; i < planes; ++i) {
      const float plane = cluster.faces.lower[axis] - kReach + static_cast<float>(i) * step;
      u.clear();
      v.clear();
      for (const uint32_t r : cluster.rays) {
        const EscapedRay& ray = grid[r];
        if ((ray.direction[axis] > 0.0f) != is_forwards) continue;
        const float t = (plane - ray.origin[axis]) / ray.direction[axis];
        if (!(t > 0.0f) || !std::isfinite(t)) continue;
        u.push_back(ray.origin[(axis + 1) % 3] + t * ray.direction[(axis + 1) % 3]);
        v.push_back(ray.origin[(axis + 2) % 3] + t * ray.direction[(axis + 2) % 3]);
      }
      if (u.size() < least || u.empty()) continue;
      const auto [u0, u1] = extent_of(u, outliers);
      const auto [v0, v1] = extent_of(v, outliers);
      const Rectangle rectangle{axis, plane, {u0, v0}, {u1, v1}, is_forwards};
      if (!best || rectangle.area() < best->area()) best = rectangle;
    }
  }
  return best;
}

/// Rays whose faces are neighbours, across the axis they share or along it; faces of few votes are alone.
std::vector<Cluster> neighbours(const GridRays& grid, VotesByFace votes) {
  const auto least = static_cast<size_t>(std::ceil(kFewVotes * static_cast<double>(grid.all().size())));
  std::vector<Cluster> clusters;
  while (!votes.empty()) {
    Cluster cluster;
    std::vector<Votes> open{std::move(votes.begin()->second)};
    votes.erase(votes.begin());
    while (!open.empty()) {
      const auto [face, rays] = std::move(open.back());
      open.pop_back();
      cluster.rays.insert(cluster.rays.end(), rays.begin(), rays.end());
      const auto [x, y, z] = face.cell;
      const Vec3 lower{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
      cluster.faces.extend(lower);
      cluster.faces.extend(
          lower + Vec3{face.axis != 0 ? 1.0f : 0.0f, face.axis != 1 ? 1.0f : 0.0f, face.axis != 2 ? 1.0f : 0.0f});
      for (int i = 0; i < 27 && rays.size() >= least; ++i) {
        const Face near{face.axis, {x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1}};
        if (std::ranges::min(near.cell) < 0) continue;
        const auto found = votes.find(grid.number(near));
        if (found == votes.end() || found->second.face.cell != near.cell || found->second.rays.size() < least) continue;
        open.push_back(std::move(found->second));
        votes.erase(found);
      }
    }
    std::ranges::sort(cluster.rays);
    clusters.push_back(std::move(cluster));
  }
  std::ranges::sort(clusters, has_more_rays);
  return clusters;
}

/// Of the rays in a list, those that pass a rectangle or not more than a cell beside it, as a cluster in its plane.
Cluster passing(const GridRays& grid, std::span<const uint32_t> rays, const Rectangle& r) {
  Cluster cluster;
  const Vec3 lower = from_axis(r.axis, r.plane, r.lower.x, r.lower.y);
  const Vec3 upper = from_axis(r.axis, r.plane, r.upper.x, r.upper.y);
  cluster.faces.extend(lower);
  cluster.faces.extend(upper);
  for (const uint32_t i : rays) {
    const EscapedRay& ray = grid[i];
    if ((ray.direction[r.axis] > 0.0f) != r.is_forwards) continue;
    const float t = (r.plane - ray.origin[r.axis]) / ray.direction[r.axis];
    if (!(t > 0.0f) || !std::isfinite(t)) continue;
    const Vec3 p = ray.origin + t * ray.direction;
    const auto is_near = [&](int axis) { return p[axis] >= lower[axis] - 1.0f && p[axis] <= upper[axis] + 1.0f; };
    if (is_near((r.axis + 1) % 3) && is_near((r.axis + 2) % 3)) cluster.rays.push_back(i);
  }
  return cluster;
}

/// Takes in the rays beside a cluster's rectangle as long as they are about as close together there.
std::optional<Cluster> grow(const GridRays& grid, std::span<const uint32_t> rays, const Cluster& seed) {
  std::optional<Rectangle> rectangle = smallest_rectangle(grid, seed, kCoarseStep, kOutliersOfSeeds);
  if (!rectangle) return std::nullopt;
  Cluster grown = passing(grid, rays, *rectangle);
  double highest = 0.0;
  for (int i = 0; i < kMostSteps; ++i) {
    const std::optional<Rectangle> larger = smallest_rectangle(grid, grown, kCoarseStep, kOutliersOfGrowing);
    if (!larger) break;
    const double density = static_cast<double>(grown.rays.size()) / static_cast<double>(larger->area_with_doubt());
    if (density < kLeastDensity * highest) break;
    highest = std::max(density, highest);
    Cluster next = passing(grid, rays, *larger);
    const bool is_done = next.rays.size() <= grown.rays.size();
    grown = std::move(next);
    if (is_done) break;
  }
  return grown;
}

AreaLight portal_of(const GridRays& grid, const Rectangle& r) {
  const Vec2 middle = (r.lower + r.upper) * 0.5f, size = (r.upper - r.lower) * kWider;
  AreaLight portal;
  portal.center = grid.point_to_world(from_axis(r.axis, r.plane, middle.x, middle.y));
  portal.edge_u = grid.offset_to_world(from_axis(r.axis, 0.0f, size.x, 0.0f));
  portal.edge_v = grid.offset_to_world(from_axis(r.axis, 0.0f, 0.0f, size.y));
  portal.normal = grid.to_world(from_axis(r.axis, r.is_forwards ? -1.0f : 1.0f, 0.0f, 0.0f));
  portal.is_portal = true;
  return portal;
}

}  // namespace

std::vector<AreaLight> fit_openings(std::span<const EscapedRay> rays, float yaw) {
  if (rays.empty()) return {};
  const GridRays grid(rays, yaw);
  struct Opening {
    AreaLight portal;
    size_t rays = 0;
  };
  std::vector<uint32_t> left(grid.all().size());
  std::iota(left.begin(), left.end(), 0u);
  std::vector<Opening> openings;
  const auto least = static_cast<size_t>(std::ceil(kLeastShare * static_cast<double>(grid.all().size())));
  for (Cluster& seed : neighbours(grid, vote(grid))) {
    if (seed.rays.size() < kLeastOfSeed || openings.size() == kMostOpenings) break;
    std::erase_if(seed.rays, [&](uint32_t i) { return !std::ranges::binary_search(left, i); });
    if (seed.rays.size() < kLeastOfSeed) continue;
    const std::optional<Cluster> cluster = grow(grid, left, seed);
    if (!cluster || cluster->rays.size() < least) continue;
    const std::optional<Rectangle> rectangle = smallest_rectangle(grid, *cluster, kFineStep, kOutliers);
    if (!rectangle || !(rectangle->area() > 0.0f)) continue;
    openings.push_back({portal_of(grid, *rectangle), cluster->rays.size()});
    std::erase_if(left, [&](uint32_t i) { return std::ranges::binary_search(cluster->rays, i); });
  }
  std::ranges::sort(openings, std::greater<>(), &Opening::rays);
  std::vector<AreaLight> portals;
  portals.reserve(openings.size());
  for (const Opening& opening : openings) portals.push_back(opening.portal);
  return portals;
}

bool passes(const AreaLight& opening, const EscapedRay& ray) {
  const float towards = dot(opening.normal, ray.direction);
  if (!(towards < 0.0f)) return false;
  const float t = dot(opening.normal, opening.center - ray.origin) / towards;
  if (!(t >= 0.0f)) return false;
  const Vec3 offset = ray.origin + t * ray.direction - opening.center;
  return 2.0f * std::abs(dot(offset, opening.edge_u)) <= length_squared(opening.edge_u) &&
         2.0f * std::abs(dot(offset, opening.edge_v)) <= length_squared(opening.edge_v);
}

}  // namespace cistern
