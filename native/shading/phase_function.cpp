#include "shading/phase_function.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/frame.h"
#include "base/warp.h"

namespace cistern {
namespace {

/// Less anisotropy than this does not show, and the inverses below would divide by it.
constexpr float kIsotropic = 1e-3f;
constexpr float kUniform = 1.0f / (4.0f * kPi);
constexpr float kLargestAlpha = 1e3f;

/// Cosine of the deflection that `u` of all light exceeds, of Henyey and Greenstein's.
float sample_henyey_greenstein_cosine(float g, float u) {
  if (std::abs(g) < kIsotropic) return 1.0f - 2.0f * u;
  const float root = (1.0f - sqr(g)) / (1.0f + g - 2.0f * g * u);
  return std::clamp((1.0f + sqr(g) - sqr(root)) / (2.0f * g), -1.0f, 1.0f);
}

/// Where an increasing function is 0, between `low` and `high`, by Newton's steps, each within what is left of the
/// bracket. `excess(x)`: the function and its slope.
template <class Excess>
double find_root(double low, double high, double x, const Excess& excess) {
  constexpr int kMostSteps = 60;
  constexpr double kAccuracy = 1e-9;
  for (int i = 0; i < kMostSteps; ++i) {
    const auto [value, slope] = excess(x);
    if (std::abs(value) < kAccuracy) break;
    (value > 0.0 ? high : low) = x;
    x -= value / slope;
    if (!(x > low && x < high)) x = 0.5 * (low + high);
  }
  return x;
}

/// The root between `low` and `high` of an increasing `integral` that has the part `u` of it below, where `slope` is
/// its derivative.
template <class Integral, class Slope>
double invert(double low, double high, double u, const Integral& integral, const Slope& slope) {
  const double first = integral(low), whole = integral(high) - first;
  return find_root(low, high, low + u * (high - low),
                   [&](double x) { return std::pair((integral(x) - first) / whole - u, slope(x) / whole); });
}

/// Cosine of the deflection that `u` of all light exceeds, of Draine's for g >= 0. In x = -1 / t, where
/// t^2 = 1 + g^2 - 2 g cosine, Henyey and Greenstein's density is constant and Draine's is 1 + alpha cosine^2; for g =
/// 0 in x = -cosine.
double sample_draine_cosine(double g, double alpha, double u) {
  if (g < static_cast<double>(kIsotropic)) {
    return -invert(
        -1.0, 1.0, u, [&](double x) { return x * (1.0 + alpha / 3.0 * x * x); },
        [&](double x) { return 1.0 + alpha * x * x; });
  }
  const double a = 1.0 + g * g, scale = alpha / (4.0 * g * g);
  const auto cosine_at = [&](double x) { return (a - 1.0 / (x * x)) / (2.0 * g); };
  const double x = invert(
      -1.0 / (1.0 - g), -1.0 / (1.0 + g), u,
      [&](double v) { return (1.0 + scale * a * a) * v + 2.0 * scale * a / v - scale / (3.0 * v * v * v); },
      [&](double v) { return 1.0 + alpha * cosine_at(v) * cosine_at(v); });
  return cosine_at(x);
}

/// Fournier and Forand's in x = sin^2 of half the angle: its density is 4 pi times that per solid angle. It has a pole
/// at 0, where x^power is integrable, and is the mean over [0, kCore] there.
class FournierForand {
 public:
  static constexpr double kCore = 1e-6;

  FournierForand(double slope, double power) : slope_(slope), power_(power) {
    const double back = powered(slope);
    tail_ = (1.0 - back) / ((slope - 1.0) * back);
  }

  double density(double x) const {
    if (x < kCore) return below(kCore) / kCore;
    const double delta = delta_at(x), a = powered(delta), rest = 1.0 - delta, cosine = 1.0 - 2.0 * x;
    const double peak = (-power_ * rest - (1.0 - a) + (delta * (1.0 - a) + power_ * rest) / x) / (rest * rest * a);
    return peak + 0.25 * tail_ * (3.0 * cosine * cosine - 1.0);
  }

  double sample(double u) const {
    const double core = below(kCore);
    if (u < core) return kCore * u / core;
    const double first = std::pow(kCore, power_);  // in y = x^power, which undoes the pole
    const auto x_at = [&](double y) { return std::pow(y, 1.0 / power_); };
    return x_at(find_root(first, 1.0, std::lerp(first, 1.0, (u - core) / (1.0 - core)), [&](double y) {
      const double x = x_at(y);
      return std::pair(below(x) - u, density(x) * x / (power_ * y));
    }));
  }

 private:
  /// The part of all light that is deflected by less. [Mobley et al. 2002, eq. 7]
  double below(double x) const {
    const double delta = delta_at(x), a = powered(delta), cosine = 1.0 - 2.0 * x;
    const double peak = (1.0 - delta * a - (1.0 - a) * x) / ((1.0 - delta) * a);
    return peak + 0.125 * tail_ * cosine * (1.0 - cosine * cosine);
  }

  double powered(double delta) const { return std::pow(delta, -power_); }

  /// Apart from 1, where numerators and denominators are 0.
  double delta_at(double x) const {
    constexpr double kApart = 1e-5;
    const double delta = slope_ * x;
    return std::abs(1.0 - delta) < kApart ? 1.0 - kApart : delta;
  }

