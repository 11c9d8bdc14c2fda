#include "transport/subsurface_walk.h"

#include <algorithm>

#include "base/angle.h"
#include "shading/phase.h"

namespace cistern {
namespace {

constexpr int kMaxSteps = 256;
/// From this one on, light is taken to be scattered evenly; as Cycles.
constexpr int kForwardSteps = 10;

float channel(Rgb c, int i) { return i == 0 ? c.r : (i == 1 ? c.g : c.b); }

Vec3 direction_at(const Vec3& axis, float cosine, float u_turns) {
  const float sine = safe_sqrt(1.0f - cosine * cosine);
  const SineCosine azimuth = sine_cosine_of_turns(u_turns);
  return normalize(Frame(axis).to_world({sine * azimuth.cosine, sine * azimuth.sine, cosine}));
}

/// Directions that follow the light in a half space towards its surface, whose normal is at cosine 1: density
/// 1 / (2 pi (v - cosine) ln((v + 1) / (v - 1))), with extinction (1 - cosine / v) of the medium's.
class Escape {
 public:
  /// `single_scatter` of the channel that goes farthest. Any length above 1 is lawful: this one is a fit.
  /// [d'Eon and Krivanek 2020, Zero-Variance Theory for Efficient Subsurface Scattering, eq. 67]
  explicit Escape(float single_scatter) {
    constexpr float kLeast = 0.2f;  // below, the length is 1 to single precision
    const float a = std::clamp(single_scatter, kLeast, 0.99999f);
    length_ = 1.0f / std::sqrt(1.0f - std::pow(a, 2.44294f - 0.0215813f * a + 0.578637f / a));
    log_ratio_ = std::log((length_ + 1.0f) / (length_ - 1.0f));
  }
  float sample_cosine(float u) const {
    return std::clamp(length_ - (length_ + 1.0f) * std::exp(-u * log_ratio_), -1.0f, 1.0f);
  }
  float density(float cosine) const { return 0.5f * kInvPi / ((length_ - cosine) * log_ratio_); }
  float stretch(float cosine) const { return 1.0f - cosine / length_; }
  /// Share of the directions that lead away from the surface where the opposite one lies `thickness` below it; at
  /// `depth`, all in mean free paths.
  float opposite_share(float depth, float thickness) const {
    return 1.0f / (1.0f + std::exp((thickness - 2.0f * std::clamp(depth, 0.0f, thickness)) / length_));
  }

 private:
  float length_, log_ratio_;  // diffusion length, in mean free paths
};

/// How one step was sampled, as far as that must be known to say with what density.
struct StepTechnique {
  float escape_share = 0.0f, opposite_share = 0.0f;                    // of the directions; of those of Escape
  float towards = 0.0f, away = 0.0f;                                   // density of Escape over the phase function's
  float stretch_towards = 1.0f, stretch_away = 1.0f;                   // of the extinction
  float density(float sigma_t, float distance, bool scatters) const {  // over the phase function's
    const auto flight = [&](float stretch) {
      const float sigma = stretch * sigma_t;
      return (scatters ? sigma : 1.0f) * std::exp(-sigma * distance);
    };
    float result = (1.0f - escape_share) * flight(1.0f);
    if (escape_share > 0.0f) {
      result += escape_share * (1.0f - opposite_share) * towards * flight(stretch_towards);
      if (opposite_share > 0.0f) result += escape_share * opposite_share * away * flight(stretch_away);
    }
    return result;
  }
};

class SubsurfaceWalk {
 public:
  SubsurfaceWalk(const Accel& accel, const SurfacePoint& entry, const Subsurface& subsurface, int vertex,
                 PathSampler& sampler)
      : accel_(accel),
        entry_(entry),
        vertex_(vertex),
        n_(subsurface.n),
        medium_(subsurface_medium(subsurface)),
        escape_share_(std::min(0.5f, 1.0f - std::pow(std::abs(medium_.g), 0.125f))),
        escape_(max_component(medium_.single_scatter)),
        sampler_(sampler),
        throughput_(medium_.kept) {}

  std::optional<SubsurfaceExit> run(const Vec3& direction) {
    ray_.direction = direction;
    ray_.origin = entry_.position;
    for (step_ = 0; step_ < kMaxSteps; ++step_) {
      if (step_ == kForwardSteps) forget_directions();
      if (!choose_channel()) return std::nullopt;
      const std::optional<Hit> hit = advance();
      if (hit) return leave(*hit);
      if (!survives_roulette()) return std::nullopt;
    }
    return std::nullopt;
  }

 private:
  void forget_directions() {
    constexpr float kEscapeShareThen = 0.75f;
    medium_ = similar_isotropic(medium_);
    escape_share_ = kEscapeShareThen;
  }

  /// By what the channels may still bring.
  bool choose_channel() {
    const Rgb worth = throughput_ * medium_.single_scatter;
    const float sum = worth.r + worth.g + worth.b;
    if (!(sum > 0.0f)) return false;
    channel_probability_ = worth / sum;
    const float u = sampler_.next_float();
    channel_ = u < channel_probability_.r ? 0 : (u < channel_probability_.r + channel_probability_.g ? 1 : 2);
    while (!(channel(channel_probability_, channel_) > 0.0f)) --channel_;  // by rounding
    return true;
  }

