#include "shading/nodes_math.h"

#include <cfloat>

namespace cistern {
namespace {

float safe_power(float base, float exponent) {
  if (exponent == 0.0f) return 1.0f;
  if (base == 0.0f) return 0.0f;
  if (base < 0.0f && exponent != std::trunc(exponent)) return 0.0f;
  return std::pow(base, exponent);
}

float safe_logarithm(float a, float base) {
  if (a <= 0.0f || base <= 0.0f) return 0.0f;
  return safe_divide(std::log(a), std::log(base));
}

/// Polynomial smooth minimum with cubic blend of width k.
float smooth_minimum(float a, float b, float k) {
  if (k == 0.0f) return std::min(a, b);
  const float h = std::max(k - std::abs(a - b), 0.0f) / k;
  return std::min(a, b) - h * h * h * k * (1.0f / 6.0f);
}

float fraction(float a) { return a - std::floor(a); }

/// Scalar Wrap and vector Wrap differ only where the range is empty: both return the lower end.
float wrap(float value, float upper, float lower) {
  const float range = upper - lower;
  return range != 0.0f ? value - range * std::floor((value - lower) / range) : lower;
}

float ping_pong(float a, float b) { return b != 0.0f ? std::abs(fraction((a - b) / (2.0f * b)) * b * 2.0f - b) : 0.0f; }

float sign(float a) { return a > 0.0f ? 1.0f : (a < 0.0f ? -1.0f : 0.0f); }

float modulo(float a, float b) { return b != 0.0f ? std::fmod(a, b) : 0.0f; }

float snap(float a, float b) { return std::floor(safe_divide(a, b)) * b; }

template <typename F>
Vec3 each(F f, Vec3 a) {
  return {f(a.x), f(a.y), f(a.z)};
}
template <typename F>
Vec3 each(F f, Vec3 a, Vec3 b) {
  return {f(a.x, b.x), f(a.y, b.y), f(a.z, b.z)};
}

/// Direction after refraction of `incident` (travelling, not leaving), or zero at total internal reflection.
Vec3 refract_incident(Vec3 incident, Vec3 n, float eta) {
  const float cos_incident = dot(n, incident);
  const float k = 1.0f - eta * eta * (1.0f - cos_incident * cos_incident);
  if (k < 0.0f) return {};
  return eta * incident - (eta * cos_incident + std::sqrt(k)) * n;
}

Vec3 project(Vec3 v, Vec3 onto) {
  const float l2 = length_squared(onto);
  return l2 != 0.0f ? (dot(v, onto) / l2) * onto : Vec3{};
}

float trigonometry(int operation, float a, float b) {
  switch (operation) {
    case 29:
      return std::sin(a);
    case 30:
      return std::cos(a);
    case 31:
      return std::tan(a);
    case 32:
      return std::asin(std::clamp(a, -1.0f, 1.0f));
    case 33:
      return std::acos(std::clamp(a, -1.0f, 1.0f));
    case 34:
      return std::atan(a);
    case 35:
      return a == 0.0f && b == 0.0f ? 0.0f : std::atan2(a, b);
    case 36:
      return std::sinh(a);
    case 37:
      return std::cosh(a);
    case 38:
      return std::tanh(a);
    case 39:
      return a * (kPi / 180.0f);
    default:
      return a * (180.0f / kPi);
  }
}

float comparison_or_rounding(int operation, float a, float b, float c) {
  switch (operation) {
    case 13:
      return a < b ? 1.0f : 0.0f;
    case 14:
      return a > b ? 1.0f : 0.0f;
    case 15:
      return sign(a);
    case 16:
      return a == b || std::abs(a - b) <= std::max(c, FLT_EPSILON) ? 1.0f : 0.0f;
    case 17:
      return smooth_minimum(a, b, c);
    case 18:
      return -smooth_minimum(-a, -b, c);
    case 19:
      return std::floor(a + 0.5f);
    case 20:
      return std::floor(a);
    case 21:
      return std::ceil(a);
    case 22:
      return std::trunc(a);
    case 23:
      return fraction(a);
    case 24:
      return modulo(a, b);
    case 25:
      return b != 0.0f ? a - std::floor(a / b) * b : 0.0f;
    case 26:
      return wrap(a, b, c);
    case 27:
      return snap(a, b);
    default:
      return ping_pong(a, b);
  }
}

}  // namespace

float math_node(int operation, float a, float b, float c) {
  switch (operation) {
    case 0:
      return a + b;
    case 1:
      return a - b;
    case 2:
      return a * b;
    case 3:
      return safe_divide(a, b);
    case 4:
      return a * b + c;
    case 5:
      return safe_power(a, b);
    case 6:
      return safe_logarithm(a, b);
    case 7:
      return safe_sqrt(a);
    case 8:
      return a > 0.0f ? 1.0f / std::sqrt(a) : 0.0f;
    case 9:
      return std::abs(a);
    case 10:
      return std::exp(a);
    case 11:
      return std::min(a, b);
    case 12:
      return std::max(a, b);
    default:
      return operation < 29 ? comparison_or_rounding(operation, a, b, c) : trigonometry(operation, a, b);
  }
}

Vec3 vector_math_node(int operation, Vec3 a, Vec3 b, Vec3 c, float scale) {
  switch (operation) {
    case 0:
      return a + b;
    case 1:
      return a - b;
    case 2:
      return a * b;
    case 3:
      return safe_divide(a, b);
    case 4:
      return a * b + c;
    case 5:
      return cross(a, b);
    case 6:
      return project(a, b);
    case 7: {
      const Vec3 n = normalize_or(b, {});
      return a - 2.0f * dot(n, a) * n;
    }
    case 8:
      return refract_incident(a, normalize_or(b, {}), scale);
    case 9:
      return dot(c, b) < 0.0f ? a : -a;
    case 10:
      return a * scale;
    case 11:
      return normalize_or(a, {});
    case 12:
      return each([](float x) { return std::abs(x); }, a);
    case 13:
      return min(a, b);
    case 14:
      return max(a, b);
    case 15:
      return each([](float x) { return std::floor(x); }, a);
    case 16:
      return each([](float x) { return std::ceil(x); }, a);
    case 17:
      return each(fraction, a);
    case 18:
      return each(modulo, a, b);
    case 19:
      return {wrap(a.x, b.x, c.x), wrap(a.y, b.y, c.y), wrap(a.z, b.z, c.z)};
    case 20:
      return each(snap, a, b);
    case 21:
      return each([](float x) { return std::sin(x); }, a);
    case 22:
      return each([](float x) { return std::cos(x); }, a);
    case 23:
      return each([](float x) { return std::tan(x); }, a);
    case 24:
      return each(safe_power, a, b);
    default:
      return each(sign, a);
  }
}

float vector_math_value_node(int operation, Vec3 a, Vec3 b) {
  if (operation == 0) return dot(a, b);
  return operation == 1 ? length(a - b) : length(a);
}

float clamp_node(float value, float lower, float upper, int type) {
  if (type == 1 && lower > upper) std::swap(lower, upper);
  return std::min(std::max(value, lower), upper);
}

float map_range_node(const MapRangeInput& in, int interpolation, bool clamps) {
  if (in.from_max == in.from_min) return 0.0f;
  float factor = (in.value - in.from_min) / (in.from_max - in.from_min);
  switch (interpolation) {
    case 1:
      factor = in.steps > 0.0f ? std::floor(factor * (in.steps + 1.0f)) / in.steps : 0.0f;
      break;
    case 2:  // an inverted range is the same curve mirrored, which the normalised factor already is
      factor = smoothstep01(factor);
      break;
    case 3: {
      const float t = clamp01(factor);
      factor = t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
      break;
    }
    default:
      break;
  }
  const float result = in.to_min + factor * (in.to_max - in.to_min);
  return clamps ? clamp_node(result, in.to_min, in.to_max, 1) : result;
}

}  // namespace cistern
