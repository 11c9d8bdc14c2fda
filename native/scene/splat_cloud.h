#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/rgb.h"

namespace cistern {

/// An opaqueness that falls off from the middle of a splat as a Gaussian does, in object space. [Kerbl et al. 2023, 3D
/// Gaussian Splatting for Real-Time Radiance Field Rendering, eq. 4]
struct alignas(64) Gaussian {
  Vec3 middle;
  /// Of what turns offsets from the middle into standard deviations along the splat's own axes.
  Vec3 row_x, row_y, row_z;
  float opacity = 0.0f;  // in the middle; above 1 it is 1 there
  float radius = 0.0f;   // beyond that it is not there: Mesh::radii
  uint32_t splat = 0;    // its number among those that were given
  int flattest = 0;      // number of the axis whose deviation is the smallest, the first of equal ones

  Vec3 in_deviations(Vec3 offset) const { return {dot(row_x, offset), dot(row_y, offset), dot(row_z, offset)}; }
  /// Not normalised.
  Vec3 normal() const { return flattest == 0 ? row_x : flattest == 1 ? row_y : row_z; }
};

/// Splats are left out where their opacity is below this, as in Cycles.
inline constexpr float kLeastSplatOpacity = 0.01f;

/// What splats send, by spherical harmonics of the direction in which they are looked at.
struct SplatColors {
  static constexpr size_t kHarmonics = 15;  // of bands 1 to 3

  std::vector<Vec3> base;  // by key, coefficients of band 0, sRGB - 0.5
  /// By key, 15 colours each, [-1, 1] in 8 bits, band after band and from -l to l in each; empty: none has any.
  std::vector<std::array<std::array<uint8_t, 3>, kHarmonics>> harmonics;
  bool has_colour_matrix = false;
  std::array<float, 9> to_working_space{1, 0, 0, 0, 1, 0, 0, 0, 1};

  /// In the working space, at least 0; `direction`: unit, that of the ray that looks, in object space.
  Rgb radiance(size_t splat, Vec3 direction) const;
  size_t memory_bytes() const;
};

/// What is about the keys of a mesh of splats.
struct SplatCloud {
  std::vector<Gaussian> gaussians;  // by segment, a cache line for each: rays look at many
  std::shared_ptr<const SplatColors> colors;

  size_t memory_bytes() const { return gaussians.capacity() * sizeof(Gaussian) + colors->memory_bytes(); }
};

/// The same splats about other keys.
std::shared_ptr<const SplatCloud> moved(const SplatCloud& cloud, const std::vector<Vec3>& positions);

/// Whether all of both is equal, value by value; null is equal to null alone.
bool is_same_cloud(const SplatCloud* a, const SplatCloud* b);

}  // namespace cistern
