#include "render/learned_light_stage.h"

#include "render/training_paths.h"
#include "transport/camera_ray.h"

namespace cistern {
namespace {

constexpr uint32_t kTrainingStream = 0x6c726e64;
/// After so many frames learning must have shown that it pays: light samples whose mean square is smaller by this
/// factor than by the light set's choice make up for what the choice costs. (Squares hold the squared mean as well, so
/// the factor between variances is larger.)
constexpr uint32_t kTrialFrames = 16;
constexpr double kLeastGain = 1.1;

/// A small lamp of a few triangles is seen whole or not at all: nothing to learn.
constexpr uint32_t kFewEmitters = 8;

bool has_choice(const LightSet& lights) {
  const auto count = static_cast<uint32_t>(lights.emitter_count());
  if (count > kFewEmitters) return true;
  for (uint32_t i = 1; i < count; ++i)
    if (lights.place(i).object != lights.place(0).object) return true;
  return false;
}

}  // namespace

std::unique_ptr<LearnedLightStage> LearnedLightStage::make(const Settings& s, const Scene& scene, const Accel& accel,
                                                           const LightSet& lights) {
  const bool is_asked_for = s.direct == DirectAnswer::LEARNED || s.secondary == SecondaryAnswer::LEARNED;
  if (!is_asked_for || !has_choice(lights)) return nullptr;
  const PixelFootprint pixel = pixel_footprint(scene.camera, s.width, s.height);
  const NestedCells cells({}, accel.bounds(), scene.camera.camera_to_world.translation, pixel.angle, pixel.size);
  return std::make_unique<LearnedLightStage>(s, lights, cells);
}

LearnedLightStage::LearnedLightStage(const Settings& settings, const LightSet& lights, const NestedCells& cells)
    : lights_(lights, cells),
      use_{&lights_, settings.direct == DirectAnswer::LEARNED, settings.secondary == SecondaryAnswer::LEARNED},
      seed_(settings.seed),
      pixels_(static_cast<double>(settings.region.width) * settings.region.height) {}

bool LearnedLightStage::trains(uint32_t pixel, uint32_t frame) const {
  if (has_learned()) return false;
  return is_training_path(seed_, pixel, frame, kTrainingStream, pixels_, learned_at_);
}

uint32_t LearnedLightStage::frames_to_update(uint32_t frame) const { return frames_to_next_update(frame); }

void LearnedLightStage::finish_frames(uint32_t next) {
  if (!std::has_single_bit(next) || has_learned()) return;
  lights_.set_table(training_.learn());
  learned_at_ = next;
  if (next == kTrialFrames && gain(training_.statistics()) < kLeastGain)
    use_.at_visible_point = use_.at_later_vertices = false;
}

}  // namespace cistern
