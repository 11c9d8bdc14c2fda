#include "shading/lobe_sheen.h"

namespace cistern {
namespace {

/// x towards wo in the tangent plane.
Frame frame_towards(Vec3 n, Vec3 wo) {
  constexpr float kParallel = 1e-12f;  // squared sine below which the direction of x is noise
  const Vec3 b = cross(n, wo);
  const float sine_squared = length_squared(b);
  if (sine_squared < kParallel) return Frame(n);
  const Vec3 bitangent = b * (1.0f / std::sqrt(sine_squared));
  return {cross(bitangent, n), bitangent, n};
}

}  // namespace

Sheen make_sheen(Vec3 n, Vec3 wo, float roughness) {
  constexpr float kMinRoughness = 1e-3f, kNegligible = 1e-5f;  // as Cycles
  const float x = clamp01(dot(n, wo));
  const float y = std::clamp(roughness, kMinRoughness, 1.0f);
  const float a = (2.58126f * x + 0.813703f * y) * y / (1.0f + 0.310327f * x * x + 2.60994f * x * y);
  const float b = std::sqrt(1.0f - x) * (y - 1.0f) * y * y * y /
                  (0.0000254053f + 1.71228f * x - 1.71506f * x * y + 1.34174f * y * y);
  const float width = y * (0.0206607f + 1.58491f * y) / (0.0379424f + y * (1.32227f + y));
  const float mean = y * (-0.193854f + y * (-1.14885f + y * (1.7932f - 0.95943f * y * y))) / (0.046391f + y);
  const float offset = y * (0.000654023f + (-0.0207818f + 0.119681f * y) * y) / (1.26264f + y * (-1.92021f + y));
  const float albedo =
      std::exp(-0.5f * sqr((x - mean) / width)) / (width * std::sqrt(2.0f * kPi)) + std::max(offset, 0.0f);
  if (std::abs(a) < kNegligible || albedo < kNegligible) return {{}, 0.0f};
  return {{.n = n, .a = a, .b = b}, std::min(albedo, 1.0f)};
}

LobeEvaluation evaluate_lobe(const SheenLobe& lobe, Vec3 wo, Vec3 wi) {
  const Vec3 w = frame_towards(lobe.n, wo).to_local(wi);
  if (w.z <= 0.0f) return {};
  const float norm_squared = sqr(lobe.a * w.x + lobe.b * w.z) + sqr(lobe.a * w.y) + sqr(w.z);
  const float value = kInvPi * w.z * sqr(lobe.a / norm_squared);
  return {Rgb(value), value};
}

std::optional<Vec3> sample_lobe(const SheenLobe& lobe, Vec3 wo, float, Vec2 u) {
  const Vec3 c = square_to_cosine_hemisphere(u);
  const Vec3 w = normalize({c.x - c.z * lobe.b, c.y, c.z * lobe.a});
  return frame_towards(lobe.n, wo).to_world(w);
}

}  // namespace cistern
