#include "scene/panorama.h"

namespace cistern {
namespace {

/// A direction by its angle from the view axis and the angle of its image about the middle.
Vec3 from_axis(float angle, float about) {
  const float s = std::sin(angle);
  return {s * std::cos(about), s * std::sin(about), -std::cos(angle)};
}

float angle_from_axis(Vec3 d) { return std::atan2(std::sqrt(d.x * d.x + d.y * d.y), -d.z); }

/// A point of the frame at a radius, in the direction of `d`.
Vec2 on_circle(Vec3 d, float radius) {
  const float length = std::sqrt(d.x * d.x + d.y * d.y);
  if (!(length > 0.0f)) return {};
  return {radius * d.x / length, radius * d.y / length};
}

float fraction_between(Vec2 range, float x) { return (x - range.x) / (range.y - range.x); }

/// Longitude grows to the right, from the view axis on. Turned on to within half a turn of the middle of the range.
float fraction_of_longitude(Vec2 range, Vec3 d) {
  const float middle = 0.5f * (range.x + range.y), from_middle = std::atan2(d.x, -d.z) - middle;
  return fraction_between(range, middle + std::remainder(from_middle, 2.0f * kPi));
}

float polynomial_angle(const Panorama& p, float r) {
  const auto& k = p.polynomial;
  return -(k[0] + r * (k[1] + r * (k[2] + r * (k[3] + r * k[4]))));
}

/// Where the polynomial has an angle from the axis, by halving: lenses turn away steadily. Negative where it turns the
/// other way. Empty far beyond the sensor's corners.
std::optional<float> polynomial_radius(const Panorama& p, float angle) {
  constexpr int kHalvings = 30, kDoublings = 3;
  float low = 0.0f, high = 0.5f * std::sqrt(p.sensor.x * p.sensor.x + p.sensor.y * p.sensor.y);
  const float sign = polynomial_angle(p, high) < 0.0f ? -1.0f : 1.0f;
  const auto is_within = [&](float r) { return sign * polynomial_angle(p, r) <= angle; };
  for (int i = 0; i < kDoublings && is_within(high); ++i) low = high, high *= 2.0f;
  if (!is_within(low) || is_within(high)) return std::nullopt;
  for (int i = 0; i < kHalvings; ++i) {
    const float middle = 0.5f * (low + high);
    (is_within(middle) ? low : high) = middle;
  }
  return sign * low;
}

}  // namespace

std::optional<Vec3> panorama_direction(const Panorama& p, Vec2 film) {
  const Vec2 centred{film.x - 0.5f, film.y - 0.5f};
  switch (p.type) {
    case PanoramaType::EQUIRECTANGULAR: {
      const float longitude = lerp(p.longitude.x, p.longitude.y, film.x);
      const float latitude = lerp(p.latitude.x, p.latitude.y, film.y);
      return Vec3{std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                  -std::cos(latitude) * std::cos(longitude)};
    }
    case PanoramaType::CUBEMAP_FACE: {
      const auto on_face = [](float x) { return std::tan(0.5f * kPi * x); };
      return normalize({on_face(centred.x), on_face(centred.y), -1.0f});
    }
    case PanoramaType::MIRROR_BALL: {
      const float x = 2.0f * centred.x, y = 2.0f * centred.y, r2 = x * x + y * y;
      if (r2 > 1.0f) return std::nullopt;
      const float z = std::sqrt(1.0f - r2);  // of the ball's normal; the middle shows what is ahead, as in Cycles
      return Vec3{2.0f * z * x, 2.0f * z * y, 1.0f - 2.0f * z * z};
    }
    case PanoramaType::FISHEYE_EQUIDISTANT: {
      const float x = 2.0f * centred.x, y = 2.0f * centred.y, r = std::sqrt(x * x + y * y);
      if (r > 1.0f) return std::nullopt;
      return from_axis(0.5f * p.fov * r, std::atan2(y, x));
    }
    case PanoramaType::FISHEYE_EQUISOLID: {
      const float x = centred.x * p.sensor.x, y = centred.y * p.sensor.y, r = std::sqrt(x * x + y * y);
      if (r > 2.0f * p.lens * std::sin(0.25f * p.fov)) return std::nullopt;
      return from_axis(2.0f * std::asin(std::min(r / (2.0f * p.lens), 1.0f)), std::atan2(y, x));
    }
    case PanoramaType::FISHEYE_POLYNOMIAL: {
      const float x = centred.x * p.sensor.x, y = centred.y * p.sensor.y;
      const float angle = polynomial_angle(p, std::sqrt(x * x + y * y));
      if (std::abs(angle) > 0.5f * p.fov) return std::nullopt;
      return from_axis(angle, std::atan2(y, x));
    }
    case PanoramaType::CENTRAL_CYLINDRICAL: {
      const float longitude = lerp(p.longitude.x, p.longitude.y, film.x);
      const float height = lerp(p.cylinder.x, p.cylinder.y, film.y);
      return normalize({std::sin(longitude), height, -std::cos(longitude)});
    }
  }
  return std::nullopt;
}

std::optional<Vec2> panorama_position(const Panorama& p, Vec3 d) {
  Vec2 film;
  const bool is_right_behind = d.x == 0.0f && d.y == 0.0f && d.z > 0.0f;  // circles have it all around
  switch (p.type) {
    case PanoramaType::EQUIRECTANGULAR:
      film = {fraction_of_longitude(p.longitude, d),
              fraction_between(p.latitude, std::asin(std::clamp(d.y, -1.0f, 1.0f)))};
      break;
    case PanoramaType::CUBEMAP_FACE: {
      if (!(d.z < 0.0f)) return std::nullopt;
      film = {0.5f + 2.0f * kInvPi * std::atan(d.x / -d.z), 0.5f + 2.0f * kInvPi * std::atan(d.y / -d.z)};
      break;
    }
    case PanoramaType::MIRROR_BALL: {
      const float length = std::sqrt(2.0f * (1.0f - d.z));  // the normal lies half-way between d and the axis
      if (!(length > 0.0f)) return std::nullopt;
      film = {0.5f + 0.5f * d.x / length, 0.5f + 0.5f * d.y / length};
      break;
    }
    case PanoramaType::FISHEYE_EQUIDISTANT: {
      if (is_right_behind) return std::nullopt;
      const Vec2 at = on_circle(d, angle_from_axis(d) / p.fov);
      film = {0.5f + at.x, 0.5f + at.y};
      break;
    }
    case PanoramaType::FISHEYE_EQUISOLID: {
      if (is_right_behind) return std::nullopt;
      const Vec2 at = on_circle(d, 2.0f * p.lens * std::sin(0.5f * angle_from_axis(d)));
      film = {0.5f + at.x / p.sensor.x, 0.5f + at.y / p.sensor.y};
      break;
    }
    case PanoramaType::FISHEYE_POLYNOMIAL: {
      const std::optional<float> radius = polynomial_radius(p, angle_from_axis(d));
      if (!radius || is_right_behind) return std::nullopt;
      const Vec2 at = on_circle(d, *radius);
      film = {0.5f + at.x / p.sensor.x, 0.5f + at.y / p.sensor.y};
      break;
    }
    case PanoramaType::CENTRAL_CYLINDRICAL: {
      const float level = std::sqrt(d.x * d.x + d.z * d.z);
      if (!(level > 0.0f)) return std::nullopt;
      film = {fraction_of_longitude(p.longitude, d), fraction_between(p.cylinder, d.y / level)};
      break;
    }
  }
  return std::isfinite(film.x) && std::isfinite(film.y) ? std::optional(film) : std::nullopt;
}

float panorama_pixel_angle(const Panorama& p, Vec2 pixel) {
  const auto angle_of = [&](Vec2 step) {
    const auto a = panorama_direction(p, {0.5f, 0.5f}), b = panorama_direction(p, {0.5f + step.x, 0.5f + step.y});
    return a && b ? std::acos(std::clamp(dot(*a, *b), -1.0f, 1.0f)) : 0.0f;
  };
  // Over some pixels: neighbouring directions are too near each other for single precision.
  constexpr float kSpan = 0.1f;
  const float angle = 0.5f * (angle_of({kSpan, 0.0f}) / kSpan * pixel.x + angle_of({0.0f, kSpan}) / kSpan * pixel.y);
  return angle > 0.0f ? angle : kPi * std::max(pixel.x, pixel.y);
}

}  // namespace cistern
