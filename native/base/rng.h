#pragma once

#include "base/hash.h"
#include "base/vec.h"

namespace cistern {

/// Counter-based random numbers: the state is (key, counter), so a stream can be replayed from its key and
/// results do not depend on threads. Each stream of a (seed, pixel, frame) has its own key.
class Rng {
 public:
  Rng(uint64_t seed, uint32_t pixel, uint32_t frame, uint32_t stream)
      : key_(hash_combine(hash_combine(mix_bits(seed), (uint64_t{pixel} << 32) | frame), stream)) {}

  uint32_t next_uint32() { return static_cast<uint32_t>(mix_bits(key_ + 0x9e3779b97f4a7c15ull * ++counter_) >> 32); }
  float next_float() { return to_unit_float(next_uint32()); }
  /// With the 32 bits of one number, for choices among many.
  double next_double() { return next_uint32() * 0x1p-32; }
  Vec2 next_vec2() {
    const float x = next_float();
    return {x, next_float()};
  }

 private:
  uint64_t key_;
  uint64_t counter_ = 0;
};

}  // namespace cistern
