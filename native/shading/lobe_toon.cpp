#include "shading/lobe_toon.h"

namespace cistern {
namespace {

constexpr float kRightAngle = 0.5f * kPi;

/// Exact for small angles, too, where cosines are not.
float angle_between(const Vec3& a, const Vec3& b) { return 2.0f * std::asin(std::min(0.5f * length(a - b), 1.0f)); }
float one_minus_cosine(float angle) { return 2.0f * sqr(std::sin(0.5f * angle)); }

LobeEvaluation evaluate_cone(const ToonCone& cone, float angle) {
  if (angle >= half_angle(cone)) return {};
  const float density = 0.5f * kInvPi / one_minus_cosine(half_angle(cone));
  const float brightness = angle < cone.size ? 1.0f : 1.0f - (angle - cone.size) / cone.fade;
  return {Rgb(density * brightness), density};
}

Vec3 sample_cone(const ToonCone& cone, const Vec3& axis, Vec2 u) {
  return normalize(Frame(axis).to_world(square_to_cone(u, one_minus_cosine(half_angle(cone)))));
}

}  // namespace

ToonCone make_toon_cone(float size, float smooth) {
  constexpr float kSmallest = 1e-5f;
  return {std::clamp(size, kSmallest, 1.0f) * kRightAngle, clamp01(smooth) * kRightAngle};
}

LobeEvaluation evaluate_lobe(const ToonDiffuseLobe& lobe, const Vec3&, const Vec3& wi) {
  if (dot(lobe.n, wi) < 0.0f) return {};
  return evaluate_cone(lobe.cone, angle_between(lobe.n, wi));
}

std::optional<Vec3> sample_lobe(const ToonDiffuseLobe& lobe, const Vec3&, float, Vec2 u) {
  return sample_cone(lobe.cone, lobe.n, u);
}

LobeEvaluation evaluate_lobe(const ToonGlossyLobe& lobe, const Vec3& wo, const Vec3& wi) {
  if (dot(lobe.n, wo) <= 0.0f || dot(lobe.n, wi) <= 0.0f) return {};
  return evaluate_cone(lobe.cone, angle_between(reflect(wo, lobe.n), wi));
}

std::optional<Vec3> sample_lobe(const ToonGlossyLobe& lobe, const Vec3& wo, float, Vec2 u) {
  if (dot(lobe.n, wo) <= 0.0f) return {};
  const Vec3 wi = sample_cone(lobe.cone, reflect(wo, lobe.n), u);
  return dot(lobe.n, wi) > 0.0f ? std::optional(wi) : std::nullopt;
}

}  // namespace cistern
