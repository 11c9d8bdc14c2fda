#include "shading/nodes_noise.h"

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

template <size_t N>
uint32_t hash_cell(const std::array<uint32_t, N>& c) {
  if constexpr (N == 1) return hash_words(c[0]);
  if constexpr (N == 2) return hash_words(c[0], c[1]);
  if constexpr (N == 3) return hash_words(c[0], c[1], c[2]);
  if constexpr (N == 4) return hash_words(c[0], c[1], c[2], c[3]);
}

float negate_if(float v, uint32_t condition) { return condition != 0 ? -v : v; }

/// Dot product of the offset with one of a few lattice directions.
template <size_t N>
float gradient(uint32_t hash, const Point<N>& d) {
  if constexpr (N == 1) {
    return negate_if(static_cast<float>(1 + (hash & 7)), hash & 8) * d[0];
  } else if constexpr (N == 2) {
    const uint32_t h = hash & 7;
    return negate_if(h < 4 ? d[0] : d[1], h & 1) + negate_if(2.0f * (h < 4 ? d[1] : d[0]), h & 2);
  } else if constexpr (N == 3) {
    const uint32_t h = hash & 15;
    const float other = h == 12 || h == 14 ? d[0] : d[2];
    return negate_if(h < 8 ? d[0] : d[1], h & 1) + negate_if(h < 4 ? d[1] : other, h & 2);
  } else {
    const uint32_t h = hash & 31;
    return negate_if(h < 24 ? d[0] : d[1], h & 1) + negate_if(h < 16 ? d[1] : d[2], h & 2) +
           negate_if(h < 8 ? d[2] : d[3], h & 4);
  }
}

/// Coordinate brought into the period; what Cycles does to coordinates beyond a million is kept.
float wrap_coordinate(float x) {
  if (std::abs(x) < kPeriod) return x;
  if (!(std::abs(x) < kMaxCoordinate)) return 0.0f;
  return std::fmod(x, kPeriod) + (std::abs(x) >= 10.0f * kPeriod ? 0.5f : 0.0f);
}

/// Gradient noise, scaled to about [-1, 1].
template <size_t N>
float signed_noise(const Point<N>& p) {
  constexpr float kScale[] = {0.25f, 0.6616f, 0.982f, 0.8344f};
  constexpr size_t kCorners = size_t{1} << N;
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
  std::array<float, kCorners> value;
  for (size_t corner = 0; corner < kCorners; ++corner) {
    std::array<uint32_t, N> c;
    Point<N> d;
    for (size_t i = 0; i < N; ++i) {
      const uint32_t bit = (corner >> i) & 1u;
      c[i] = cell[i] + bit;
      d[i] = offset[i] - static_cast<float>(bit);
    }
    value[corner] = gradient<N>(hash_cell<N>(c), d);
  }
  size_t count = kCorners;
  for (size_t i = 0; i < N; ++i) {
    count /= 2;
    for (size_t k = 0; k < count; ++k) value[k] = value[2 * k] * (1.0f - blend[i]) + value[2 * k + 1] * blend[i];
  }
  return kScale[N - 1] * value[0];
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