  double slope_, power_, tail_;
};

}  // namespace

float henyey_greenstein(float cosine, float g) {
  if (std::abs(g) < kIsotropic) return kUniform;
  const float a = std::abs(g), along = g < 0.0f ? -cosine : cosine;
  const float d2 = sqr(1.0f - a) + 2.0f * a * std::max(1.0f - along, 0.0f);  // 1 + g^2 - 2 g cos without cancellation
  return kUniform * (1.0f - sqr(a)) / (d2 * std::sqrt(d2));
}

Vec3 sample_henyey_greenstein(Vec3 direction, float g, Vec2 u) {
  return deflected(direction, sample_henyey_greenstein_cosine(g, u.x), u.y);
}

Vec3 deflected(Vec3 direction, float cosine, float turns) {
  const float sine = safe_sqrt(1.0f - sqr(cosine));
  const SineCosine azimuth = sine_cosine_of_turns(turns);
  return normalize(Frame(direction).to_world({sine * azimuth.cosine, sine * azimuth.sine, cosine}));
}

PhaseFunction PhaseFunction::draine(float g, float alpha) {
  PhaseFunction phase;
  phase.g_ = std::isfinite(g) ? std::clamp(g, -kLargestAnisotropy, kLargestAnisotropy) : 0.0f;
  phase.alpha_ = std::isfinite(alpha) ? std::clamp(alpha, 0.0f, kLargestAlpha) : 0.0f;
  return phase;
}

PhaseFunction PhaseFunction::fournier_forand(float ior, float backscatter) {
  constexpr float kUsualIor = 1.33f, kUsualBackscatter = 0.1f;  // as Blender's node has them
  const double n = std::clamp(std::isfinite(ior) ? ior : kUsualIor, 1.001f, 100.0f);
  const double b = std::clamp(std::isfinite(backscatter) ? backscatter : kUsualBackscatter, 1e-4f, 0.499f);
  double at_right_angle = 2.0 / (3.0 * (n - 1.0) * (n - 1.0));
  for (const double flat : {1.0, 0.5})  // at a right angle and straight back, quotients would be 0 / 0
    if (std::abs(at_right_angle - flat) < 1e-4 * flat) at_right_angle = (1.0 + 1e-4) * flat;
  PhaseFunction phase;
  phase.kind_ = Kind::FOURNIER_FORAND;
  phase.slope_ = static_cast<float>(2.0 * at_right_angle);
  phase.power_ = static_cast<float>(std::log1p(2.0 * b * (at_right_angle - 1.0)) / std::log(at_right_angle));
  return phase;
}

float PhaseFunction::density(float cosine) const {
  if (kind_ == Kind::FOURNIER_FORAND) {
    const double x = 0.5 * std::clamp(1.0 - static_cast<double>(cosine), 0.0, 2.0);
    return kUniform * static_cast<float>(FournierForand(slope_, power_).density(x));
  }
  const float density = cistern::henyey_greenstein(cosine, g_);
  if (alpha_ == 0.0f) return density;
  const float g2 = std::abs(g_) < kIsotropic ? 0.0f : sqr(g_);
  return density * (1.0f + alpha_ * sqr(cosine)) / (1.0f + alpha_ * (1.0f + 2.0f * g2) / 3.0f);
}

float PhaseFunction::sample_cosine(float u) const {
  if (kind_ == Kind::FOURNIER_FORAND) {
    const double x = FournierForand(slope_, power_).sample(u);
    return static_cast<float>(std::clamp(1.0 - 2.0 * x, -1.0, 1.0));
  }
  if (alpha_ == 0.0f) return sample_henyey_greenstein_cosine(g_, u);
  const double v = u,
               cosine = g_ < 0.0f ? -sample_draine_cosine(-g_, alpha_, 1.0 - v) : sample_draine_cosine(g_, alpha_, v);
  return static_cast<float>(std::clamp(cosine, -1.0, 1.0));
}

DropletPhase droplet_phase(float diameter) {
  const float d = diameter > 0.0f ? diameter : 0.0f;
  float g, draine_g, alpha = 250.0f, share;
  if (d <= 0.1f) {
    g = 13.8f * sqr(d);
    draine_g = 1.1456f * d * std::sin(9.29044f * d);
    share = 0.252977f - 312.983f * std::pow(d, 4.3f);
  } else if (d < 1.5f) {
    const float l = std::log(d);
    g = 0.862f - 0.143f * sqr(l);
    const float wave = std::cos((l - 0.238604f) * (l + 1.00667f) / (0.507522f - 0.15677f * l));
    draine_g = 0.379685f * std::cos(1.19692f * wave + 1.37932f * l + 0.0625835f) + 0.344213f;
    share = 0.146209f * std::cos(3.38707f * l + 2.11193f) + 0.316072f + 0.0778917f * l;
  } else if (d < 5.0f) {
    const float l = std::log(d), ll = std::log(l);
    g = 0.0604931f * ll + 0.940256f;
    draine_g = 0.500411f - 0.081287f / (1.27551f + std::tan(l) - 2.0f * l);
    alpha = 7.30354f * l + 6.31675f;
    share = 0.026914f * (l - std::cos(5.68947f * (ll - 0.0292149f))) + 0.376475f;
  } else {
    g = std::exp(-0.0990567f / (d - 1.67154f));
    draine_g = std::exp(-2.20679f / (d + 3.91029f) - 0.428934f);
    alpha = std::exp(3.62489f - 8.29288f / (d + 5.52825f));
    share = std::exp(-0.599085f / (d - 0.641583f) - 0.665888f);
  }
  return {PhaseFunction::henyey_greenstein(g), PhaseFunction::draine(draine_g, alpha), clamp01(share)};
}

}  // namespace cistern
