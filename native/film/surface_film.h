#pragma once

#include <span>

#include "film/sample_rounding.h"
#include "film/surface_passes.h"
#include "scene/scene.h"
#include "transport/seen_surface.h"

namespace cistern {

/// Sums over a pixel's samples of what their camera rays saw, as Cycles has them (kernel/film/data_passes.h). Mist,
/// Ambient Occlusion and mattes weigh each surface by what comes from it. UV and Roughness are those of the first
/// surface at least half opaque, a mean over all samples, of which those that have none count as 0; Vector a mean over
/// those that have one. What materials write themselves is added up as it is, of that first surface and all before it,
/// or of the environment. Different pixels may be added to from different threads at once; a pixel's sum is made in the
/// order of the calls.
class SurfaceFilm {
 public:
  /// Bytes per pixel: 4 (count), 4 for each channel but that of mattes, 16 for each level of mattes, 4 for Vector.
  /// `frame_size`: of the full frame in pixels, the unit of Vector.
  SurfaceFilm(const SurfacePasses& passes, int width, int height, Vec2 frame_size);

  int width() const { return width_; }
  /// One sample; its path met `seen` in this order.
  void add(uint32_t pixel, const Scene& scene, std::span<const SeenSurface> seen, const Accel* accel = nullptr);
  /// Mean of the samples, row 0 at the bottom, channels interleaved. What is seen both in clear glass and behind it
  /// counts twice, but Mist is never below 0. A level of mattes holds two ids with their shares. Throws Error for a
  /// layer that is not kept.
  std::vector<float> resolve(const SurfaceLayer& layer) const;
  size_t memory_bytes() const;

 private:
  struct Sample {
    uint32_t pixel;
    SampleRounding rounding;
  };

  float mist_of(const Camera& camera, Vec3 position) const;
  void add_occlusion(const Sample& sample, const SeenSurface& seen, const Accel* accel);
  void add_uv(const Sample& sample, const Scene& scene, const SeenSurface& seen);
  void add_motion(const Sample& sample, const Scene& scene, const SurfacePoint& point);
  void add_aovs(const Sample& sample, const Scene& scene, const SeenSurface& seen, const Accel* accel);
  void add_mattes(const Sample& sample, const Scene& scene, const SeenSurface& seen);
  std::span<const MatteShare> mattes_of(size_t kind, size_t pixel) const;
  std::vector<float> resolve_mattes(size_t kind, int level) const;

  SurfacePasses passes_;
  bool has_mattes_;
  int width_;
  Vec2 frame_size_;
  std::vector<uint32_t> samples_;
  std::vector<float> clear_view_;  // 1 - Mist
  std::vector<float> uv_;
  std::vector<float> open_;  // Ambient Occlusion
  std::vector<float> roughness_;
  std::vector<float> motion_;
  std::vector<uint32_t> moving_;          // samples of motion_: those that found a first surface
  std::vector<uint32_t> aov_hashes_;      // of their names
  std::vector<std::vector<float>> aovs_;  // sums
  std::array<std::vector<MatteShare>, kMatteKinds> mattes_;
};

}  // namespace cistern
