#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "shading/nodes_math.h"

namespace cistern {
namespace {

// In 64 bits, where no sum or product of two numbers of 32 bits overflows.
using Integer = int64_t;

/// 0 for what is no number; the nearest for what is out of range.
Integer whole_part(float x) {
  if (std::isnan(x)) return 0;
  constexpr double kLeast = std::numeric_limits<int32_t>::min(), kMost = std::numeric_limits<int32_t>::max();
  return static_cast<Integer>(std::clamp(static_cast<double>(x), kLeast, kMost));
}

Integer wrapped(Integer a) { return static_cast<int32_t>(static_cast<uint32_t>(a)); }

Integer quotient(Integer a, Integer b) { return b != 0 ? a / b : 0; }

Integer floored_quotient(Integer a, Integer b) {
  if (b == 0) return 0;
  return a / b - (a % b != 0 && (a < 0) != (b < 0) ? 1 : 0);
}

/// Halves are rounded away from 0.
Integer rounded_quotient(Integer a, Integer b) {
  const Integer size = quotient(2 * std::abs(a) + std::abs(b), 2 * std::abs(b));
  return (a < 0) == (b < 0) ? size : -size;
}

Integer power(Integer base, Integer exponent) {
  if (exponent < 0) {
    if (base != 1 && base != -1) return 0;
    exponent = -exponent;
  }
  Integer result = 1;
  for (; exponent != 0; exponent >>= 1) {
    if ((exponent & 1) != 0) result = wrapped(result * base);
    base = wrapped(base * base);
  }
  return result;
}

Integer integer_math(int operation, Integer a, Integer b, Integer c) {
  switch (operation) {
    case 0:
      return a + b;
    case 1:
      return a - b;
    case 2:
      return a * b;
    case 3:
      return quotient(a, b);
    case 4:
      return wrapped(a * b) + c;
    case 5:
      return std::abs(a);
    case 6:
      return -a;
    case 7:
      return power(a, b);
    case 8:
      return std::min(a, b);
    case 9:
      return std::max(a, b);
    case 10:
      return (a > 0) - (a < 0);
    case 11:
      return rounded_quotient(a, b);
    case 12:
      return floored_quotient(a, b);
    case 13:
      return -floored_quotient(a, -b);
    case 14:
      return b != 0 ? a - floored_quotient(a, b) * b : 0;
    case 15:
      return b != 0 ? a % b : 0;
    case 16:
      return std::gcd(a, b);
    default:
      return a == 0 || b == 0 ? 0 : std::abs(a) / std::gcd(a, b) * std::abs(b);
  }
}

}  // namespace

float integer_math_node(int operation, float a, float b, float c) {
  return static_cast<float>(wrapped(integer_math(operation, whole_part(a), whole_part(b), whole_part(c))));
}

}  // namespace cistern
