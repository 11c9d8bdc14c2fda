#include "shading/lobe_simple_hair.h"

#include "shading/lobe_hair.h"

namespace cistern {
namespace {

constexpr float kRightAngle = 0.5f * kPi;

float inclination(const Vec3& tangent, const Vec3& w) { return std::asin(std::clamp(dot(tangent, w), -1.0f, 1.0f)); }

/// Inclinations of light around the cone of those that the strand would mirror to `o`: Lorentzian in their half sum.
struct AlongStrand {
  float o, width, shift, first, range;  // of the angles whose tangents are offsets over the width

  AlongStrand(const SimpleHairLobe& lobe, float seen_from) : o(seen_from), width(lobe.along), shift(lobe.shift) {
    const auto angle_of = [&](float i) { return std::atan((0.5f * (i + o) - shift) / width); };
    first = angle_of(-kRightAngle);
    range = angle_of(kRightAngle) - first;
  }
  /// Over solid angle for each radian about the strand.
  float density(float i) const {
    const float off = 0.5f * (i + o) - shift;
    return width / (2.0f * (off * off + width * width) * range * std::cos(i));
  }
  float sample(float u) const { return 2.0f * (shift + width * std::tan(first + u * range)) - o; }
};

/// Turns about the strand, from the eye of what is reflected and from the far side of what passes: a density over
/// those that any material has, of which the share `within` is in reach.
struct AboutStrand {
  float width, within;
  bool passes;

  explicit AboutStrand(const SimpleHairLobe& lobe) : width(lobe.across), passes(lobe.passes) {
    within = passes ? std::atan(kPi / width) / std::atan(kRightAngle / width)
                    : std::sin(std::min(kRightAngle / (2.0f * width), kRightAngle));
  }
  float density(float turn) const {
    const float x = std::abs(turn);
    if (passes) return width / (2.0f * std::atan(kRightAngle / width) * (x * x + width * width));
    if (x >= std::min(kRightAngle, kPi * width)) return 0.0f;
    return 0.25f * std::cos(0.5f * x / width) / width;
  }
  float sample(float u) const {
    const float signed_u = 2.0f * u - 1.0f;
    if (passes) return width * std::tan(signed_u * std::atan(kPi / width));
    return 2.0f * width * std::asin(signed_u * within);
  }
};

}  // namespace

SimpleHairLobe make_simple_hair(Vec3 tangent, float along, float across, bool passes) {
  constexpr float kSmoothest = 1e-3f;  // as in Cycles
  SimpleHairLobe lobe;
  lobe.tangent = tangent;
  lobe.along = std::clamp(along, kSmoothest, 1.0f);
  lobe.across = std::clamp(across, kSmoothest, 1.0f);
  lobe.passes = passes;
  return lobe;
}

bool is_smooth(const SimpleHairLobe& lobe) {
  return std::min(lobe.along, lobe.across) < kReconnectRoughness * kReconnectRoughness;
}

LobeEvaluation evaluate_lobe(const SimpleHairLobe& lobe, const Vec3& wo, const Vec3& wi) {
  constexpr float kSteepest = kRightAngle - 1e-3f;  // nothing arrives along the strand, as in Cycles
  if ((dot(lobe.n, wi) < 0.0f) != lobe.passes) return {};
  const float i = inclination(lobe.tangent, wi);
  if (!(std::abs(i) <= kSteepest)) return {};
  const Frame frame = strand_frame(lobe.tangent, wo);
  const AboutStrand about(lobe);
  const float away = dot(frame.n, wi);
  const float turn = std::atan2(dot(frame.t, wi), lobe.passes ? away : -away);
  const float density = AlongStrand(lobe, inclination(lobe.tangent, wo)).density(i) * about.density(turn);
  return {Rgb(density), density / about.within};
}

std::optional<Vec3> sample_lobe(const SimpleHairLobe& lobe, const Vec3& wo, float, Vec2 u) {
  const float i = AlongStrand(lobe, inclination(lobe.tangent, wo)).sample(u.x);
  const float turn = AboutStrand(lobe).sample(u.y);
  const Frame frame = strand_frame(lobe.tangent, wo);
  const float away = lobe.passes ? std::cos(turn) : -std::cos(turn);
  return normalize(std::sin(i) * frame.s + std::cos(i) * (std::sin(turn) * frame.t + away * frame.n));
}

}  // namespace cistern
