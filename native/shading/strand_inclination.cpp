#include "shading/strand_inclination.h"

#include "base/angle.h"

namespace cistern {
namespace {

/// log of the modified Bessel function of order 0. [Abramowitz and Stegun 1964, 9.8.1 and 9.8.2]
float log_bessel_i0(float x) {
  if (x > 3.75f) {
    const float t = 3.75f / x;
    const float series =
        0.39894228f +
        t * (0.01328592f +
             t * (0.00225319f +
                  t * (-0.00157565f +
                       t * (0.00916281f +
                            t * (-0.02057706f + t * (0.02635537f + t * (-0.01647633f + t * 0.00392377f)))))));
    return x - 0.5f * std::log(x) + std::log(series);
  }
  const float t = sqr(x / 3.75f);
  return std::log(
      1.0f +
      t * (3.5156229f + t * (3.0899424f + t * (1.2067492f + t * (0.2659732f + t * (0.0360768f + t * 0.0045813f))))));
}

}  // namespace

float longitudinal_density(Inclination i, Inclination o, float v) {
  const float exponent = log_bessel_i0(i.cosine * o.cosine / v) - i.sine * o.sine / v - 1.0f / v;
  return std::exp(exponent) / (v * (1.0f - std::exp(-2.0f / v)));  // 1 / (2 v sinh(1 / v)), e^(1 / v) taken out
}

Inclination sample_longitudinal(Inclination o, float v, float u_height, float u_turns) {
  const float height = 1.0f + v * std::log(std::max(u_height + (1.0f - u_height) * std::exp(-2.0f / v), 1e-30f));
  const float sine = -height * o.sine + cosine_of(height) * sine_cosine_of_turns(u_turns).cosine * o.cosine;
  return {sine, cosine_of(sine)};
}

}  // namespace cistern
