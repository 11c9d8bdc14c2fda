#include "resampling/receiver.h"

namespace cistern {
namespace {

/// Cosines below this count as this.
constexpr float kSmallestCosine = 0.02f;
/// Part of rough reflections that is taken to scatter evenly, for the tails that one lobe of mean roughness lacks.
constexpr float kEvenShare = 0.05f;

/// GGX reflection with height-correlated masking, without Fresnel: f cos and the density of visible-normal sampling.
/// [Heitz 2014, eq. 99; Heitz 2018, eq. 3]
struct Ggx {
  float f_cos, pdf;
};
Ggx reflect_ggx(float alpha, float cos_o, float cos_i, float cos_h) {
  const float a2 = sqr(alpha);
  const float d = a2 * kInvPi / sqr(1.0f + (a2 - 1.0f) * sqr(cos_h));
  const float root_o = std::sqrt(a2 + (1.0f - a2) * sqr(cos_o)), root_i = std::sqrt(a2 + (1.0f - a2) * sqr(cos_i));
  return {0.5f * d * cos_i / (cos_i * root_o + cos_o * root_i), 0.5f * d / (cos_o + root_o)};
}

}  // namespace

Response respond(const Receiver& receiver, Vec3 wi) {
  const bool is_one_sided = receiver.side != Vec3{};
  if (is_one_sided && !(dot(receiver.side, wi) > 0.0f)) return {};
  const float cos_n = dot(receiver.n, wi);
  const float diffuse = luminance(receiver.diffuse), glossy = luminance(receiver.glossy);
  const float albedo = diffuse + glossy + receiver.transmission;
  if (!(albedo > 0.0f)) return {};
  // The smallest cosine stands for lobes with normals of their own, which may face what the mean normal does not.
  const float cos_i = std::max(cos_n, kSmallestCosine);
  Response response;
  response.f_cos = (receiver.diffuse + kEvenShare * receiver.glossy) * (kInvPi * cos_i);
  response.pdf = diffuse * kInvPi * cos_i;
  if (glossy > 0.0f) {
    const float cos_o = std::max(dot(receiver.n, receiver.wo), kSmallestCosine);
    const Vec3 half = normalize_or(receiver.wo + wi, receiver.n);
    const Ggx ggx = reflect_ggx(receiver.alpha, cos_o, cos_i, clamp01(dot(receiver.n, half)));
    response.f_cos += receiver.glossy * ((1.0f - kEvenShare) * ggx.f_cos);
    response.glossy_pdf = glossy * ggx.pdf / albedo;
    response.pdf += glossy * ggx.pdf;
  }
  if (receiver.transmission > 0.0f) {
    const float spread = receiver.transmission * kInvPi * std::max(std::abs(cos_n), kSmallestCosine);
    response.f_cos += Rgb(spread);
    response.pdf += spread;
  }
  response.pdf /= albedo;
  return response;
}

}  // namespace cistern
