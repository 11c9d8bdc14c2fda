#pragma once

#include "render/noise_comparison.h"
#include "render/render_world.h"
#include "render/shared_pixels.h"

namespace cistern {

/// Whether CELL_SHARED is worth its time in this scene, and at which vertices. Before the frames it is for, blocks from
/// all over the picture are rendered a few times with and without, from the same random numbers. Where paths alone
/// surely make less noise for their time, nothing is shared, and samples that were to ask several lights ask one if
/// that is enough; and unless light is rare, bounces are not guided where that was to be tried. These samples go
/// nowhere else. So whatever is decided, no sample of the picture depends on another, and no clock is asked: with a
/// given number of samples pictures are the same for each seed.
///
/// The noise of boxes of 4 x 4 pixels decides, between what single pixels show and what a glance does; of pictures that
/// go to a denoiser its scale decides, as where next vertices alone share. Lights are chosen as if nothing had been
/// learned.
class SharingTrial {
 public:
  /// Whether these settings want a trial, and the picture is so large that it hardly adds to the time.
  static bool is_for(const Settings& settings);

  SharingTrial(const Settings& settings, std::shared_ptr<const Scene> scene, std::shared_ptr<const Accel> accel,
               std::shared_ptr<const LightSet> lights, std::shared_ptr<const CausticGuide> caustics);

  /// The settings with what has won; as they were if stopped.
  Settings decide(const StopCondition& stop);

 private:
  enum Way : size_t { PLAIN, NEXT_VERTICES, AS_ASKED, COUNT };

  static double cost(Way way);
  double plain_variance(double sum_over_boxes) const;
  NoiseComparison comparison_of(size_t ways) const;
  /// Fills `luminance_`; false if stopped.
  bool trace_plainly(const RenderWorld& world, uint32_t frame, const StopCondition& stop);
  /// Whether plain samples, of this variance, need not ask several lights.
  bool is_one_light_enough(double variance, const StopCondition& stop);
  bool share(uint32_t frame, const StopCondition& stop);

  const Settings settings_;
  const RenderWorld world_;
  const PixelBlocks pixels_;
  SharedPixels shared_;
  std::vector<float> luminance_, without_visible_;  // by pixel; the second without what visible points were handed
  NoiseComparison noise_;
};

}  // namespace cistern
