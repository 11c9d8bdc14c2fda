#include "render/opening_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "base/warp.h"
#include "lights/portals.h"
#include "transport/media.h"

namespace cistern {
namespace {

constexpr uint32_t kStream = 0x6f70656e, kTestStream = 0x74657374;
/// Most scenes have no openings, which few walks tell.
constexpr uint32_t kFirstWalks = 2048, kWalks = 16384;
/// A place that sees less than this share of the sky, weighed by the cosine, is inside.
constexpr double kInside = 0.25;
/// Openings are of use where so many of the vertices are inside, ...
constexpr double kLeastInside = 0.3;
/// ... where those see so much of the sky through them, ...
constexpr double kLeastCoverage = 0.3;
/// ... and where so much of what is looked for through one is sky.
constexpr double kLeastOpen = 0.05;
constexpr int kTests = 512;

/// What walks found inside.
struct Inside {
  std::vector<WalkVertex> vertices;
  std::vector<EscapedRay> escaped;
  double share = 0.0;  // of all vertices
};

/// Cubes of a sixteenth of the vertices' box, by the six directions that a normal may be nearest to.
class Places {
 public:
  explicit Places(std::span<const WalkVertex> vertices) {
    for (const WalkVertex& v : vertices) box_.extend(v.position);
    const Vec3 extent = box_.diagonal();
    inverse_edge_ = kResolution / std::max({extent.x, extent.y, extent.z, 1e-30f});
    for (const WalkVertex& v : vertices) {
      Count& count = counts_[key(v)];
      ++count.all;
      count.open += v.sees_sky;
    }
  }
  bool is_inside(const WalkVertex& v) const {
    const Count& count = counts_.at(key(v));
    return count.open < kInside * count.all;
  }

 private:
  static constexpr int kResolution = 16;
  struct Count {
    uint32_t all = 0, open = 0;
  };

  uint32_t key(const WalkVertex& v) const {
    uint32_t key = 0;
    int side = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float along = (v.position[axis] - box_.lower[axis]) * inverse_edge_;
      key = key * (kResolution + 1) + static_cast<uint32_t>(std::clamp(along, 0.0f, static_cast<float>(kResolution)));
      if (std::abs(v.normal[axis]) > std::abs(v.normal[side])) side = axis;
    }
    return key * 6 + static_cast<uint32_t>(2 * side + (v.normal[side] > 0.0f ? 1 : 0));
  }

  Bounds3 box_;
  float inverse_edge_ = 0.0f;
  std::unordered_map<uint32_t, Count> counts_;
};

Inside find_inside(std::span<const WalkVertex> vertices) {
  Inside inside;
  const Places places(vertices);
  for (const WalkVertex& v : vertices) {
    if (!places.is_inside(v)) continue;
    inside.vertices.push_back(v);
    if (v.sees_sky) inside.escaped.push_back({v.position, v.direction});
  }
  if (!vertices.empty())
    inside.share = static_cast<double>(inside.vertices.size()) / static_cast<double>(vertices.size());
  return inside;
}

/// Azimuth of walls, up to right angles: the most common one of horizontal normals.
float find_yaw(std::span<const WalkVertex> vertices) {
  constexpr int kBins = 90;
  constexpr float kQuarter = kPi / 2.0f, kUpright = 0.3f;
  std::array<int, kBins> counts{};
  for (const WalkVertex& v : vertices) {
    if (std::abs(v.normal.z) > kUpright) continue;
    const float angle = std::fmod(std::atan2(v.normal.y, v.normal.x) + 2.0f * kPi, kQuarter);
    ++counts[static_cast<size_t>(std::lround(angle / kQuarter * kBins)) % kBins];
  }
  const auto most = std::ranges::max_element(counts) - counts.begin();
  return static_cast<float>(most) / kBins * kQuarter;
}

/// How much of what the vertices look for through an opening is sky.
double open_share(const SkyWalks& walks, const AreaLight& opening, std::span<const WalkVertex> vertices) {
  const Portals portal({}, std::span(&opening, 1));
  double open = 0.0, all = 0.0;
  Rng rng(0, 0, 0, kTestStream);
  for (int i = 0; i < kTests; ++i) {
    const auto chosen = static_cast<size_t>(rng.next_double() * static_cast<double>(vertices.size()));
    const WalkVertex& v = vertices[std::min(chosen, vertices.size() - 1)];
    const auto direction = portal.sample(rng.next_vec2(), v.position);
    const float cosine = direction ? dot(*direction, v.normal) : 0.0f;
    if (!(cosine > 0.0f)) continue;
    const double weight = portal.seen_share(v.position) * cosine;
    all += weight;
    if (!is_black(walks.sky_share(v, *direction))) open += weight;
  }
  return all > 0.0 ? open / all : 0.0;
}

}  // namespace

bool may_find_openings(const Scene& scene, const Settings& settings, const LightSet& lights) {
  if (!settings.find_openings || settings.environment_density() == EnvironmentDensity::COMPLETE) return false;
  const Environment& sky = scene.environment;
  if (sky.material < 0 || !(sky.visibility & kVisibleToDiffuse)) return false;
  const auto& program = scene.materials[static_cast<size_t>(sky.material)];
  if (!program || !program->may_emit || !Media::find_name(scene).empty()) return false;
  if (!lights.environment_emitter() && !shadow_rays_see_alike(scene)) return false;
  return std::ranges::none_of(scene.lights, [](const Light& light) { return !light.removed && is_portal(light); });
}

std::vector<AreaLight> find_openings(const SkyWalks& walks, const std::function<bool()>& is_stopped) {
  std::vector<WalkVertex> vertices = walks.walk(0, kFirstWalks, kStream, is_stopped).vertices;
  const Inside first = find_inside(vertices);
  if (first.share < kLeastInside || first.escaped.empty()) return {};
  const std::vector<WalkVertex> others = walks.walk(kFirstWalks, kWalks, kStream, is_stopped).vertices;
  if (others.empty()) return {};
  vertices.insert(vertices.end(), others.begin(), others.end());
  const Inside inside = find_inside(vertices);
  if (inside.share < kLeastInside || inside.escaped.empty()) return {};

  std::vector<AreaLight> openings = fit_openings(inside.escaped, find_yaw(inside.vertices));
  std::erase_if(openings, [&](const AreaLight& opening) {
    return (is_stopped && is_stopped()) || open_share(walks, opening, inside.vertices) < kLeastOpen;
  });
  const auto covered = std::ranges::count_if(inside.escaped, [&](const EscapedRay& ray) {
    return std::ranges::any_of(openings, [&](const AreaLight& opening) { return passes(opening, ray); });
  });
  const bool is_enough = static_cast<double>(covered) >= kLeastCoverage * static_cast<double>(inside.escaped.size());
  return is_enough ? openings : std::vector<AreaLight>();
}

}  // namespace cistern
