#include "shading/nodes_gabor.h"

#include <numbers>

#include "shading/nodes_hash.h"

// Noise of randomly placed waves: Lagae, Lefebvre, Drettakis and Dutre 2009, Procedural Noise using Sparse Gabor
// Convolution; normalised after Tavernier, Neyret, Vergne and Thollot 2019, Making Gabor Noise Fast and Normalized;
// as complex numbers after Tricard, Efremov, Zanni, Neyret, Martinez and Lefebvre 2019, Procedural Phasor Noise.

namespace cistern {
namespace {

constexpr int kImpulses = 8;  // in each cell, of random sign [Tavernier 2019]
constexpr float kLeastFrequency = 0.001f;
constexpr float kDeviations = 6.0f;  // of the noise, that fill [0, 1]: Blender's choice

struct Phasor {
  float real = 0.0f, imaginary = 0.0f;
};

/// A wave under a Gaussian that a Hann window brings to 0 at distance 1. [Lagae 2009] Eq. (6), with K = a = 1
Phasor wave(Vec3 p, Vec3 frequency, float sign) {
  const float d2 = dot(p, p);
  const float envelope = sign * std::exp(-kPi * d2) * (0.5f + 0.5f * std::cos(kPi * d2));
  const float angle = 2.0f * kPi * dot(p, frequency);
  return {envelope * std::cos(angle), envelope * std::sin(angle)};
}

/// What is random about the waves of cells in a plane, by a number for each choice.
struct Plane {
  const GaborSettings& settings;

  static float hash(Vec3 cell, float n) { return hash_floats(cell.x, cell.y, n); }
  static Vec3 centre(Vec3 cell, float n) { return {hash(cell, n), hash_floats(n, cell.x, cell.y), 0.0f}; }
  Vec3 direction(Vec3 cell, float n) const {
    const float angle = settings.angle + (hash(cell, n) - 0.5f) * kPi * (1.0f - settings.anisotropy);
    return {std::cos(angle), std::sin(angle), 0.0f};
  }
};

/// The same in space, where directions are random by both of their angles.
struct Space {
  const GaborSettings& settings;

  static float hash(Vec3 cell, float n) { return hash_floats(cell.x, cell.y, cell.z, n); }
  static float second_hash(Vec3 cell, float n) { return hash_floats(cell.z, cell.x, n, cell.y); }
  static Vec3 centre(Vec3 cell, float n) {
    return {hash(cell, n), second_hash(cell, n), hash_floats(n, cell.z, cell.y, cell.x)};
  }
  Vec3 direction(Vec3 cell, float n) const {
    const Vec3 axis = settings.axis;
    if (settings.anisotropy == 1.0f) return axis;
    const float random = kPi * (1.0f - settings.anisotropy);
    const float inclination = std::acos(std::clamp(axis.z, -1.0f, 1.0f)) + random * hash(cell, n);
    const float azimuth = std::atan2(axis.y, axis.x) + random * second_hash(cell, n);
    const float across = std::sin(inclination);
    return {across * std::cos(azimuth), across * std::sin(azimuth), std::cos(inclination)};
  }
};

/// Adds the waves of a cell at `p`, as seen from the cell's corner.
template <typename Domain>
void add_cell(Vec3 cell, Vec3 p, const Domain& domain, Phasor& sum) {
  for (int i = 0; i < kImpulses; ++i) {
    const float first = static_cast<float>(3 * i);
    const Vec3 d = p - Domain::centre(cell, first + 1.0f);
    if (dot(d, d) >= 1.0f) continue;
    const float sign = Domain::hash(cell, first + 2.0f) < 0.5f ? -1.0f : 1.0f;
    const Phasor w = wave(d, domain.settings.frequency * domain.direction(cell, first), sign);
    sum.real += w.real, sum.imaginary += w.imaginary;
  }
}

template <typename Domain>
Phasor add_cells(Vec3 p, int depth, const Domain& domain) {
  const Vec3 corner{std::floor(p.x), std::floor(p.y), depth > 0 ? std::floor(p.z) : 0.0f};
  const Vec3 local{p.x - corner.x, p.y - corner.y, depth > 0 ? p.z - corner.z : 0.0f};
  Phasor sum;
  for (int k = -depth; k <= depth; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const Vec3 offset{static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)};
        add_cell(corner + offset, local - offset, domain, sum);
      }
  return sum;
}

/// Of the real part: the waves in reach times the second moment of their signs times the integral of a squared wave of
/// high frequency. [Lagae 2009] Eq. (9)
float deviation(int dimensions) {
  const float integral = dimensions == 2 ? 0.25f : 0.25f / std::numbers::sqrt2_v<float>;
  return std::sqrt(static_cast<float>(kImpulses) * 0.5f * integral);
}

}  // namespace

GaborResult gabor_node(Vec3 p, int dimensions, const GaborSettings& settings) {
  GaborSettings s = settings;
  s.anisotropy = clamp01(s.anisotropy);
  s.frequency = std::max(s.frequency, kLeastFrequency);
  const float axis_length = length(s.axis);
  s.axis = axis_length > 0.0f ? s.axis / axis_length : Vec3{};
  const Phasor sum = dimensions == 2 ? add_cells(p, 0, Plane{s}) : add_cells(p, 1, Space{s});
  const float scale = 1.0f / (kDeviations * deviation(dimensions));
  // No hypot: that of the C library on which the extension is built, 2.35 or newer, is missing in older ones.
  const float magnitude = std::sqrt(sum.real * sum.real + sum.imaginary * sum.imaginary);
  return {0.5f + 0.5f * scale * sum.imaginary, (std::atan2(sum.imaginary, sum.real) + kPi) / (2.0f * kPi),
          scale * magnitude};
}

}  // namespace cistern
