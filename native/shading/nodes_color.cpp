#include "shading/nodes_color.h"

#include "shading/nodes_math.h"

namespace cistern {
namespace {

constexpr Vec3 kOne{1.0f, 1.0f, 1.0f};

Vec3 saturated(Vec3 c) { return {clamp01(c.x), clamp01(c.y), clamp01(c.z)}; }

float overlay(float t, float a, float b) {
  if (a < 0.5f) return a * (1.0f - t + 2.0f * t * b);
  return 1.0f - (1.0f - t + 2.0f * t * (1.0f - b)) * (1.0f - a);
}

float dodge(float t, float a, float b) {
  if (a == 0.0f) return 0.0f;
  const float denominator = 1.0f - t * b;
  return denominator <= 0.0f ? 1.0f : std::min(a / denominator, 1.0f);
}

float burn(float t, float a, float b) {
  const float denominator = 1.0f - t + t * b;
  return denominator <= 0.0f ? 0.0f : clamp01(1.0f - (1.0f - a) / denominator);
}

float divide(float t, float a, float b) { return b != 0.0f ? (1.0f - t) * a + t * a / b : a; }

template <typename F>
Vec3 each(F f, float t, Vec3 a, Vec3 b) {
  return {f(t, a.x, b.x), f(t, a.y, b.y), f(t, a.z, b.z)};
}

/// Blends that exchange hue, saturation or value; a grey `b` has no hue to give.
Vec3 mix_hsv(int blend, float t, Vec3 a, Vec3 b) {
  Vec3 hsv = rgb_to_hsv(a);
  const Vec3 other = rgb_to_hsv(b);
  switch (blend) {
    case 15:
      if (other.y == 0.0f) return a;
      hsv.x = other.x;
      return lerp(a, hsv_to_rgb(hsv), t);
    case 16:
      if (hsv.y == 0.0f) return a;
      hsv.y = (1.0f - t) * hsv.y + t * other.y;
      return hsv_to_rgb(hsv);
    case 17:
      if (other.y == 0.0f) return a;
      hsv.x = other.x;
      hsv.y = other.y;
      return lerp(a, hsv_to_rgb(hsv), t);
    default:
      hsv.z = (1.0f - t) * hsv.z + t * other.z;
      return hsv_to_rgb(hsv);
  }
}

}  // namespace

Vec3 mix_color_node(int blend, float t, Vec3 a, Vec3 b) {
  switch (blend) {
    case 0:
      return lerp(a, b, t);
    case 1:
      return lerp(a, min(a, b), t);
    case 2:
      return lerp(a, a * b, t);
    case 3:
      return each(burn, t, a, b);
    case 4:
      return lerp(a, max(a, b), t);
    case 5:
      return kOne - ((1.0f - t) * kOne + t * (kOne - b)) * (kOne - a);
    case 6:
      return each(dodge, t, a, b);
    case 7:
      return lerp(a, a + b, t);
    case 8:
      return each(overlay, t, a, b);
    case 9: {
      const Vec3 screen = kOne - (kOne - b) * (kOne - a);
      return (1.0f - t) * a + t * ((kOne - a) * b * a + a * screen);
    }
    case 10:
      return a + t * (2.0f * b - kOne);
    case 11: {
      const Vec3 d = a - b;
      return lerp(a, Vec3{std::abs(d.x), std::abs(d.y), std::abs(d.z)}, t);
    }
    case 12:
      return max(lerp(a, a + b - 2.0f * a * b, t), Vec3{});
    case 13:
      return lerp(a, a - b, t);
    case 14:
      return each(divide, t, a, b);
    default:
      return mix_hsv(blend, t, a, b);
  }
}

Vec3 invert_node(float factor, Vec3 color) { return factor * (kOne - color) + (1.0f - factor) * color; }

Vec3 gamma_node(Vec3 color, float gamma) {
  if (gamma == 0.0f) return kOne;
  const auto power = [gamma](float c) { return c > 0.0f ? std::pow(c, gamma) : c; };
  return {power(color.x), power(color.y), power(color.z)};
}

Vec3 bright_contrast_node(Vec3 color, float bright, float contrast) {
  const float offset = bright - 0.5f * contrast;
  return max((1.0f + contrast) * color + offset * kOne, Vec3{});
}

Vec3 hue_saturation_node(Vec3 color, float hue, float saturation, float value, float factor) {
  Vec3 hsv = rgb_to_hsv(color);
  const float turned = hsv.x + hue + 0.5f;  // hue 0.5 is neutral in Blender
  hsv = {turned - std::floor(turned), clamp01(hsv.y * saturation), hsv.z * value};
  return max(factor * hsv_to_rgb(hsv) + (1.0f - factor) * color, Vec3{});
}

Vec3 rgb_to_hsv(Vec3 c) {
  const float high = std::max(c.x, std::max(c.y, c.z));
  const float low = std::min(c.x, std::min(c.y, c.z));
  const float range = high - low;
  const float saturation = high != 0.0f ? range / high : 0.0f;
  if (saturation == 0.0f) return {0.0f, 0.0f, high};
  float sixth;
  if (c.x == high) {
    sixth = (c.y - c.z) / range;
  } else if (c.y == high) {
    sixth = 2.0f + (c.z - c.x) / range;
  } else {
    sixth = 4.0f + (c.x - c.y) / range;
  }
  const float hue = sixth / 6.0f;
  return {hue < 0.0f ? hue + 1.0f : hue, saturation, high};
}

Vec3 hsv_to_rgb(Vec3 hsv) {
  const float v = hsv.z;
  if (hsv.y == 0.0f) return {v, v, v};
  const float sixth = (hsv.x == 1.0f ? 0.0f : hsv.x) * 6.0f;
  const float sector = std::floor(sixth);
  const float f = sixth - sector;
  const float p = v * (1.0f - hsv.y);
  const float q = v * (1.0f - hsv.y * f);
  const float t = v * (1.0f - hsv.y * (1.0f - f));
  if (sector == 0.0f) return {v, t, p};
  if (sector == 1.0f) return {q, v, p};
  if (sector == 2.0f) return {p, v, t};
  if (sector == 3.0f) return {p, q, v};
  if (sector == 4.0f) return {t, p, v};
  return {v, p, q};
}

Vec3 rgb_to_hsl(Vec3 c) {
  const float high = std::max(c.x, std::max(c.y, c.z));
  const float low = std::min(c.x, std::min(c.y, c.z));
  const float lightness = std::min(1.0f, 0.5f * (high + low));
  const float range = high - low;
  if (range == 0.0f) return {0.0f, 0.0f, lightness};
  const float saturation = lightness > 0.5f ? range / (2.0f - high - low) : range / (high + low);
  float sixth;
  if (c.x == high) {
    sixth = (c.y - c.z) / range + (c.y < c.z ? 6.0f : 0.0f);
  } else if (c.y == high) {
    sixth = (c.z - c.x) / range + 2.0f;
  } else {
    sixth = (c.x - c.y) / range + 4.0f;
  }
  return {sixth / 6.0f, saturation, lightness};
}

Vec3 hsl_to_rgb(Vec3 hsl) {
  const float sixth = hsl.x * 6.0f;
  const Vec3 pure =
      saturated({std::abs(sixth - 3.0f) - 1.0f, 2.0f - std::abs(sixth - 2.0f), 2.0f - std::abs(sixth - 4.0f)});
  const float chroma = (1.0f - std::abs(2.0f * hsl.z - 1.0f)) * hsl.y;
  return (pure - 0.5f * kOne) * chroma + hsl.z * kOne;
}

namespace {

template <typename T>
T table_lookup(std::span<const T> table, float position, bool is_constant) {
  const int last = static_cast<int>(table.size()) - 1;
  const float x = clamp01(position > 0.0f ? position : 0.0f) * static_cast<float>(last);  // NaN reads entry 0
  const int i = std::min(static_cast<int>(x), last);
  const float t = x - static_cast<float>(i);
  const T a = table[static_cast<size_t>(i)];
  if (is_constant || t <= 0.0f) return a;
  return (1.0f - t) * a + t * table[static_cast<size_t>(i) + 1];
}

Vec3 extrapolated_lookup(std::span<const Vec3> table, float position) {
  const size_t last = table.size() - 1;
  const float scale = static_cast<float>(last);
  if (position < 0.0f) return table[0] + (table[0] - table[1]) * (-position * scale);
  if (position > 1.0f) return table[last] + (table[last] - table[last - 1]) * ((position - 1.0f) * scale);
  return table_lookup(table, position, false);
}

}  // namespace

Vec3 ramp_lookup(std::span<const Vec3> table, float position, bool is_constant) {
  return table_lookup(table, position, is_constant);
}

float ramp_lookup(std::span<const float> table, float position, bool is_constant) {
  return table_lookup(table, position, is_constant);
}

Vec3 curve_lookup_node(std::span<const Vec3> table, float factor, Vec3 color, float min_x, float max_x) {
  const float range = max_x - min_x;
  const Vec3 mapped{extrapolated_lookup(table, safe_divide(color.x - min_x, range)).x,
                    extrapolated_lookup(table, safe_divide(color.y - min_x, range)).y,
                    extrapolated_lookup(table, safe_divide(color.z - min_x, range)).z};
  return (1.0f - factor) * color + factor * mapped;
}

}  // namespace cistern