  /// One scattering, but before the first step, and one free path; the hit that ends it.
  std::optional<Hit> advance() {
    StepTechnique technique;
    float stretch = 1.0f;
    const PathSampler::WalkNumbers u = sampler_.walk(vertex_, step_);
    if (step_ > 0) stretch = turn(u.direction, technique);
    const float sigma = stretch * channel(medium_.sigma_t, channel_);
    float distance = -std::log1p(-u.distance) / sigma;
    std::optional<Hit> hit = cast(distance);
    if (hit) distance = hit->t;
    Rgb density;
    density.r = technique.density(medium_.sigma_t.r, distance, !hit);
    density.g = technique.density(medium_.sigma_t.g, distance, !hit);
    density.b = technique.density(medium_.sigma_t.b, distance, !hit);
    const Rgb by_channel = channel_probability_ * density;
    const Rgb transmittance = exp(-distance * medium_.sigma_t);
    throughput_ *= (hit ? transmittance : medium_.sigma_t * medium_.single_scatter * transmittance) /
                   (by_channel.r + by_channel.g + by_channel.b);
    if (!hit) ray_.origin = ray_.origin + distance * ray_.direction;
    return hit;
  }

  /// Sets the direction; returns the stretch of the extinction that goes with it.
  float turn(Vec2 u, StepTechnique& technique) {
    technique.escape_share = escape_share_;
    if (thickness_ < INFINITY) {
      const float sigma = std::min({medium_.sigma_t.r, medium_.sigma_t.g, medium_.sigma_t.b});
      const float depth = dot(ray_.origin - entry_.position, -n_);
      technique.opposite_share = escape_.opposite_share(sigma * depth, sigma * thickness_);
    }
    const bool escapes = sampler_.next_float() < technique.escape_share;
    const bool is_away = escapes && sampler_.next_float() < technique.opposite_share;
    const Vec3 before = ray_.direction;
    ray_.direction = !escapes ? sample_henyey_greenstein(before, medium_.g, u)
                              : direction_at(is_away ? -n_ : n_, escape_.sample_cosine(u.x), u.y);
    const float cosine = dot(ray_.direction, n_), phase = henyey_greenstein(dot(before, ray_.direction), medium_.g);
    technique.towards = escape_.density(cosine) / phase;
    technique.away = escape_.density(-cosine) / phase;
    technique.stretch_towards = escape_.stretch(cosine);
    technique.stretch_away = escape_.stretch(-cosine);
    return !escapes ? 1.0f : (is_away ? technique.stretch_away : technique.stretch_towards);
  }

  /// The object's surface before the end of the free path. The first ray also looks for the opposite side.
  std::optional<Hit> cast(float distance) {
    constexpr float kFar = 10.0f;  // mean free paths
    ray_.t_max = distance;
    if (step_ == 0)
      ray_.t_max = std::max(distance, kFar / std::min({medium_.sigma_t.r, medium_.sigma_t.g, medium_.sigma_t.b}));
    std::optional<Hit> hit = accel_.intersect_instance(ray_, entry_.instance);
    while (step_ == 0 && hit && hit->triangle == entry_.triangle) {  // by rounding: the first ray leaves this one
      ray_.t_min = hit->t + entry_.clearance;
      hit = accel_.intersect_instance(ray_, entry_.instance);
    }
    ray_.t_min = 0.0f;
    if (step_ == 0 && hit) thickness_ = std::max(dot(hit->t * ray_.direction, -n_), 0.0f);
    return hit && hit->t < distance ? hit : std::nullopt;
  }

  bool survives_roulette() {
    constexpr float kDim = 0.05f;
    const float worth = max_component(throughput_);
    if (worth >= kDim) return true;
    if (!(sampler_.next_float() < worth / kDim)) return false;
    throughput_ *= kDim / worth;
    return true;
  }

  SubsurfaceExit leave(const Hit& hit) const {
    const Vec3 beyond = ray_.origin + 2.0f * hit.t * ray_.direction;
    return {{beyond, -ray_.direction}, hit, throughput_};
  }

  const Accel& accel_;
  const SurfacePoint& entry_;
  int vertex_;
  Vec3 n_;
  SubsurfaceMedium medium_;
  float escape_share_;  // of the directions: few where the medium itself leads forward, which is another way
  Escape escape_;
  PathSampler& sampler_;
  Ray ray_;
  Rgb throughput_;
  Rgb channel_probability_;
  int channel_ = 0, step_ = 0;
  float thickness_ = INFINITY;
};

}  // namespace

std::optional<SubsurfaceExit> walk_below(const Accel& accel, const SurfacePoint& entry, const Subsurface& subsurface,
                                         int vertex, PathSampler& sampler) {
  const float u_choice = sampler.next_float();
  const std::optional<Vec3> direction = sample_entry(subsurface, entry.wo, u_choice, sampler.walk(vertex, 0).direction);
  if (!direction || dot(*direction, entry.ng) >= 0.0f) return std::nullopt;
  return SubsurfaceWalk(accel, entry, subsurface, vertex, sampler).run(*direction);
}

}  // namespace cistern
