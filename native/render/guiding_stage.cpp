#include "render/guiding_stage.h"

#include "render/training_paths.h"
#include "transport/camera_ray.h"

namespace cistern {
namespace {

constexpr uint32_t kTrainingStream = 0x67756964;
/// Guided frames take 1.3 to 1.6 times as long as others: where samples are shared, more of them are worth it.
constexpr double kCost = 1.5;
/// A trial comes when guides know enough to tell whether they will pay: of so many paths, and no earlier than this.
constexpr double kPathsBeforeTrial = 400'000.0;
constexpr uint32_t kEarliestTrial = 4;

/// The first frame of a trial: a power of two, as then there is a new table.
uint32_t trial_start(const Settings& s) {
  const double pixels = std::min(static_cast<double>(s.region.width) * s.region.height, kPathsBeforeTrial);
  return std::max(kEarliestTrial, std::bit_ceil(static_cast<uint32_t>(std::ceil(kPathsBeforeTrial / pixels))));
}

/// Half of the samples must be left for what the trial decides.
bool has_time_for_trial(const Settings& s) {
  return s.samples >= 2 * static_cast<int>(trial_start(s) + FrameTrial::kFrames);
}

}  // namespace

std::unique_ptr<GuidingStage> GuidingStage::make(const Settings& s, const Scene& scene, const Accel& accel) {
  if (s.guiding == Guiding::OFF) return nullptr;
  if (s.guiding == Guiding::AUTO && (s.uses_earlier_frames() || !has_time_for_trial(s))) return nullptr;
  const PixelFootprint pixel = pixel_footprint(scene.camera, s.width, s.height);
  const NestedCells cells({}, accel.bounds(), scene.camera.camera_to_world.translation, pixel.angle, pixel.size);
  return std::make_unique<GuidingStage>(s, cells);
}

GuidingStage::GuidingStage(const Settings& s, const NestedCells& cells)
    : guide_(cells),
      use_{&guide_, false},
      seed_(s.seed),
      pixels_(static_cast<double>(s.region.width) * s.region.height) {
  if (s.guiding == Guiding::AUTO) trial_.emplace(s.region, trial_start(s), kCost);
}

bool GuidingStage::trains(uint32_t pixel, uint32_t frame) const {
  if (training_.is_full() || has_lost(frame)) return false;
  return is_training_path(seed_, pixel, frame, kTrainingStream, pixels_, learned_at_);
}

bool GuidingStage::may_guide(uint32_t frame) const {
  if (!trial_) return true;
  if (frame < trial_->first()) return false;
  return trial_->is_running(frame) ? trial_->tries(frame) : trial_->has_won();
}

uint32_t GuidingStage::frames_of_kind(uint32_t frame, uint32_t end) const {
  if (use_.is_on && !training_.is_full()) end = std::min(end, frame + frames_to_next_update(frame));
  if (!trial_ || is_decided(frame)) return end - frame;
  end = std::min(end, trial_->end());
  const uint32_t turns = std::clamp(trial_->first(), frame, end);  // both kinds take turns from there on
  return (turns - frame) + (end - turns + 1) / 2;
}

uint32_t GuidingStage::frames_to_update(uint32_t frame) const {
  if (observes(frame)) return 1;
  return frames_to_next_update(frame);
}

void GuidingStage::finish_frames(uint32_t next) {
  if (trial_) trial_->finish_frame(next - 1);
  if (has_lost(next)) {
    guide_.set_table({});
    training_.clear();
  } else if (std::has_single_bit(next) && !training_.is_full()) {
    guide_.set_table(training_.learn());
    learned_at_ = next;
  }
  use_.is_on = may_guide(next) && !guide_.table().is_empty();
}

}  // namespace cistern
