#include "shading/lobe_hair.h"

#include <array>

#include "shading/fresnel.h"
#include "shading/strand_inclination.h"

namespace cistern {
namespace {

/// Ways through a strand: reflected, passed, reflected inside once, more often.
constexpr size_t kWays = 4, kLastWay = kWays - 1;

float safe_asin(float x) { return std::asin(std::clamp(x, -1.0f, 1.0f)); }

float to_the_power_of_20(float x) {
  const float x4 = sqr(sqr(x));
  return sqr(sqr(x4)) * x4;
}

/// Turned by an angle; the cosine stays positive.
Inclination turned(Inclination i, float angle) {
  const float s = std::sin(angle), c = std::cos(angle);
  return {i.sine * c + i.cosine * s, std::abs(i.cosine * c - i.sine * s)};
}

/// By how much scales tilt the light of each way, in tilts. [Chiang et al. 2016, §4; the last has none]
constexpr std::array<float, kWays> kTilts{2.0f, -1.0f, -4.0f, 0.0f};

// Logistic distribution around 0, cut off at half a turn; s is its scale.
float logistic_cdf(float x, float s) { return 1.0f / (1.0f + std::exp(-x / s)); }
float logistic_share(float s) { return 1.0f - 2.0f * logistic_cdf(-kPi, s); }
float logistic_density(float x, float s) {
  const float e = std::exp(-std::abs(x) / s);
  return e / (s * sqr(1.0f + e) * logistic_share(s));
}
float sample_logistic(float u, float s) {
  const float cut = logistic_cdf(-kPi, s);
  const float x = -s * std::log(1.0f / (u * (1.0f - 2.0f * cut) + cut) - 1.0f);
  return std::clamp(x, -kPi, kPi);
}

/// All that does not depend on where light comes from.
struct Strand {
  Frame frame;  // s along the strand, t and n across; the eye lies in the plane of s and n
  Inclination o;
  float gamma_o, gamma_t;              // angles of incidence across the strand, outside and inside
  std::array<Rgb, kWays> attenuation;  // A_p
  std::array<float, kWays> probability, variance;

  Strand(const HairLobe& lobe, const Vec3& wo) : frame(strand_frame(lobe.tangent, wo)) {
    o = {std::clamp(dot(wo, frame.s), -1.0f, 1.0f), 0.0f};
    o.cosine = cosine_of(o.sine);
    gamma_o = safe_asin(lobe.h);
    const float sin_gamma_t = lobe.h * o.cosine / std::sqrt(sqr(lobe.ior) - sqr(o.sine));
    gamma_t = safe_asin(sin_gamma_t);
    const float cos_theta_t = cosine_of(o.sine / lobe.ior);
    const Rgb passed = exp((-2.0f * cosine_of(sin_gamma_t) / cos_theta_t) * lobe.absorption);
    const float f = fresnel_dielectric(o.cosine * cosine_of(lobe.h), lobe.ior);
    attenuation[0] = Rgb(f);
    attenuation[1] = sqr(1.0f - f) * passed;
    attenuation[2] = f * passed * attenuation[1];
    attenuation[3] = f * passed * attenuation[2] / (Rgb(1.0f) - f * passed);
    if (!is_finite(attenuation[3])) attenuation[3] = {};  // all is reflected
    float sum = 0.0f;
    for (size_t p = 0; p < kWays; ++p) sum += probability[p] = average(attenuation[p]);
    for (float& p : probability) p /= sum;
    variance = {lobe.coat_variance, 0.25f * lobe.variance, 4.0f * lobe.variance, 4.0f * lobe.variance};
  }

  /// Where scales send light from that reaches the eye by way p. Turning the eye and not the light keeps densities
  /// whole.
  Inclination tilted(size_t p, float tilt) const { return turned(o, kTilts[p] * tilt); }

