#include "shading/subsurface.h"

#include <algorithm>
#include <array>

#include "base/frame.h"
#include "shading/ggx.h"

namespace cistern {
namespace {

constexpr float kMostScatter = 0.999999f;

/// Coefficients of a polynomial of degree 7, from the constant on.
using Polynomial = std::array<float, 8>;

float evaluate(const Polynomial& p, float x) {
  float sum = 0.0f;
  for (size_t i = p.size(); i-- > 0;) sum = sum * x + p[i];
  return sum;
}

/// The single-scattering albedo by that of the half space: two curves amplitude * atan(steepness * albedo)^power, the
/// second for bright media, all by g. [Wrenninge, Villemin and Hery 2017, Path Traced Subsurface Scattering using
/// Anisotropic Phase Functions and Non-Exponential Free Flights, §4.1: fits to simulations]
class AlbedoInversion {
 public:
  explicit AlbedoInversion(float g) {
    constexpr Polynomial kAmplitude{1.8260523782f,   -1.28451056436f, -1.79904629312f, 9.19393289202f,
                                    -22.8215585862f, 32.0234874259f,  -23.6264803333f, 7.21067002658f};
    constexpr Polynomial kSteepness{0.0f,           31.1491581433f,  -201.847017512f, 841.576016723f, -2018.09288505f,
                                    2731.71560286f, -1935.41424244f, 559.009054474f};
    constexpr Polynomial kPower{1.09686102424f, -0.394704063468f, 1.05258115941f, -8.83963712726f,
                                28.8643230661f, -46.8802913581f,  38.5402837518f, -12.7181042538f};
    constexpr Polynomial kBrightAmplitude{0.496310210422f, 0.360146581622f, -2.15139309747f, 17.8896899217f,
                                          -55.2984010333f, 82.065982243f,   -58.5106008578f, 15.8478295021f};
    constexpr Polynomial kBrightSteepness{
        0.0f,           76.7316253952f,  -594.356773233f, 2448.8834203f, -5576.68528998f,
        7116.60171912f, -4763.54467887f, 1303.5318055f};
    constexpr Polynomial kBrightPower{2.40602999408f, -2.51814844609f, 9.18494908356f, -79.2191708682f,
                                      259.082868209f, -403.613804597f, 302.85712436f,  -87.4370473567f};
    dark_ = {evaluate(kAmplitude, g), 4.98511194385f + 0.127355959438f * std::exp(evaluate(kSteepness, g)),
             evaluate(kPower, g)};
    bright_ = {evaluate(kBrightAmplitude, g),
               4.23190299701f + 0.00310603949088f * std::exp(evaluate(kBrightSteepness, g)), evaluate(kBrightPower, g)};
  }
  float operator()(float albedo) const {
    const float blend = std::sqrt(std::sqrt(albedo));
    return std::clamp(std::lerp(dark_(albedo), bright_(albedo), blend), 0.0f, kMostScatter);
  }

