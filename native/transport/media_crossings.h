#pragma once

#include <algorithm>
#include <span>

#include "accel/accel.h"
#include "transport/media_stack.h"

// Where rays cross the boundaries of media. Boundaries often lie in one plane with another, or with a surface: boxes of
// fog that stand side by side, or on a floor. Which of them a ray meets first is then a matter of rounding, and a ray
// that went on behind one might start behind the others, too. So
// - a ray that crosses a boundary goes on from a little before it, and meets all but the triangles that it has crossed
//   (of more at one place than a MediaStack holds, it goes on behind);
// - what begins and ends within rounding of a place counts together, whatever the order;
// - a ray that leaves a surface crosses what it is moved past on its way off it, see Media::leave.
// Entering a medium that a ray is in already, and leaving one that it is not in, change nothing: crossing twice is
// crossing once.

namespace cistern {

/// Media that are entered and left at one place. Those that are left as often as they are entered stay as they are, as
/// where two parts of a mesh touch.
class MediaCrossings {
 public:
  struct Crossing {
    MediaStack::Entry medium;
    int net = 0;  // above 0: it is entered
  };
  const Crossing* begin() const { return crossings_.data(); }
  const Crossing* end() const { return crossings_.data() + count_; }
  void clear() { count_ = 0; }

  void add(MediaStack::Entry medium, bool is_entered) {
    size_t i = 0;
    while (i < count_ && !(crossings_[i].medium == medium)) ++i;
    if (i == crossings_.size()) return;
    if (i == count_) crossings_[count_++] = {medium, 0};
    crossings_[i].net += is_entered ? 1 : -1;
  }
  void apply(MediaStack& stack) const {
    for (const auto& [medium, net] : *this)
      if (net < 0) stack.leave(medium);
    for (const auto& [medium, net] : *this)
      if (net > 0) stack.enter(medium);
  }

 private:
  size_t count_ = 0;
  std::array<Crossing, HitList::kCapacity> crossings_;
};

/// The boundaries that a ray has crossed on its straight way so far.
class BoundaryTrail {
 public:
  /// Of a ray that starts anew.
  void clear() { passed_count_ = here_count_ = 0, begin_ = 0.0f; }

  /// The latest of them: more than lie at one place.
  std::span<const TriangleId> passed() const { return {passed_.data(), std::min(passed_count_, passed_.size())}; }
  /// Where the last one is, along the ray from its origin; 0 without any.
  float begin() const { return begin_; }
  /// Whether another at `distance` is at the same place, within `near`.
  bool is_same_place(float distance, float near) const { return passed_count_ > 0 && distance - begin_ <= near; }

  /// `is_same_place` as above.
  void pass(TriangleId triangle, bool is_same_place) {
    passed_[passed_count_++ % passed_.size()] = triangle;
    here_count_ = is_same_place ? here_count_ + 1 : 1;
  }
  /// Whether more of them at this place would be met again.
  bool is_full() const { return here_count_ >= passed_.size(); }
  /// The ray goes on from `begin` before the last one.
  void go_on_from(float begin) { begin_ = begin; }
  void cross(MediaStack::Entry medium, bool is_entered, bool is_same_place, MediaStack& stack) {
    if (is_same_place) {
      stack = before_;
    } else {
      before_ = stack;
      here_.clear();
    }
    here_.add(medium, is_entered);
    here_.apply(stack);
  }

 private:
  size_t passed_count_ = 0, here_count_ = 0;
  std::array<TriangleId, 16> passed_;
  float begin_ = 0.0f;
  MediaStack before_;  // as the ray came to the place where it is
  MediaCrossings here_;
};

}  // namespace cistern
