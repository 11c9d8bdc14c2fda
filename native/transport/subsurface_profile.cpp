#include "transport/subsurface_profile.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/angle.h"
#include "shading/diffusion_profile.h"

namespace cistern {
namespace {

/// Of the geometric normal and of two axes across: these see what stands steeply beside the entry.
constexpr std::array<float, 3> kAxisProbability{0.5f, 0.25f, 0.25f};

class ProfileProbe {
 public:
  ProfileProbe(const SurfacePoint& entry, const Subsurface& subsurface)
      : entry_(entry), axes_(axes_about(entry.ng)), albedo_(subsurface.albedo) {
    const Rgb widths = profile_widths(subsurface), arrives = subsurface.weight * subsurface.albedo;
    profiles_ = {DiffusionProfile(widths.r), DiffusionProfile(widths.g), DiffusionProfile(widths.b)};
    is_lit_ = {arrives.r > 0.0f && widths.r > 0.0f, arrives.g > 0.0f && widths.g > 0.0f,
               arrives.b > 0.0f && widths.b > 0.0f};
    lit_ = static_cast<int>(std::count(is_lit_.begin(), is_lit_.end(), true));
  }
  bool is_black() const { return lit_ == 0; }

  /// Across a ball about the entry that holds all the profile of one colour.
  Ray ray(float u_axis, Vec2 u) const {
    size_t axis = 0;
    while (axis < 2 && u_axis >= kAxisProbability[axis]) u_axis -= kAxisProbability[axis++];
    const float scaled = u.x * static_cast<float>(lit_);
    const int which = std::min(static_cast<int>(scaled), lit_ - 1);
    const DiffusionProfile& profile = profiles_[lit_channel(which)];
    const float r = profile.sample(std::min(scaled - static_cast<float>(which), kOneMinusEpsilon));
    const SineCosine turn = sine_cosine_of_turns(u.y);
    const float half = safe_sqrt(sqr(profile.end()) - sqr(r));
    const Vec3& along = axes_[axis];
    const Vec3 across = turn.cosine * axes_[(axis + 1) % 3] + turn.sine * axes_[(axis + 2) % 3];
    return {entry_.position + r * across + half * along, -along, 0.0f, 2.0f * half};
  }

  /// What a point brings, over the density of `ray` to find it.
  Rgb weight(const Vec3& offset, const Vec3& normal) const {
    const float distance = length(offset);
    float density = 0.0f;
    for (size_t axis = 0; axis < 3; ++axis) {
      const float cosine = std::abs(dot(normal, axes_[axis]));
      const float r = length(offset - dot(offset, axes_[axis]) * axes_[axis]);
      for (size_t i = 0; i < 3; ++i)
        if (is_lit_[i] && distance < profiles_[i].end())
          density += kAxisProbability[axis] * cosine * profiles_[i].area_density(r);
    }
    density /= static_cast<float>(lit_);
    if (!(density > 0.0f) || !std::isfinite(density)) return {};
    const auto brought = [&](size_t i) { return is_lit_[i] ? profiles_[i].area_density(distance) / density : 0.0f; };
    return albedo_ * Rgb{brought(0), brought(1), brought(2)};
  }

 private:
  static std::array<Vec3, 3> axes_about(const Vec3& normal) {
    const Frame frame(normal);
    return {normal, frame.to_world({1.0f, 0.0f, 0.0f}), frame.to_world({0.0f, 1.0f, 0.0f})};
  }

  size_t lit_channel(int which) const {
    size_t channel = 0;
    while (!is_lit_[channel] || which-- > 0) ++channel;
    return channel;
  }

  const SurfacePoint& entry_;
  std::array<Vec3, 3> axes_;
  Rgb albedo_;
  std::array<DiffusionProfile, 3> profiles_{DiffusionProfile(0.0f), DiffusionProfile(0.0f), DiffusionProfile(0.0f)};
  std::array<bool, 3> is_lit_{};
  int lit_ = 0;
};

/// The hit as a ray from outside finds it.
SubsurfaceExit exit_at(const Ray& ray, const Hit& hit, bool is_from_outside, Rgb weight) {
  if (is_from_outside) return {ray, hit, weight};
  return {{ray.origin + 2.0f * hit.t * ray.direction, -ray.direction}, hit, weight};
}

}  // namespace

std::optional<SubsurfaceExit> exit_by_profile(const Accel& accel, const SurfacePoint& entry,
                                              const Subsurface& subsurface, int vertex, PathSampler& sampler) {
  constexpr int kMostHits = 32;  // along one ray; of more, the farthest are not there
  const ProfileProbe probe(entry, subsurface);
  if (probe.is_black()) return std::nullopt;
  const PathSampler::WalkNumbers u = sampler.walk(vertex, 0);
  const Ray whole = probe.ray(u.distance, u.direction);
  Ray ray = whole;
  std::optional<SubsurfaceExit> chosen;
  float sum = 0.0f;
  for (int i = 0; i < kMostHits; ++i) {
    const std::optional<Hit> hit = accel.intersect_instance(ray, entry.instance);
    if (!hit) break;
    ray.t_min = std::nextafter(hit->t, INFINITY);
    const Vec3 normal = normalize_or(hit->normal, ray.direction), outside = entry.is_backface ? -normal : normal;
    const Rgb weight = probe.weight(ray.origin + hit->t * ray.direction - entry.position, normal);
    const float worth = average(weight);
    if (!(worth > 0.0f)) continue;
    sum += worth;
    if (sampler.next_float() * sum < worth)
      chosen = exit_at(whole, *hit, dot(ray.direction, outside) < 0.0f, weight * (1.0f / worth));
  }
  if (chosen) chosen->weight *= sum;
  return chosen;
}

}  // namespace cistern
