#pragma once

#include <map>

#include "render/settings.h"
#include "transport/screen_points.h"

namespace cistern {

/// Which points of which sequences the frames of a render take. Frames that act on what earlier ones found start a new
/// sequence, since points of one depend on each other; frames of a kind go on with theirs as if there were no others.
class FrameSequences {
 public:
  explicit FrameSequences(const Settings& settings);

  /// What tells the sequences of frames apart: the first frames with the tables that they look at (0: none), and
  /// whether a trial has been decided.
  struct Kind {
    uint32_t lights_learned_at = 0, guides_learned_at = 0;
    bool is_decided = false;
    auto operator<=>(const Kind&) const = default;  // NOLINT(modernize-use-nullptr)
  };

  /// Frames from `frame` on are of this kind, of which there will be about `length`.
  void begin(uint32_t frame, const Kind& kind, uint32_t length);
  /// After all frames before `next` are finished.
  void finish(uint32_t next);

  /// Of a pixel of the full frame, in a frame under way. Where samples are kept for later frames, pixels have sequences
  /// of their own and frames the points of their numbers: samples are traced again by these.
  SequencePoint point(uint32_t x, uint32_t y, uint32_t frame) const;

 private:
  struct Progress {
    uint64_t sequence;
    uint32_t frames, length;
  };

  bool crosses_pixels_, uses_earlier_frames_;
  uint32_t width_;
  uint32_t first_ = 0;              // of the frames under way
  std::map<Kind, Progress> kinds_;  // as they were when others began
  Kind current_kind_;
  Progress current_;
};

}  // namespace cistern
