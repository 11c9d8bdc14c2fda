#include "shading/thin_film.h"

#include <array>
#include <optional>

#include "shading/color_matching.h"
#include "shading/fresnel.h"

namespace cistern {
namespace {

constexpr size_t kChannels = 3;
constexpr size_t kOrders = 3;  // terms of the sum after the constant one; the others hardly matter

// As in Cycles, so that what interpolation gets wrong, both get wrong. At the last entry little is left of any colour.
constexpr size_t kPathEntries = 512;
constexpr double kLongestPathNm = 30000.0 / std::numbers::pi;

/// Cosine and sine of a phase.
Vec2 turn(Vec2 a, Vec2 b) { return {a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x}; }

using ChannelWaves = std::array<Vec2, kChannels>;
using PathTable = std::array<ChannelWaves, kPathEntries>;

/// Mean of the wave exp(i 2 pi path / wavelength) over what each channel sees.
ChannelWaves mean_waves(double path_nm) {
  std::array<double, kChannels> cosines{}, sines{}, total{};
  for (size_t i = 0; i < kColorMatching.size(); ++i) {
    const Vec3 xyz = kColorMatching[i];
    const auto seen =
        rec709_from_xyz(static_cast<double>(xyz.x), static_cast<double>(xyz.y), static_cast<double>(xyz.z));
    const double phase = 2.0 * std::numbers::pi * path_nm / matching_wavelength_nm(i);
    for (size_t c = 0; c < kChannels; ++c) {
      cosines[c] += seen[c] * std::cos(phase);
      sines[c] += seen[c] * std::sin(phase);
      total[c] += seen[c];
    }
  }
  ChannelWaves waves;
  for (size_t c = 0; c < kChannels; ++c)
    waves[c] = {static_cast<float>(cosines[c] / total[c]), static_cast<float>(sines[c] / total[c])};
  return waves;
}

PathTable make_path_table() {
  PathTable table;
  for (size_t i = 0; i < kPathEntries; ++i)
    table[i] = mean_waves(kLongestPathNm * static_cast<double>(i) / (kPathEntries - 1));
  return table;
}

/// `mean_waves` from a table that is made on first use (see nodes_blackbody.cpp).
ChannelWaves look_up_waves(float path_nm) {
  static const PathTable table = make_path_table();
  constexpr float kScale = static_cast<float>((kPathEntries - 1) / kLongestPathNm);
  constexpr float kLast = static_cast<float>(kPathEntries - 1);
  const float position = path_nm * kScale < kLast ? path_nm * kScale : kLast;  // the last for NaN, too
  const size_t low = static_cast<size_t>(position), high = std::min(low + 1, kPathEntries - 1);
  const float t = position - static_cast<float>(low);
  ChannelWaves waves;
  for (size_t c = 0; c < kChannels; ++c) waves[c] = (1.0f - t) * table[low][c] + t * table[high][c];
  return waves;
}

/// Of an interface, in one polarisation: the share of power, and the phase by which the wave is late.
struct Reflection {
  float power;
  Vec2 phase;
};
struct PolarizedReflection {
  Reflection s, p;
};

Reflection reflection_of(float amplitude) { return {sqr(amplitude), {amplitude >= 0.0f ? 1.0f : -1.0f, 0.0f}}; }

/// Between dielectrics; empty where all is reflected. `cos_t` as in `fresnel_dielectric`.
std::optional<PolarizedReflection> reflect_at_dielectric(float cos_i, float eta, float& cos_t) {
  cos_t = 0.0f;
  const float scaled_cos_t_squared = sqr(eta) - 1.0f + sqr(cos_i);
  if (scaled_cos_t_squared <= 0.0f) return {};
  const float g = std::sqrt(scaled_cos_t_squared);  // eta cos_t
  cos_t = g / eta;
  const float across = sqr(eta) * cos_i;
  return PolarizedReflection{reflection_of((cos_i - g) / (cos_i + g)), reflection_of((across - g) / (across + g))};
}

Vec2 unit_phase(float re, float im) {
  const float size = std::sqrt(sqr(re) + sqr(im));
  return size > 0.0f ? Vec2{re / size, im / size} : Vec2{1.0f, 0.0f};
}

float ratio(float a, float b) { return b > 0.0f ? a / b : 0.0f; }

/// From a dielectric of index `n1` into a conductor of index n + ik. [Born and Wolf 1999, Principles of Optics,
/// §14.4.1]
PolarizedReflection reflect_at_conductor(float cos_i, float n1, float n, float k) {
  const float difference = sqr(n) - sqr(k), product = 2.0f * n * k;
  const float real = difference - sqr(n1) * (1.0f - sqr(cos_i)), size = std::sqrt(sqr(real) + sqr(product));
  const float u2 = std::max(0.5f * (size + real), 0.0f), v2 = std::max(0.5f * (size - real), 0.0f);
  const float u = std::sqrt(u2), v = std::sqrt(v2), c = n1 * cos_i;
  const float a = difference * cos_i, b = product * cos_i;
  return {
      {ratio(sqr(c - u) + v2, sqr(c + u) + v2), unit_phase(sqr(c) - u2 - v2, -2.0f * c * v)},
      {ratio(sqr(a - n1 * u) + sqr(b - n1 * v), sqr(a + n1 * u) + sqr(b + n1 * v)),
       unit_phase(sqr((sqr(n) + sqr(k)) * cos_i) - sqr(n1) * (u2 + v2), 2.0f * c * (product * u - difference * v))}};
}

/// Eq. 10 for one channel and polarisation, of what the upper and the lower face reflect; `waves` by order.
float airy_sum(const Reflection& upper, const Reflection& lower, const std::array<Vec2, kOrders>& waves) {
  const float through = 1.0f - upper.power, round_trip = upper.power * lower.power;
  if (round_trip >= 1.0f) return 1.0f;
  const float beyond = sqr(through) * lower.power / (1.0f - round_trip);
  const Vec2 phase = -upper.phase.x * lower.phase;  // seen from below, the upper face reflects with the other sign
  const float amplitude = std::sqrt(round_trip);
  float sum = upper.power + beyond, strength = beyond - through;
  Vec2 turned = phase;
  for (const Vec2& wave : waves) {
    strength *= amplitude;
    sum += 2.0f * strength * turn(turned, wave).x;
    turned = turn(turned, phase);
  }
  return sum;
}

/// The film as light meets it; without a `top`, all is reflected.
struct FilmPass {
  float ior, cos_inside = 0.0f, path_nm = 0.0f;
  std::optional<PolarizedReflection> top;
};

FilmPass enter_film(const ThinFilm& film, float cos_i) {
  constexpr float kFaded = 1.0f;  // nm
  const float t = clamp01(film.thickness_nm / kFaded);
  FilmPass pass{lerp(1.0f, film.ior, t * t * (3.0f - 2.0f * t)), 0.0f, 0.0f, {}};
  pass.top = reflect_at_dielectric(cos_i, pass.ior, pass.cos_inside);
  pass.path_nm = 2.0f * pass.ior * film.thickness_nm * pass.cos_inside;
  return pass;
}

using BottomReflections = std::array<PolarizedReflection, kChannels>;

Rgb sum_over_passes(const FilmPass& pass, const BottomReflections& bottom) {
  std::array<std::array<Vec2, kOrders>, kChannels> waves;
  for (size_t m = 0; m < kOrders; ++m) {
    const ChannelWaves order = look_up_waves(static_cast<float>(m + 1) * pass.path_nm);
    for (size_t c = 0; c < kChannels; ++c) waves[c][m] = order[c];
  }
  const auto channel = [&](size_t c) {
    const float s = airy_sum(pass.top->s, bottom[c].s, waves[c]), p = airy_sum(pass.top->p, bottom[c].p, waves[c]);
    return clamp01(0.5f * (s + p));
  };
  return {channel(0), channel(1), channel(2)};
}

/// Of a metal below the film. The index decides the phases, and the reflectance head-on; else that follows the curve
/// through `f82` at kF82Cosine. [Gulbrandsen 2014, Artist Friendly Metallic Fresnel, with f82 for the edge tint]
PolarizedReflection reflect_at_metal(const FilmPass& pass, float f0, float f82) {
  constexpr float kMirror = 0.999f;
  const float r = std::min(f0, kMirror), root = std::sqrt(r);
  const float n = lerp((1.0f + root) / (1.0f - root), (1.0f - r) / (1.0f + r), f82);
  const float k = safe_sqrt((r * sqr(n + 1.0f) - sqr(n - 1.0f)) / (1.0f - r));
  PolarizedReflection reflection = reflect_at_conductor(pass.cos_inside, pass.ior, n, k);
  const float relative_n = n / pass.ior, relative_k2 = sqr(k / pass.ior);
  const Rgb below((sqr(relative_n - 1.0f) + relative_k2) / (sqr(relative_n + 1.0f) + relative_k2));
  reflection.s.power = reflection.p.power =
      fresnel_f82(pass.cos_inside, below, f82_coefficient_through(below, Rgb(f82))).r;
  return reflection;
}

}  // namespace

Rgb fresnel_film_on_dielectric(const ThinFilm& film, float cos_i, float ior, const Rgb& f0, float* cos_t) {
  float unused;
  float& cos_below = cos_t ? *cos_t : unused;
  cos_below = 0.0f;
  const FilmPass pass = enter_film(film, cos_i);
  if (!pass.top) return Rgb(1.0f);
  const auto bottom = reflect_at_dielectric(pass.cos_inside, ior / pass.ior, cos_below);
  if (!bottom) return Rgb(1.0f);
  const Rgb reflectance = sum_over_passes(pass, {*bottom, *bottom, *bottom});
  constexpr float kNoReflection = 1e-5f;
  const float real_f0 = f0_from_ior(ior);
  if (real_f0 <= kNoReflection || f0 == Rgb(real_f0)) return reflectance;
  const auto scaled = [&](float f, float head_on) {
    return std::min(f * lerp(1.0f, head_on / real_f0, clamp01((1.0f - f) / (1.0f - real_f0))), 1.0f);
  };
  return {scaled(reflectance.r, f0.r), scaled(reflectance.g, f0.g), scaled(reflectance.b, f0.b)};
}

Rgb fresnel_film_on_metal(const ThinFilm& film, float cos_i, const Rgb& f0, const Rgb& b) {
  const FilmPass pass = enter_film(film, cos_i);
  if (!pass.top) return Rgb(1.0f);
  const Rgb f82 = fresnel_f82(kF82Cosine, f0, b);
  return sum_over_passes(pass, {reflect_at_metal(pass, f0.r, f82.r), reflect_at_metal(pass, f0.g, f82.g),
                                reflect_at_metal(pass, f0.b, f82.b)});
}

Rgb fresnel_conductor(float cos_i, const Rgb& n, const Rgb& k) {
  const auto channel = [&](float re, float im) {
    const PolarizedReflection reflection = reflect_at_conductor(cos_i, 1.0f, re, im);
    return 0.5f * (reflection.s.power + reflection.p.power);
  };
  return {channel(n.r, k.r), channel(n.g, k.g), channel(n.b, k.b)};
}

Rgb fresnel_film_on_conductor(const ThinFilm& film, float cos_i, const Rgb& n, const Rgb& k) {
  const FilmPass pass = enter_film(film, cos_i);
  if (!pass.top) return Rgb(1.0f);
  const auto bottom = [&](float re, float im) { return reflect_at_conductor(pass.cos_inside, pass.ior, re, im); };
  return sum_over_passes(pass, {bottom(n.r, k.r), bottom(n.g, k.g), bottom(n.b, k.b)});
}

float largest_film_reflectance(const ThinFilm& film, float ior) {
  const float top = std::abs((film.ior - 1.0f) / (film.ior + 1.0f));
  const float bottom = std::abs((ior - film.ior) / (ior + film.ior));
  return sqr((top + bottom) / (1.0f + top * bottom));
}

}  // namespace cistern
