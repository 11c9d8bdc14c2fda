#pragma once

#include "transport/path_capture.h"

namespace cistern {

/// Throughput of a path split by what the light it finds will be called: `smooth` while no vertex was rough enough to
/// reconnect (the light is seen: Emission, Environment), `direct` after exactly one scattering there, `indirect` later.
struct Throughput {
  Rgb smooth{1.0f}, direct, indirect;

  Rgb total() const { return smooth + direct + indirect; }
  /// By which roulette decides; black: nobody needs the rest of the path.
  Rgb worth() const { return total(); }
  void scale(Rgb s) { smooth *= s, direct *= s, indirect *= s; }
  void scatter(Rgb rough_weight, Rgb smooth_weight) {
    indirect = (direct + indirect) * (rough_weight + smooth_weight);
    direct = smooth * rough_weight;
    smooth = smooth * smooth_weight;
  }
  /// The same at the sample point of the first link, whose rough lobes are left to others.
  void scatter_captured(Rgb rough_weight, Rgb smooth_weight) {
    indirect = (direct + indirect) * smooth_weight;
    direct = smooth * rough_weight;
    smooth = smooth * smooth_weight;
  }
};

/// The same where light is left to others: what rough lobes of a captured sample point reflect is left out of the sums
/// and only counted in `captured`; instead `continuation` carries the throughput from each sample point on, zero before
/// it is reached.
///
/// What a path hands to others may not depend on its own colour: a sample point that a red surface sees in green light
/// is worth following for the white one beside it, and if it never were, all that count the red one among its finders
/// would miss its share. So its worth is gray wherever a link begins or ends.
struct CapturedThroughput : Throughput {
  Rgb captured;
  std::array<Rgb, kMaxPathLinks> continuation;

  Rgb total() const { return Throughput::total() + captured; }
  Rgb worth() const { return worth_; }
  void forget_color() { worth_ = Rgb(max_component(worth_)); }
  void scale(Rgb s) {
    Throughput::scale(s);
    worth_ *= s;
    captured *= s;
    for (Rgb& c : continuation) c *= s;
  }
  /// What ends here but for one link.
  void keep_only_link(size_t link) {
    captured = total();
    smooth = direct = indirect = Rgb();
    for (size_t i = 0; i < kMaxPathLinks; ++i)
      if (i != link) continuation[i] = Rgb();
  }
  /// `captures_rough`: at the sample point of the first link; `leaves_rough`: of the second, whose light is left.
  void scatter(Rgb rough_weight, Rgb smooth_weight, bool captures_rough, bool leaves_rough) {
    const Rgb weight = rough_weight + smooth_weight, reflected = direct + indirect;
    captured = captured * weight + (captures_rough ? reflected * rough_weight : Rgb());
    Throughput::scatter(rough_weight, smooth_weight);
    if (captures_rough) indirect = reflected * smooth_weight;
    continuation[0] *= leaves_rough ? smooth_weight : weight;
    continuation[1] *= weight;
    worth_ *= weight;
  }

 private:
  Rgb worth_{1.0f};
};

}  // namespace cistern
