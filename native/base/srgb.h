#pragma once

#include <algorithm>
#include <cmath>

namespace cistern {

/// The linear value of an encoded one; beyond 1 the curve goes on, below 0 it is 0, and so is what is no number.
/// [IEC 61966-2-1]
inline float srgb_to_linear_exact(float c) {
  if (!(c >= 0.04045f)) return std::max(0.0f, c) * (1.0f / 12.92f);
  return std::pow((c + 0.055f) * (1.0f / 1.055f), 2.4f);
}

/// Its inverse.
inline float linear_to_srgb_exact(float c) {
  if (!(c >= 0.0031308f)) return std::max(0.0f, c) * 12.92f;
  return 1.055f * std::pow(c, 1.0f / 2.4f) - 0.055f;
}

}  // namespace cistern
