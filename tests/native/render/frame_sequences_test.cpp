#include "render/frame_sequences.h"

#include <gtest/gtest.h>

#include <set>

namespace cistern::test {
namespace {

Settings settings(int samples, bool uses_earlier_frames = false) {
  Settings s;
  s.width = 64;
  s.samples = samples;
  if (uses_earlier_frames) {
    s.indirect = IndirectAnswer::WORLD_REUSE;
    s.world_paths.spatial_reuse = true;
  }
  return s;
}

bool are_equal(SequencePoint a, SequencePoint b) { return a.sequence == b.sequence && a.point == b.point; }

/// As if no frame of another kind lay between.
TEST(FrameSequences, FramesOfAKindTakeConsecutivePoints) {
  const FrameSequences::Kind plain{}, guided{0, 4};
  FrameSequences turns(settings(16)), plain_alone(settings(16)), guided_alone(settings(16));
  plain_alone.begin(0, plain, 16);
  guided_alone.begin(0, guided, 4);
  for (uint32_t frame = 0; frame < 12; ++frame) {
    const bool is_guided = frame >= 4 && frame % 2 == 0;
    turns.begin(frame, is_guided ? guided : plain, is_guided ? 4 : 16 - frame);
    const uint32_t before = frame < 4 ? 0 : (frame - 3) / 2;  // guided ones
    const SequencePoint alone = is_guided ? guided_alone.point(3, 5, before) : plain_alone.point(3, 5, frame - before);
    EXPECT_TRUE(are_equal(turns.point(3, 5, frame), alone)) << frame;
    turns.finish(frame + 1);
  }
}

TEST(FrameSequences, BatchesGoOnWhereOthersEnded) {
  FrameSequences one(settings(16)), several(settings(16));
  one.begin(0, {}, 16);
  for (uint32_t frame = 0; frame < 16; frame += 4) {
    several.begin(frame, {}, 16 - frame);
    for (uint32_t i = frame; i < frame + 4; ++i) EXPECT_TRUE(are_equal(one.point(1, 2, i), several.point(1, 2, i)));
    several.finish(frame + 4);
  }
}

/// Points of one sequence depend on each other: whatever was learned or decided must not be used with them.
TEST(FrameSequences, WhatWasLearnedOrDecidedStartsANewSequence) {
  for (const bool uses_earlier_frames : {false, true}) {
    FrameSequences frames(settings(16, uses_earlier_frames));
    std::set<uint64_t> sequences;
    for (const FrameSequences::Kind kind :
         {FrameSequences::Kind{}, {1}, {2}, {0, 1}, {0, 2}, {2, 2}, {0, 0, true}, {2, 2, true}}) {
      frames.begin(8, kind, 8);
      EXPECT_TRUE(sequences.insert(frames.point(3, 5, 8).sequence).second);
    }
  }
}

TEST(FrameSequences, PixelsHaveTheirOwnWhereAskedFor) {
  Settings alone = settings(16);
  alone.sequence = SampleSequence::PIXEL_SOBOL;
  FrameSequences frames(alone);
  frames.begin(0, {}, 16);
  EXPECT_TRUE(are_equal(frames.point(3, 5, 2), {5 * 64 + 3, 2}));
  EXPECT_NE(frames.point(3, 5, 2).sequence, frames.point(4, 5, 2).sequence);
}

/// Where paths are traced again, by pixel and frame.
TEST(FrameSequences, PixelsHaveTheirOwnWhereEarlierFramesAreUsed) {
  FrameSequences frames(settings(16, true));
  frames.begin(40, {}, 16);
  EXPECT_TRUE(are_equal(frames.point(3, 5, 42), {5 * 64 + 3, 42}));
}

}  // namespace
}  // namespace cistern::test
