#pragma once

#include <cmath>
#include <cstdint>

#include "base/hash.h"
#include "base/rgb.h"

namespace cistern {

/// How a pixel's sample is rounded as it is added to sums in single precision. To the nearest number, samples that are
/// alike err alike, and a sum of n of them by up to n / 2^25 of itself (of 0.1, by 0.06 % at 65,536 samples and by 1 %
/// at a million). So late ones go up or down by chance, and are right on average. [Forsythe 1950, Round-off Errors in
/// Numerical Integration on Automatic Machinery]
class SampleRounding {
 public:
  /// `sample`: how many the pixel has had before.
  SampleRounding(uint32_t pixel, uint32_t sample)
      : u_(sample < kLate ? kNearest : to_unit_float(static_cast<uint32_t>(mix_bits(uint64_t{pixel} << 32 | sample)))) {
  }

  void add(float value, float& sum) const {
    if (u_ == kNearest)
      sum += value;
    else
      sum = round(double{sum} + double{value});
  }
  void add(Rgb value, Rgb& sum) const {
    add(value.r, sum.r);
    add(value.g, sum.g);
    add(value.b, sum.b);
  }

 private:
  static constexpr uint32_t kLate = 4096;  // before these, the error is below 1.2e-4
  static constexpr float kNearest = -1.0f;

  float round(double exact) const {
    const auto nearest = static_cast<float>(exact);
    const double rest = exact - double{nearest};
    const float other = std::nextafter(nearest, rest > 0.0 ? INFINITY : -INFINITY);
    return double{u_} * std::abs(double{other} - double{nearest}) < std::abs(rest) ? other : nearest;
  }

  float u_;
};

}  // namespace cistern
