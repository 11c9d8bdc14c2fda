#include "shading/nodes_noise.h"

#include <immintrin.h>

#include <algorithm>

#include "shading/nodes_hash.h"

namespace cistern {
namespace {

template <size_t N>
using Point = std::array<float, N>;

// Blender repeats its noise at this distance, where floats start to show their steps.
constexpr float kPeriod = 100000.0f;
constexpr float kMaxCoordinate = 1e18f;
constexpr float kMaxDetail = 15.0f;
constexpr float kLeastWeight = 0.001f;  // octaves of hybrid noise below it are left out

float negate_if(float v, uint32_t condition) { return condition != 0 ? -v : v; }

/// One for each of eight corners of a cell: along x, then y, then z.
struct WordLanes {
  __m256i v;
  explicit WordLanes(__m256i lanes) : v(lanes) {}
  explicit WordLanes(uint32_t same) : v(_mm256_set1_epi32(static_cast<int>(same))) {}
  WordLanes& operator+=(const WordLanes& other) { return *this = *this + other; }
  friend WordLanes operator+(const WordLanes& a, const WordLanes& b) { return WordLanes(_mm256_add_epi32(a.v, b.v)); }
  friend WordLanes operator-(const WordLanes& a, const WordLanes& b) { return WordLanes(_mm256_sub_epi32(a.v, b.v)); }
  friend WordLanes operator^(const WordLanes& a, const WordLanes& b) { return WordLanes(_mm256_xor_si256(a.v, b.v)); }
  friend WordLanes operator&(const WordLanes& a, const WordLanes& b) { return WordLanes(_mm256_and_si256(a.v, b.v)); }
};
WordLanes shift_left(const WordLanes& a, int bits) { return WordLanes(_mm256_slli_epi32(a.v, bits)); }
WordLanes rotl(const WordLanes& a, int bits) {
  return WordLanes(_mm256_or_si256(_mm256_slli_epi32(a.v, bits), _mm256_srli_epi32(a.v, 32 - bits)));
}
WordLanes is_less(const WordLanes& a, uint32_t b) {
  return WordLanes(_mm256_cmpgt_epi32(WordLanes(b).v, a.v));  // of small numbers
}

__m256 select(const WordLanes& mask, __m256 if_set, __m256 if_clear) {
  return _mm256_blendv_ps(if_clear, if_set, _mm256_castsi256_ps(mask.v));
}
/// Negated where that bit of h is set.
__m256 negate_by(__m256 v, const WordLanes& h, int bit) {
  const WordLanes sign = shift_left(h & WordLanes(1u << bit), 31 - bit);
  return _mm256_xor_ps(v, _mm256_castsi256_ps(sign.v));
}

/// Dot products of the offsets with one of a few lattice directions each.
template <size_t N>
__m256 gradients(const WordLanes& hash, const __m256 (&d)[N]) {
  if constexpr (N == 2) {
    const WordLanes h = hash & WordLanes(7u), low = is_less(h, 4);
    const __m256 other = select(low, d[1], d[0]);
    return _mm256_add_ps(negate_by(select(low, d[0], d[1]), h, 0), negate_by(_mm256_add_ps(other, other), h, 1));
  } else if constexpr (N == 3) {
    const WordLanes h = hash & WordLanes(15u),
                    is_x = WordLanes(_mm256_cmpeq_epi32((h & WordLanes(13u)).v, WordLanes(12u).v));
    return _mm256_add_ps(negate_by(select(is_less(h, 8), d[0], d[1]), h, 0),
                         negate_by(select(is_less(h, 4), d[1], select(is_x, d[0], d[2])), h, 1));
  } else {
    const WordLanes h = hash & WordLanes(31u);
    const __m256 u = negate_by(select(is_less(h, 24), d[0], d[1]), h, 0);
    const __m256 v = negate_by(select(is_less(h, 16), d[1], d[2]), h, 1);
    return _mm256_add_ps(_mm256_add_ps(u, v), negate_by(select(is_less(h, 8), d[2], d[3]), h, 2));
  }
}

/// Coordinate brought into the period; what Cycles does to coordinates beyond a million is kept.
float wrap_coordinate(float x) {
  if (std::abs(x) < kPeriod) return x;
  if (!(std::abs(x) < kMaxCoordinate)) return 0.0f;
  return std::fmod(x, kPeriod) + (std::abs(x) >= 10.0f * kPeriod ? 0.5f : 0.0f);
}

float mixed(float a, float b, float t) { return a * (1.0f - t) + b * t; }

/// Neighbours mixed, a first: within halves of the lanes.
__m256 mixed_pairs(__m256 v, float t) {
  const float s = 1.0f - t;
  const __m256 weighed = _mm256_mul_ps(v, _mm256_setr_ps(s, t, s, t, s, t, s, t));
  return _mm256_hadd_ps(weighed, weighed);
}

/// Of the corners along x, y and z; of four dimensions those with that `last` bit.
template <size_t N>
float mixed_corners(const std::array<uint32_t, N>& cell, const Point<N>& offset, const Point<N>& blend, uint32_t last) {
  const __m256i bits[] = {_mm256_setr_epi32(0, 1, 0, 1, 0, 1, 0, 1), _mm256_setr_epi32(0, 0, 1, 1, 0, 0, 1, 1),
                          _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1), _mm256_set1_epi32(static_cast<int>(last))};
  __m256 d[N];
  const auto corner = [&](size_t i) {
    d[i] = _mm256_sub_ps(_mm256_set1_ps(offset[i]), _mm256_cvtepi32_ps(bits[i]));
    return WordLanes(cell[i]) + WordLanes(bits[i]);
  };
  const WordLanes hash = [&] {
    if constexpr (N == 2) return hash_of_words(std::array{corner(0), corner(1)});
    if constexpr (N == 3) return hash_of_words(std::array{corner(0), corner(1), corner(2)});
    if constexpr (N == 4) return hash_of_words(std::array{corner(0), corner(1), corner(2), corner(3)});
  }();
  const __m256 plane = mixed_pairs(mixed_pairs(gradients<N>(hash, d), blend[0]), blend[1]);
  const float near = _mm256_cvtss_f32(plane);
  if constexpr (N == 2) return near;
  return mixed(near, _mm_cvtss_f32(_mm256_extractf128_ps(plane, 1)), blend[std::min<size_t>(2, N - 1)]);
}

/// Gradient noise, scaled to about [-1, 1].
template <size_t N>
float signed_noise(const Point<N>& p) {
  constexpr float kScale[] = {0.25f, 0.6616f, 0.982f, 0.8344f};
  std::array<uint32_t, N> cell;
  Point<N> offset, blend;
  for (size_t i = 0; i < N; ++i) {
    const float x = wrap_coordinate(p[i]);
    const float whole = std::floor(x);
    cell[i] = static_cast<uint32_t>(static_cast<int32_t>(whole));
    const float t = x - whole;
    offset[i] = t;
    blend[i] = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
  }
  if constexpr (N == 1) {
    const auto value = [&](uint32_t bit) {
      const uint32_t hash = hash_words(cell[0] + bit);
      return negate_if(static_cast<float>(1 + (hash & 7)), hash & 8) * (offset[0] - static_cast<float>(bit));
    };
    return kScale[0] * mixed(value(0), value(1), blend[0]);
  } else {
    float result = mixed_corners<N>(cell, offset, blend, 0);
    if constexpr (N == 4) result = mixed(result, mixed_corners<N>(cell, offset, blend, 1), blend[3]);
    return kScale[N - 1] * result;
  }
}

template <size_t N>
Point<N> scaled(Point<N> p, float s) {
  for (float& x : p) x *= s;
  return p;
}

float whole_part(float detail) { return std::floor(detail); }

/// [Musgrave 1994, Texturing and Modeling, ch. 16] fractional Brownian motion; the part of an octave is blended in.
template <size_t N>
float fbm(Point<N> p, const NoiseSettings& s) {
  float amplitude = 1.0f, amplitude_sum = 0.0f, sum = 0.0f, frequency = 1.0f;
  const int octaves = static_cast<int>(s.detail);
  for (int i = 0; i <= octaves; ++i) {
    sum += amplitude * signed_noise<N>(scaled(p, frequency));
    amplitude_sum += amplitude;
    amplitude *= s.roughness;
    frequency *= s.lacunarity;
  }
  const float base = s.normalize ? 0.5f * sum / amplitude_sum + 0.5f : sum;
  const float rest = s.detail - whole_part(s.detail);
  if (rest == 0.0f) return base;
  const float more = sum + amplitude * signed_noise<N>(scaled(p, frequency));
  return lerp(base, s.normalize ? 0.5f * more / (amplitude_sum + amplitude) + 0.5f : more, rest);
}

template <size_t N>
float multifractal(Point<N> p, const NoiseSettings& s) {
  float value = 1.0f, power = 1.0f;
  const int octaves = static_cast<int>(s.detail);
  for (int i = 0; i <= octaves; ++i) {
    value *= power * signed_noise<N>(p) + 1.0f;
    power *= s.roughness;
    p = scaled(p, s.lacunarity);
  }
  const float rest = s.detail - whole_part(s.detail);
  return rest != 0.0f ? value * (rest * power * signed_noise<N>(p) + 1.0f) : value;
}

template <size_t N>
float hetero_terrain(Point<N> p, const NoiseSettings& s) {
  float power = s.roughness;
  float value = s.offset + signed_noise<N>(p);
  p = scaled(p, s.lacunarity);
  const int octaves = static_cast<int>(s.detail);
  for (int i = 1; i <= octaves; ++i) {
    value += (signed_noise<N>(p) + s.offset) * power * value;
    power *= s.roughness;
    p = scaled(p, s.lacunarity);
  }
  const float rest = s.detail - whole_part(s.detail);
  return rest != 0.0f ? value + rest * (signed_noise<N>(p) + s.offset) * power * value : value;
}

template <size_t N>
float hybrid_multifractal(Point<N> p, const NoiseSettings& s) {
  float power = 1.0f, value = 0.0f, weight = 1.0f;
  const int octaves = static_cast<int>(s.detail);
  for (int i = 0; weight > kLeastWeight && i <= octaves; ++i) {
    weight = std::min(weight, 1.0f);
    const float signal = (signed_noise<N>(p) + s.offset) * power;
    power *= s.roughness;
    value += weight * signal;
    weight *= s.gain * signal;
    p = scaled(p, s.lacunarity);
  }
  const float rest = s.detail - whole_part(s.detail);
  if (rest == 0.0f || weight <= kLeastWeight) return value;
  return value + rest * std::min(weight, 1.0f) * (signed_noise<N>(p) + s.offset) * power;
}

template <size_t N>
float ridged_multifractal(Point<N> p, const NoiseSettings& s) {
  float power = s.roughness;
  float signal = sqr(s.offset - std::abs(signed_noise<N>(p)));
  float value = signal;
  const int octaves = static_cast<int>(s.detail);
  for (int i = 1; i <= octaves; ++i) {
    p = scaled(p, s.lacunarity);
    signal = sqr(s.offset - std::abs(signed_noise<N>(p))) * clamp01(signal * s.gain);
    value += signal * power;
    power *= s.roughness;
  }
  return value;
}

template <size_t N>
float fractal_noise(const Point<N>& p, const NoiseSettings& s) {
  switch (s.type) {
    case NoiseType::FBM:
      return fbm<N>(p, s);
    case NoiseType::MULTIFRACTAL:
      return multifractal<N>(p, s);
    case NoiseType::HYBRID_MULTIFRACTAL:
      return hybrid_multifractal<N>(p, s);
    case NoiseType::RIDGED_MULTIFRACTAL:
      return ridged_multifractal<N>(p, s);
    default:
      return hetero_terrain<N>(p, s);
  }
}

/// The point moved by the seed-th of Blender's offsets, each component in [100, 200]: another, unrelated noise.
template <size_t N>
Point<N> seeded(Point<N> p, float seed) {
  if constexpr (N == 1) {
    p[0] += 100.0f + 100.0f * hash_floats(seed);
  } else {
    for (size_t i = 0; i < N; ++i) p[i] += 100.0f + 100.0f * hash_floats(seed, static_cast<float>(i));
  }
  return p;
}

template <size_t N>
Point<N> distorted(const Point<N>& p, float distortion) {
  if (distortion == 0.0f) return p;
  Point<N> result = p;
  for (size_t i = 0; i < N; ++i) result[i] += distortion * signed_noise<N>(seeded(p, static_cast<float>(i)));
  return result;
}

NoiseSettings limited(NoiseSettings s) {
  s.detail = s.detail > 0.0f ? std::min(s.detail, kMaxDetail) : 0.0f;
  s.roughness = std::max(s.roughness, 0.0f);
  return s;
}

template <size_t N>
Vec3 noise_color(const Point<N>& coordinate, const NoiseSettings& s) {
  const Point<N> p = distorted(coordinate, s.distortion);
  const float first_seed = static_cast<float>(N);  // seeds below are the distortion's
  return {fractal_noise(p, s), fractal_noise(seeded(p, first_seed), s), fractal_noise(seeded(p, first_seed + 1.0f), s)};
}

template <size_t N>
float noise_value(const Point<N>& p, const NoiseSettings& s) {
  return fractal_noise(distorted(p, s.distortion), s);
}

}  // namespace

float noise_node(Vec3 p, float w, int dimensions, const NoiseSettings& settings) {
  const NoiseSettings s = limited(settings);
  switch (dimensions) {
    case 1:
      return noise_value<1>({w}, s);
    case 2:
      return noise_value<2>({p.x, p.y}, s);
    case 3:
      return noise_value<3>({p.x, p.y, p.z}, s);
    default:
      return noise_value<4>({p.x, p.y, p.z, w}, s);
  }
}

Vec3 noise_color_node(Vec3 p, float w, int dimensions, const NoiseSettings& settings) {
  const NoiseSettings s = limited(settings);
  switch (dimensions) {
    case 1:
      return noise_color<1>({w}, s);
    case 2:
      return noise_color<2>({p.x, p.y}, s);
    case 3:
      return noise_color<3>({p.x, p.y, p.z}, s);
    default:
      return noise_color<4>({p.x, p.y, p.z, w}, s);
  }
}

float signed_noise(Vec3 p) { return signed_noise<3>({p.x, p.y, p.z}); }

}  // namespace cistern
