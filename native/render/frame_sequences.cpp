#include "render/frame_sequences.h"

namespace cistern {

FrameSequences::FrameSequences(const Settings& s)
    : crosses_pixels_(s.sequence == SampleSequence::SOBOL && !s.uses_earlier_frames()),
      uses_earlier_frames_(s.uses_earlier_frames()),
      width_(static_cast<uint32_t>(s.width)),
      current_{0, 0, static_cast<uint32_t>(s.samples)} {}

void FrameSequences::begin(uint32_t frame, const Kind& kind, uint32_t length) {
  kinds_[current_kind_] = current_;
  const uint64_t tables = hash_combine(kind.lights_learned_at, kind.guides_learned_at);
  const Progress fresh{kind == Kind{} ? 0 : hash_combine(tables, kind.is_decided), 0, length};
  current_kind_ = kind;
  current_ = kinds_.try_emplace(kind, fresh).first->second;
  first_ = frame;
}

void FrameSequences::finish(uint32_t next) {
  current_.frames += next - first_;
  first_ = next;
}

SequencePoint FrameSequences::point(uint32_t x, uint32_t y, uint32_t frame) const {
  const uint32_t of_kind = current_.frames + (frame - first_);
  if (crosses_pixels_) return screen_point(x, y, {current_.sequence, of_kind, current_.length});
  const uint32_t pixel = y * width_ + x;
  return {current_.sequence == 0 ? pixel : hash_combine(current_.sequence, pixel),
          uses_earlier_frames_ ? frame : of_kind};
}

}  // namespace cistern
