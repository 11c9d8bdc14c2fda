#pragma once

#include <memory>
#include <optional>

#include "render/frame_trial.h"
#include "transport/guide_training.h"
#include "transport/path_guide.h"

namespace cistern {

/// Guided bounces over the frames of a render: the paths of some pixels leave records of where light came from, of
/// which a new table is made after 1, 2, 4, 8, ... frames. A frame's table depends on earlier frames alone, and so does
/// with AUTO whether frames are guided at all: a trial decides, once enough paths have been seen.
class GuidingStage {
 public:
  /// Null where the settings want none, or AUTO finds too few samples for a trial or samples that depend on each other.
  static std::unique_ptr<GuidingStage> make(const Settings& settings, const Scene& scene, const Accel& accel);
  GuidingStage(const Settings& settings, const NestedCells& cells);

  /// For PathContext; what it points to changes between frames.
  const GuideUse* use() const { return &use_; }

  /// Whether the path of a pixel, by its number in the full frame, is to leave records.
  bool trains(uint32_t pixel, uint32_t frame) const;
  /// From any thread, in any order.
  void add(std::span<const GuideRecord> records) { training_.add(records); }

  /// The first frame with the table that frames under way are guided by; 0: they are not guided.
  uint32_t guided_since() const { return use_.is_on ? learned_at_ : 0; }
  /// Of the frames from this one to `end`: how many are guided by the same table or, like it, by none, as far as can be
  /// told.
  uint32_t frames_of_kind(uint32_t frame, uint32_t end) const;
  /// Whether a trial has told before this frame whether frames are guided.
  bool is_decided(uint32_t frame) const { return trial_ && frame >= trial_->end(); }

  /// Whether a trial is still to be made or under way, for which every pixel counts.
  bool awaits_trial(uint32_t frame) const { return trial_ && frame < trial_->end(); }

  /// Whether the pixels of this frame are to be observed.
  bool observes(uint32_t frame) const { return trial_ && trial_->is_running(frame); }
  /// A pixel's luminance; of each pixel once, from any thread.
  void observe(int x, int y, float luminance) { trial_->add(x, y, luminance); }

  /// How many frames from this one on are alike.
  uint32_t frames_to_update(uint32_t frame) const;
  /// After all frames before `next` are finished.
  void finish_frames(uint32_t next);

  size_t memory_bytes() const { return guide_.table().memory_bytes() + training_.memory_bytes(); }

 private:
  bool has_lost(uint32_t frame) const { return is_decided(frame) && !trial_->has_won(); }
  bool may_guide(uint32_t frame) const;

  PathGuide guide_;
  GuideTraining training_;
  GuideUse use_;
  std::optional<FrameTrial> trial_;  // with AUTO
  uint64_t seed_;
  double pixels_;
  uint32_t learned_at_ = 0;  // first frame with the current table
};

}  // namespace cistern