  /// Direction in which a ray of way p leaves across the strand if nothing is rough, from that to the eye.
  float turn_of_way(size_t p) const {
    const auto passes = static_cast<float>(p);
    return 2.0f * passes * gamma_t - 2.0f * gamma_o + passes * kPi;
  }
  float azimuth_of(const Vec3& w) const { return std::atan2(dot(w, frame.n), dot(w, frame.t)); }
  float azimuthal_density(size_t p, float turn, float s) const {
    if (p == kLastWay) return 0.5f * kInvPi;
    const float off = turn - turn_of_way(p);
    return logistic_density(off - 2.0f * kPi * std::floor(off / (2.0f * kPi) + 0.5f), s);
  }
};

/// Of a mass of hair. [Chiang et al. 2016, eq. 9]
float color_fit(float b) { return 5.969f + b * (-0.215f + b * (2.532f + b * (-10.73f + b * (5.574f + b * 0.245f)))); }

}  // namespace

Frame strand_frame(const Vec3& tangent, const Vec3& wo) {
  const Vec3 across = cross(tangent, wo);
  if (!(length_squared(across) > 1e-14f)) return {tangent, Frame(tangent).s, Frame(tangent).t};
  const Vec3 t = normalize(across);
  return {tangent, t, cross(tangent, t)};
}

HairLobe make_hair(const HairAppearance& hair, Vec3 tangent, Vec3 ng, Vec3 wo) {
  static constexpr float kSmoothest = 1e-3f;  // as in Cycles
  const auto in_range = [](float x) { return std::clamp(x, kSmoothest, 1.0f); };
  // Fits by which the roughnesses look even. [Chiang et al. 2016, eqs. 7 and 8]
  const auto variance = [](float r) { return sqr(0.726f * r + 0.812f * sqr(r) + 3.700f * to_the_power_of_20(r)); };
  const float r = in_range(hair.roughness), radial = in_range(hair.radial_roughness);
  HairLobe lobe;
  lobe.n = ng;
  lobe.tangent = tangent;
  lobe.absorption = max(hair.absorption, Rgb(0.0f));
  lobe.variance = variance(r);
  lobe.coat_variance = variance(in_range(r * (1.0f - clamp01(hair.coat))));
  lobe.scale = std::sqrt(kPi / 8.0f) *
               (0.265f * radial + 1.194f * sqr(radial) + 5.372f * to_the_power_of_20(radial) * sqr(radial));
  lobe.ior = std::max(hair.ior, 1.0f + 1e-5f);
  lobe.tilt = hair.tilt;
  const Frame frame = strand_frame(tangent, wo);
  lobe.h = std::clamp(dot(cross(ng, tangent), frame.n), -1.0f, 1.0f);
  lobe.is_smooth = std::min(r, radial) < kReconnectRoughness;
  return lobe;
}

void soften(HairLobe& lobe, float least) {
  for (float* width : {&lobe.variance, &lobe.coat_variance, &lobe.scale}) *width = std::max(*width, least);
  lobe.is_smooth = false;
}

LobeEvaluation evaluate_lobe(const HairLobe& lobe, const Vec3& wo, const Vec3& wi) {
  const Strand strand(lobe, wo);
  const float sine = std::clamp(dot(wi, strand.frame.s), -1.0f, 1.0f);
  const Inclination i{sine, cosine_of(sine)};
  const float turn = strand.azimuth_of(wi) - strand.azimuth_of(wo);
  LobeEvaluation result;
  for (size_t p = 0; p < kWays; ++p) {
    const float density = longitudinal_density(i, strand.tilted(p, lobe.tilt), strand.variance[p]) *
                          strand.azimuthal_density(p, turn, lobe.scale);
    result.f_cos += density * strand.attenuation[p];
    result.pdf += density * strand.probability[p];
  }
  return result;
}

std::optional<Vec3> sample_lobe(const HairLobe& lobe, const Vec3& wo, float u_branch, Vec2 u) {
  const Strand strand(lobe, wo);
  size_t p = 0;
  while (p < kLastWay && u_branch >= strand.probability[p]) u_branch -= strand.probability[p++];
  const float u_height = clamp01(u_branch / strand.probability[p]);
  const Inclination i = sample_longitudinal(strand.tilted(p, lobe.tilt), strand.variance[p], u_height, u.y);
  const float turn = p == kLastWay ? 2.0f * kPi * u.x : strand.turn_of_way(p) + sample_logistic(u.x, lobe.scale);
  const float azimuth = strand.azimuth_of(wo) + turn;
  return normalize(i.sine * strand.frame.s +
                   i.cosine * (std::cos(azimuth) * strand.frame.t + std::sin(azimuth) * strand.frame.n));
}

Rgb hair_albedo(const HairLobe& lobe, const Vec3& wo) {
  Rgb sum;
  for (const Rgb& attenuation : Strand(lobe, wo).attenuation) sum += attenuation;
  return sum;
}

Rgb hair_color(const HairLobe& lobe, const Vec3& wo) {
  const float cos_theta = cosine_of(dot(wo, lobe.tangent)), cos_gamma = cosine_of(lobe.h);
  const float fit = color_fit(lobe.variance);  // so in Cycles, where [Chiang et al. 2016] has the radial roughness
  const auto root = [](float x) { return std::sqrt(x); };
  const Rgb& a = lobe.absorption;
  return exp(Rgb(root(a.r), root(a.g), root(a.b)) * -fit) + Rgb(fresnel_dielectric(cos_theta * cos_gamma, lobe.ior));
}

Rgb hair_absorption(Rgb color, float radial_roughness) {
  constexpr float kDarkest = 1e-5f;
  const float fit = color_fit(radial_roughness);
  const auto absorption = [&](float c) { return sqr(std::log(std::clamp(c, kDarkest, 1.0f)) / fit); };
  return {absorption(color.r), absorption(color.g), absorption(color.b)};
}

Rgb melanin_absorption(float amount, float redness) {
  constexpr Rgb kEumelanin{0.506f, 0.841f, 1.653f}, kPheomelanin{0.343f, 0.733f, 1.924f};
  constexpr float kClearest = 1e-4f;
  const float concentration = -std::log(std::max(1.0f - amount, kClearest));  // even to the eye: as Blender has it
  return concentration * lerp(kEumelanin, kPheomelanin, redness);
}

}  // namespace cistern
