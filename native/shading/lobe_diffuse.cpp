#include "shading/lobe_diffuse.h"

#include <limits>

namespace cistern {
namespace {

/// Directional albedo is pi a + b G(cos): G as in OpenPBR 1.1.
float oren_nayar_g(float cos_theta) {
  constexpr float kGrazing = 1e-6f;  // below, tan(theta) loses its digits: Taylor's first terms instead
  if (cos_theta < kGrazing) return kPi / 2.0f - 2.0f / 3.0f - cos_theta;
  const float cosine = std::min(cos_theta, 1.0f);
  const float sine = safe_sqrt(1.0f - cosine * cosine);
  const float theta = std::acos(cosine);
  return sine * (theta - 2.0f / 3.0f - sine * cosine) + 2.0f / 3.0f * (sine / cosine) * (1.0f - sine * sine * sine);
}

}  // namespace

OrenNayarLobe make_oren_nayar(Vec3 n, Vec3 wo, float roughness, Rgb color, bool is_dim) {
  const float sigma = clamp01(roughness);
  OrenNayarLobe lobe;
  lobe.n = n;
  lobe.a = 1.0f / (kPi + sigma * (kPi / 2.0f - 2.0f / 3.0f));
  lobe.b = sigma * lobe.a;
  const Rgb albedo = max(Rgb(0.0f), min(Rgb(1.0f), color));
  const float average_albedo = lobe.a * kPi + (2.0f * kPi - 5.6f) / 3.0f * lobe.b;
  const float escaping = average_albedo / (1.0f - average_albedo);
  const Rgb further = is_dim ? albedo * albedo : albedo;
  const Rgb scale = kInvPi * escaping * further / (Rgb(1.0f) - albedo * (1.0f - average_albedo));
  const float albedo_o = lobe.a * kPi + lobe.b * oren_nayar_g(std::max(dot(n, wo), 0.0f));
  lobe.multi_scatter = scale * (1.0f - albedo_o);
  return lobe;
}

LobeEvaluation evaluate_lobe(const OrenNayarLobe& lobe, Vec3 wo, Vec3 wi) {
  const float cos_i = dot(lobe.n, wi);
  if (cos_i <= 0.0f) return {};
  const float cos_o = std::max(dot(lobe.n, wo), 0.0f);
  float t = dot(wo, wi) - cos_i * cos_o;
  if (t > 0.0f) t /= std::max(cos_i, cos_o) + std::numeric_limits<float>::min();
  const float albedo_i = lobe.a * kPi + lobe.b * oren_nayar_g(cos_i);
  const Rgb f = Rgb(lobe.a + lobe.b * t) + lobe.multi_scatter * (1.0f - albedo_i);
  return {f * cos_i, cos_i * kInvPi};
}

}  // namespace cistern
