#pragma once

#include <memory>

#include "lights/learned_lights.h"
#include "lights/light_training.h"
#include "render/settings.h"

namespace cistern {

/// Light choice that learns, over the frames of a render: the paths of some pixels leave records, of which a new table
/// is made after 1, 2, 4, 8, ... frames. A frame's table depends on earlier frames alone, and so does whether lights
/// are chosen by it at all: where that does not pay, the light set chooses again.
class LearnedLightStage {
 public:
  /// Null unless an answer of the settings is LEARNED and there is anything to choose.
  static std::unique_ptr<LearnedLightStage> make(const Settings& settings, const Scene& scene, const Accel& accel,
                                                 const LightSet& lights);
  LearnedLightStage(const Settings& settings, const LightSet& lights, const NestedCells& cells);

  /// For PathContext; what it points to changes between frames.
  const LearnedLightUse* use() const { return &use_; }

  /// Whether the path of a pixel, by its number in the full frame, is to leave records.
  bool trains(uint32_t pixel, uint32_t frame) const;
  /// From any thread, in any order.
  void add(std::span<const LightRecord> records) { training_.add(records); }
  /// The first frame with the current table, which frames before taught.
  uint32_t learned_at() const { return learned_at_; }
  /// Whether that table is the last.
  bool has_learned() const { return is_off() || training_.is_full(); }
  /// How many frames from this one on have the same table.
  uint32_t frames_to_update(uint32_t frame) const;
  /// After all frames before `next` are finished.
  void finish_frames(uint32_t next);

  size_t memory_bytes() const { return lights_.memory_bytes() + training_.memory_bytes(); }

 private:
  bool is_off() const { return !use_.at_visible_point && !use_.at_later_vertices; }

  LearnedLights lights_;
  LightTraining training_;
  LearnedLightUse use_;
  uint64_t seed_;
  double pixels_;
  uint32_t learned_at_ = 0;
};

}  // namespace cistern
