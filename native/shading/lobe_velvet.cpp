#include "shading/lobe_velvet.h"

#include "base/angle.h"

namespace cistern {

VelvetLobe make_velvet(Vec3 n, float roughness) {
  constexpr float kLeast = 0.01f;  // as Cycles
  return {n, std::max(roughness, kLeast)};
}

float velvet_albedo(const VelvetLobe& lobe, Vec3 wo) {
  const float cosine = clamp01(dot(lobe.n, wo)), sine = safe_sqrt(1.0f - sqr(cosine));
  // Walls that reflect light above the horizon lean over by at least (90 degrees - theta) / 2: as many as exp(-x).
  const float x = (1.0f - sine) / ((1.0f + sine) * sqr(lobe.sigma));
  return 0.972f / (1.0f + 3.79f * std::pow(x, 0.736f)) * std::exp(-1.06f * x);  // fitted to integrals
}

LobeEvaluation evaluate_lobe(const VelvetLobe& lobe, Vec3 wo, Vec3 wi) {
  const float cos_o = dot(lobe.n, wo), cos_i = dot(lobe.n, wi);
  if (cos_o <= 0.0f || cos_i <= 0.0f) return {};
  const Vec3 h = normalize(wo + wi);
  const float cos_h = dot(lobe.n, h), o_h = dot(wo, h), sin2 = length_squared(cross(lobe.n, h));
  constexpr float kUpright = 1e-6f;  // D is 0 long before
  if (sin2 < kUpright || o_h <= 0.0f) return {};
  const float inverse_sigma2 = 1.0f / sqr(lobe.sigma);
  const float d = std::exp(-sqr(cos_h) / sin2 * inverse_sigma2) * inverse_sigma2 * kInvPi / sqr(sin2);
  const float wall = 2.0f * cos_h / o_h;
  const float seen = 0.25f * d * std::min(1.0f / cos_o, wall);
  return {Rgb(std::min(seen, 0.25f * d * wall * cos_i / cos_o)), seen};
}

std::optional<Vec3> sample_lobe(const VelvetLobe& lobe, Vec3 wo, float u_wall, Vec2 u) {
  const Frame frame(lobe.n);
  const Vec3 o = frame.to_local(wo);
  if (o.z <= 0.0f) return {};
  const float cot2 = -sqr(lobe.sigma) * std::log1p(-u.x);
  const float sine = 1.0f / std::sqrt(1.0f + cot2);
  const SineCosine turn = sine_cosine_of_turns(u.y);
  const Vec3 wall{sine * turn.cosine, sine * turn.sine, sine * std::sqrt(cot2)}, other{-wall.x, -wall.y, wall.z};
  const float of_wall = std::max(dot(o, wall), 0.0f), of_other = std::max(dot(o, other), 0.0f);
  const Vec3 i = reflect(o, u_wall * (of_wall + of_other) < of_wall ? wall : other);
  return i.z > 0.0f ? std::optional(frame.to_world(i)) : std::nullopt;
}

}  // namespace cistern
