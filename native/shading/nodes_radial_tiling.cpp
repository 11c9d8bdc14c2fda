#include "shading/nodes_radial_tiling.h"

#include <algorithm>
#include <cmath>

#include "base/angle.h"

namespace cistern {

// Lengths are those of the unit polygon, whose whole sides are at a distance of 1. A corner's arc touches the sides of
// both its neighbours, and all polygons around the origin are that one scaled, so the arc's part of the angle is the
// same for all.

namespace {

/// Between the middle of a side and the corner at one end of it.
struct HalfSide {
  float half_angle;       // from the middle to the corner
  float arc_angle;        // from where the arc begins to the corner
  float roundness;        // share of the arc's angle that counts in full, the rest is eased into
  float distance = 1.0f;  // of the side, over that of a whole one

  bool has_on_arc(float angle) const { return arc_angle > 0.0f && angle > half_angle - arc_angle; }
};

/// The circle of a corner: its centre with the corner's direction as x, and its radius.
struct CornerCircle {
  float x, y, radius;

  /// Distance from the origin to the circle in the direction of `angle` from the corner's.
  float distance(float angle) const {
    const float middle = std::cos(angle) * x + std::sin(angle) * y;
    return middle + std::sqrt(std::max(0.0f, middle * middle + radius * radius - x * x - y * y));
  }
};

float square(float x) { return x * x; }

/// Angle from the corner at which the arc begins, where the sides on both are alike.
float arc_angle(float half_angle, float roundness) {
  return half_angle - std::atan((1.0f - roundness) * std::tan(half_angle));
}

/// The corners of the last side where the number of sides is not whole: their arcs touch sides of different distance.
struct LastSide {
  float half_angle, distance;  // of the side, from the origin; times as far as a whole one
  float inner_arc, outer_arc;  // angles of the arc to both sides of the corner
  CornerCircle circle;         // y counts towards the neighbour, in units of the last side's distance

  LastSide(float regular, float last, float roundness)
      : half_angle(last), distance(std::cos(regular) / std::cos(last)), inner_arc(arc_angle(last, roundness)) {
    const float to_arc = 1.0f / std::cos(last - inner_arc);  // where the arc leaves the last side
    circle.radius = roundness * std::tan(last) / std::tan(0.5f * (regular + last));
    circle.x = std::cos(inner_arc) * to_arc - circle.radius * std::cos(last);
    circle.y = circle.radius * std::sin(last) - std::sin(inner_arc) * to_arc;
    outer_arc =
        std::atan((circle.y + circle.radius * std::sin(regular)) / (circle.x + circle.radius * std::cos(regular)));
  }
};

/// Coordinate along a side, of a point at `length` from the origin and `angle` from its middle; `across` is the size of
/// the polygon through it, in units of the side's distance. Arcs are measured by their angle; on straight parts by
/// length.
float along(const HalfSide& s, float length, float angle, float across, bool normalize) {
  const float straight = s.half_angle - s.arc_angle;
  const float eased = (1.0f - s.roundness) * s.arc_angle, full = s.roundness * s.arc_angle;
  const float whole = across * std::tan(straight) + 0.5f * eased * (across + 1.0f) + full;
  if (!s.has_on_arc(angle)) {
    const float x = across * std::tan(angle);
    return normalize ? x / whole : s.distance * x;
  }
  const float run = angle - straight;  // along the arc
  const float start = length * std::cos(straight);
  const float bend =
      run < eased ? start * run + 0.5f * (1.0f - start) * square(run) / eased : 0.5f * eased * (start - 1.0f) + run;
  const float x = length * std::sin(straight) + bend;
  if (!normalize) return s.distance * x;
  const float whole_on_arc = length * std::sin(straight) + 0.5f * eased * (start + 1.0f) + full;
  return x / std::lerp(whole, whole_on_arc, run / s.arc_angle);
}

}  // namespace

RadialTilingResult radial_tiling_node(float x, float y, const RadialTilingSettings& settings) {
  constexpr float kMostSides = 1e6f;
  const float sides = settings.sides >= 2.0f ? std::min(settings.sides, kMostSides) : 2.0f;
  const float roundness = settings.roundness >= 0.0f ? std::min(settings.roundness, 1.0f) : 0.0f;
  const bool is_line = sides == 2.0f && roundness < 1.0f;  // two sides without end, whose corners are infinitely far

  const float turn = std::atan2(y, x) + (y < 0.0f ? 2.0f * kPi : 0.0f);
  const float regular = kPi / sides;
  const float number = std::floor(turn / (2.0f * regular));
  const float into = turn - number * 2.0f * regular;  // from the corner before
  const float length = std::sqrt(x * x + y * y);

  RadialTilingResult r;
  r.segment = std::floor(sides * (std::atan2(y, x) / (2.0f * kPi) + (y < 0.0f ? 1.0f : 0.0f)));

  const float regular_arc = is_line ? 0.0f : arc_angle(regular, roundness);
  HalfSide half{regular, regular_arc, roundness};
  CornerCircle circle{(1.0f - roundness) / std::cos(regular), 0.0f, roundness};
  r.width = is_line ? 0.0f : std::tan(regular - regular_arc) + regular_arc;
  float scale = 1.0f;  // of `across`, where the circle is measured by the last side
  const float whole_sides = std::floor(sides);
  const bool is_last = number >= whole_sides && whole_sides != sides;
  if (whole_sides != sides) {
    const LastSide last(regular, kPi - whole_sides * regular, roundness);
    const bool is_before = number == whole_sides - 1.0f && into >= regular, is_after = number == 0.0f && into < regular;
    if (is_last) {
      half = {last.half_angle, last.inner_arc, roundness, last.distance};
      const float eased = (1.0f - roundness) * last.inner_arc;
      r.width = std::tan(last.half_angle - last.inner_arc) + 0.5f * eased +
                last.distance * (0.5f * eased + roundness * last.inner_arc);
    } else if (is_before || is_after) {
      half.arc_angle = last.outer_arc;
      half.roundness = 1.0f - std::tan(regular - last.outer_arc) / std::tan(regular);
      scale = last.distance;
    }
    if (is_last || is_before || is_after) circle = last.circle;
  }

  const float angle = std::fabs(half.half_angle - into);  // from the middle of the side
  const float to_corner = half.half_angle - angle;
  const float across = half.has_on_arc(angle) ? scale * length / circle.distance(is_last ? -to_corner : to_corner)
                                              : length * std::cos(angle);
  r.along = length == 0.0f ? 0.0f : along(half, length, angle, across, settings.normalize && !is_line);
  if (into < half.half_angle) r.along = -r.along;
  r.across = half.distance * across;
  r.rotation = number * 2.0f * regular + half.half_angle;
  if (settings.normalize) {
    r.along = 0.5f * r.along + 0.5f;
  } else {
    r.across -= 1.0f;
  }
  return r;
}

}  // namespace cistern