 private:
  struct Curve {
    float amplitude, steepness, power;
    float operator()(float albedo) const { return amplitude * std::pow(std::atan(steepness * albedo), power); }
  };
  Curve dark_{}, bright_{};
};

/// The same for any g, by a fit to a half space in even light. [d'Eon 2022, A Hitchhiker's Guide to Multiple
/// Scattering, v0.3.2, eq. 53.7; similarity after van de Hulst 1980]
float single_scatter_of_half_space(float albedo, float g) {
  const float s = 4.09712f + 4.20863f * albedo - std::sqrt(9.59217f + albedo * (41.6808f + 17.7126f * albedo));
  return std::clamp((1.0f - sqr(s)) / (1.0f - g * sqr(s)), 0.0f, kMostScatter);
}

/// Diffuse reflectance of a dipole. [Jensen et al. 2001, A Practical Model for Subsurface Light Transport, eq. 15]
float dipole_reflectance(float reduced_albedo, float boundary) {
  const float s = std::sqrt(3.0f * (1.0f - reduced_albedo));
  return 0.5f * reduced_albedo * (1.0f + std::exp(-boundary * s)) * std::exp(-s);
}

/// The reduced albedo whose dipole reflects so much, by bisection.
float reduced_albedo(float reflectance, float boundary) {
  constexpr float kBlack = 1e-4f, kWhite = 0.995f;
  if (reflectance < kBlack) return 0.0f;
  if (reflectance >= kWhite) return kMostScatter;
  float low = 0.0f, high = 1.0f;
  constexpr int kSteps = 24;
  for (int i = 0; i < kSteps; ++i) {
    const float middle = 0.5f * (low + high);
    (dipole_reflectance(middle, boundary) < reflectance ? low : high) = middle;
  }
  return 0.5f * (low + high);
}

/// Mean free path over diffusion length.
Rgb tissue_scale(const Subsurface& subsurface) {
  const float inverse = 1.0f / subsurface.ior;
  const float internal = inverse * (0.710f - 1.440f * inverse) + 0.668f + 0.0636f * subsurface.ior;  // Fresnel, diffuse
  const float boundary = 4.0f / 3.0f * (1.0f + internal) / (1.0f - internal);
  const auto scale = [&](float albedo) { return std::sqrt(3.0f * (1.0f - reduced_albedo(albedo, boundary))); };
  return {scale(subsurface.albedo.r), scale(subsurface.albedo.g), scale(subsurface.albedo.b)};
}

void scatter_at_least(float least, SubsurfaceMedium& medium) {
  const Rgb raised = max(medium.single_scatter, Rgb(least));
  medium.kept = medium.single_scatter / raised;
  medium.single_scatter = raised;
}

}  // namespace

SubsurfaceMedium similar_isotropic(const SubsurfaceMedium& medium) {
  const Rgb sigma_s = medium.sigma_t * medium.single_scatter * (1.0f - medium.g);
  const Rgb sigma_t = medium.sigma_t * (Rgb(1.0f) - medium.single_scatter) + sigma_s;
  return {sigma_t, sigma_s / sigma_t, 0.0f, medium.kept};
}

SubsurfaceMedium subsurface_medium(const Subsurface& subsurface) {
  constexpr float kProfileWidth = 0.25f * kInvPi, kShortest = 1e-16f, kLeastScatter = 0.2f;
  const Rgb albedo = subsurface.albedo;
  const float g = subsurface.anisotropy;
  const bool is_free_path = subsurface.method == SubsurfaceMethod::RANDOM_WALK;
  Rgb scale(is_free_path ? 1.0f : kProfileWidth);
  if (subsurface.is_skin()) scale = tissue_scale(subsurface);
  SubsurfaceMedium medium;
  medium.g = g;
  medium.sigma_t = Rgb(1.0f) / max(subsurface.radius * scale, Rgb(kShortest));
  if (is_free_path || g < 0.0f) {
    medium.single_scatter = {single_scatter_of_half_space(albedo.r, g), single_scatter_of_half_space(albedo.g, g),
                             single_scatter_of_half_space(albedo.b, g)};
  } else {
    const AlbedoInversion single_scatter(g);
    medium.sigma_t *= Rgb(1.0f / (1.0f - g));
    medium.single_scatter = {single_scatter(albedo.r), single_scatter(albedo.g), single_scatter(albedo.b)};
  }
  scatter_at_least(kLeastScatter, medium);
  return medium;
}

std::optional<Vec3> sample_entry(const Subsurface& subsurface, const Vec3& wo, float u_choice, Vec2 u_direction) {
  const Frame frame(subsurface.n);
  if (subsurface.is_skin() && u_choice < 0.5f) return -frame.to_world(square_to_cosine_hemisphere(u_direction));
  const Vec3 local = frame.to_local(wo);
  if (!(local.z > 0.0f)) return std::nullopt;
  const Vec3 h = sample_ggx_visible_normal({subsurface.alpha, subsurface.alpha}, local, u_direction);
  const float eta = 1.0f / subsurface.ior, cos_h = dot(local, h);
  const float cos_below = safe_sqrt(1.0f - sqr(eta) * (1.0f - sqr(cos_h)));
  return frame.to_world(normalize((eta * cos_h - cos_below) * h - eta * local));
}

}  // namespace cistern
