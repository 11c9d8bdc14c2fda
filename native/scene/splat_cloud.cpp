#include "scene/splat_cloud.h"

#include <cstring>

#include "base/srgb.h"

namespace cistern {
namespace {

/// Real spherical harmonics of bands 1 to 3, with the signs that splats are trained with. [Sloan 2010, Stupid Spherical
/// Harmonics Tricks, app. A2]
std::array<float, SplatColors::kHarmonics> harmonics_at(Vec3 d) {
  const float x = d.x, y = d.y, z = d.z, x2 = x * x, y2 = y * y, z2 = z * z;
  constexpr float k1 = 0.48860251f;                                                         // sqrt(3 / 4 pi)
  constexpr float k2 = 1.0925484f, k20 = 0.31539157f, k22 = 0.5462742f;                     // sqrt(15 / 4 pi), ...
  constexpr float k33 = 0.5900436f, k32 = 1.4453057f, k31 = 0.4570458f, k30 = 0.37317633f;  // sqrt(35 / 32 pi), ...
  return {-k1 * y,
          k1 * z,
          -k1 * x,
          k2 * x * y,
          -k2 * y * z,
          k20 * (3.0f * z2 - 1.0f),
          -k2 * x * z,
          k22 * (x2 - y2),
          -k33 * y * (3.0f * x2 - y2),
          2.0f * k32 * x * y * z,
          -k31 * y * (5.0f * z2 - 1.0f),
          k30 * z * (5.0f * z2 - 3.0f),
          -k31 * x * (5.0f * z2 - 1.0f),
          k32 * z * (x2 - y2),
          -k33 * x * (x2 - 3.0f * y2)};
}

template <class T>
bool has_same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

}  // namespace

Rgb SplatColors::radiance(size_t splat, Vec3 direction) const {
  constexpr float k0 = 0.2820948f;  // sqrt(1 / 4 pi)
  Vec3 sum = k0 * base[splat] + Vec3{0.5f, 0.5f, 0.5f};
  if (!harmonics.empty()) {
    const std::array<float, kHarmonics> basis = harmonics_at(direction);
    for (size_t i = 0; i < kHarmonics; ++i) {
      const auto& c = harmonics[splat][i];
      const auto value = [](uint8_t byte) { return static_cast<float>(byte) * (2.0f / 255.0f) - 1.0f; };
      sum = sum + basis[i] * Vec3{value(c[0]), value(c[1]), value(c[2])};
    }
  }
  const Rgb linear{srgb_to_linear_exact(sum.x), srgb_to_linear_exact(sum.y), srgb_to_linear_exact(sum.z)};
  return has_colour_matrix ? max(multiply(to_working_space, linear), Rgb(0.0f)) : linear;
}

size_t SplatColors::memory_bytes() const {
  return base.capacity() * sizeof(Vec3) + harmonics.capacity() * sizeof(harmonics[0]);
}

std::shared_ptr<const SplatCloud> moved(const SplatCloud& cloud, const std::vector<Vec3>& positions) {
  auto result = std::make_shared<SplatCloud>(cloud);
  for (Gaussian& gaussian : result->gaussians) gaussian.middle = positions[gaussian.splat];
  return result;
}

bool is_same_cloud(const SplatCloud* a, const SplatCloud* b) {
  if (a == b || !a || !b) return a == b;
  const SplatColors &x = *a->colors, &y = *b->colors;
  return has_same_bits(a->gaussians, b->gaussians) && has_same_bits(x.base, y.base) && x.harmonics == y.harmonics &&
         x.has_colour_matrix == y.has_colour_matrix && x.to_working_space == y.to_working_space;
}

}  // namespace cistern
