#pragma once

#include <optional>
#include <span>
#include <vector>

#include "lights/cumulative_rows.h"
#include "lights/sky_cone.h"

namespace cistern {

/// What directions the samples of an environment are for.
enum class EnvironmentDensity : uint8_t {
  COMPLETE,     // in proportion to its light: for those who may have no other samples
  COMPENSATED,  // to what exceeds its mean: for those who also sample directions by the BSDF, which finds even light
                // better, and weigh both. [Karlík et al. 2019, MIS Compensation]
};

/// Samples directions in proportion to what the environment sends from there, or to what of that exceeds the mean: a
/// latitude-longitude map of its luminance, constant on each texel, mixed with a small uniform share so that no
/// direction is impossible. Sun discs are left out of the map, which is too coarse for them, and have uniform shares of
/// their own. A constant environment, or one that is not to be importance sampled, is sampled uniformly if at all. 4
/// bytes per texel.
class EnvironmentSampler {
 public:
  /// Empty for a black environment; COMPENSATED also for one that is nearly constant or not to be importance sampled.
  static std::optional<EnvironmentSampler> build(const Scene& scene, EnvironmentDensity density);

  struct Sample {
    Vec3 direction;  // unit, away from the scene
    float pdf;       // per solid angle
  };
  Sample sample(Vec2 u) const;
  /// Density of `sample` per solid angle; positive everywhere.
  float pdf(Vec3 direction) const;

  /// Luminance that the samples are for, averaged over all directions.
  float mean_radiance() const { return mean_radiance_; }
  size_t memory_bytes() const { return rows_.memory_bytes() + texels_.memory_bytes(); }

 private:
  struct Sun {
    SkyCone cone;
    float share = 0.0f;  // of all samples
  };
  void build_map(const Scene& scene, int width, std::span<const SkyCone> suns, EnvironmentDensity density);
  void share_out(const Scene& scene, std::span<const SkyCone> suns);
  /// The samples that are not for a sun, and their density.
  Sample sample_sky(Vec2 u) const;
  float sky_pdf(Vec3 direction) const;
  /// Density of those that are, times their share.
  float suns_pdf(Vec3 direction) const;
  void build_distribution(const std::vector<float>& texels);
  /// Solid angle of a texel, in row `y`.
  float texel_solid_angle(int y) const;
  float map_pdf(int x, int y) const;

  int width_ = 0, height_ = 0;  // 0: uniform
  float mean_radiance_ = 0.0f, uniform_share_ = 0.0f;
  CumulativeRows rows_, texels_;  // of the map, in its one row; of their texels. Row 0 is around +Z.
  std::vector<float> row_cos_;    // cosine of the polar angle at the rows' edges
  std::vector<Sun> suns_;
  float sky_share_ = 1.0f;  // of samples that are not for a sun
};

}  // namespace cistern
