#include "shading/thin_film.h"

#include <gtest/gtest.h>

#include <complex>

#include "shading/color_matching.h"
#include "shading/fresnel.h"

namespace cistern::test {
namespace {

using Complex = std::complex<double>;

constexpr float kThicknesses[] = {5.0f, 80.0f, 300.0f, 550.0f, 1000.0f};
constexpr float kCosines[] = {1.0f, 0.8f, 0.5f, 0.2f};

/// Amplitudes that a layered surface reflects at one wavelength, from the waves' continuity: Airy's sum in closed form.
/// `planted` turns the phase of the way through the film.
double reflectance_at(double wavelength_nm, ThinFilm film, double cos_i, Complex below, double planted = 0.0) {
  const double n = static_cast<double>(film.ior), sine2 = 1.0 - cos_i * cos_i;
  const Complex across[] = {cos_i, std::sqrt(Complex(n * n - sine2)), std::sqrt(below * below - sine2)};
  const Complex index[] = {1.0, n, below};
  const double path = 2.0 * static_cast<double>(film.thickness_nm) * across[1].real();
  const Complex wave = std::polar(1.0, 2.0 * M_PI * path / wavelength_nm + planted);
  double sum = 0.0;
  for (const bool is_p : {false, true}) {
    const auto at = [&](int a, int b) {
      const Complex left = is_p ? across[a] / (index[a] * index[a]) : across[a];
      const Complex right = is_p ? across[b] / (index[b] * index[b]) : across[b];
      return (left - right) / (left + right);
    };
    const Complex top = at(0, 1), bottom = at(1, 2);
    sum += 0.5 * std::norm((top + bottom * wave) / (1.0 + top * bottom * wave));
  }
  return sum;
}

/// Of light of all wavelengths alike, as the channels see it; of each channel's own index below.
Rgb seen(ThinFilm film, double cos_i, std::array<Complex, 3> below, double planted = 0.0) {
  std::array<double, 3> sum{}, total{};
  for (size_t i = 0; i < kColorMatching.size(); ++i) {
    const Vec3 xyz = kColorMatching[i];
    const auto weight =
        rec709_from_xyz(static_cast<double>(xyz.x), static_cast<double>(xyz.y), static_cast<double>(xyz.z));
    for (size_t c = 0; c < 3; ++c) {
      sum[c] += weight[c] * reflectance_at(matching_wavelength_nm(i), film, cos_i, below[c], planted);
      total[c] += weight[c];
    }
  }
  const auto mean = [&](size_t c) { return clamp01(static_cast<float>(sum[c] / total[c])); };
  return {mean(0), mean(1), mean(2)};
}

float largest_difference(Rgb a, Rgb b) {
  return max_component({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

TEST(ThinFilm, IsAirysSumOverAllWavelengths) {
  constexpr float kTolerance = 0.012f;  // steps of the table, and of orders after the third
  float planted = 0.0f;
  for (const float thickness : kThicknesses)
    for (const float ior : {1.2f, 1.33f, 2.0f})
      for (const float cosine : kCosines) {
        const ThinFilm film{thickness, ior};
        const float eta = 1.5f;
        const Rgb ours = fresnel_film_on_dielectric(film, cosine, eta, Rgb(f0_from_ior(eta)));
        const Complex below = static_cast<double>(eta);
        const double c = static_cast<double>(cosine);
        EXPECT_LT(largest_difference(ours, seen(film, c, {below, below, below})), kTolerance)
            << thickness << " " << ior;
        planted = std::max(planted, largest_difference(ours, seen(film, c, {below, below, below}, M_PI)));
      }
  EXPECT_GT(planted, 10.0f * kTolerance);  // planted bug: half a wave lost
}

TEST(ThinFilm, OnConductorsIsAirysSumOverAllWavelengths) {
  constexpr float kTolerance = 0.06f;  // they reflect more, and so more often: .05 at grazing angles
  const Rgb n(0.2f, 0.9f, 1.4f), k(3.1f, 2.4f, 1.9f);
  const auto index = [](float re, float im) { return Complex(static_cast<double>(re), static_cast<double>(im)); };
  float planted = 0.0f;
  for (const float thickness : kThicknesses)
    for (const float ior : {1.33f, 2.0f})
      for (const float cosine : kCosines) {
        const ThinFilm film{thickness, ior};
        const Rgb ours = fresnel_film_on_conductor(film, cosine, n, k);
        const std::array<Complex, 3> below{index(n.r, k.r), index(n.g, k.g), index(n.b, k.b)};
        const double c = static_cast<double>(cosine);
        EXPECT_LT(largest_difference(ours, seen(film, c, below)), kTolerance)
            << thickness << " " << ior << " " << cosine;
        const std::array<Complex, 3> mirrored{std::conj(below[0]), std::conj(below[1]), std::conj(below[2])};
        planted = std::max(planted, largest_difference(ours, seen(film, c, mirrored)));
      }
  EXPECT_GT(planted, 3.0f * kTolerance);  // planted bug: the phase turns the wrong way
}

TEST(ThinFilm, OfAirOnAConductorIsNone) {
  const Rgb n(0.2f, 0.9f, 1.4f), k(3.1f, 2.4f, 1.9f);
  for (const float cosine : kCosines)
    EXPECT_LT(
        largest_difference(fresnel_film_on_conductor({400.0f, 1.0f}, cosine, n, k), fresnel_conductor(cosine, n, k)),
        1e-5f);
  EXPECT_NEAR(fresnel_conductor(1.0f, n, k).r, (sqr(0.8f) + sqr(3.1f)) / (sqr(1.2f) + sqr(3.1f)), 1e-6f);
}

TEST(ThinFilm, OfAnIndexBesideItIsNone) {
  for (const float cosine : kCosines)
    for (const float ior : {1.0f, 1.5f}) {
      float cos_t = 0.0f, bare_cos_t = 0.0f;
      const Rgb film = fresnel_film_on_dielectric({400.0f, ior}, cosine, 1.5f, Rgb(0.04f), &cos_t);
      EXPECT_NEAR(film.g, fresnel_dielectric(cosine, 1.5f, &bare_cos_t), 1e-5f);
      EXPECT_NEAR(cos_t, bare_cos_t, 1e-5f);
    }
  EXPECT_GT(fresnel_film_on_dielectric({100.0f, 2.0f}, 1.0f, 1.5f, Rgb(0.04f)).g, 0.1f);  // planted bug: another index
}

TEST(ThinFilm, FadesOutBelowANanometre) {
  const Rgb bare = fresnel_film_on_dielectric({400.0f, 1.5f}, 0.7f, 1.5f, Rgb(0.04f));
  EXPECT_LT(largest_difference(fresnel_film_on_dielectric({0.1f, 2.4f}, 0.7f, 1.5f, Rgb(0.04f)), bare), 2e-3f);
  const Rgb f0(0.9f, 0.6f, 0.2f), b = f82_coefficient(f0, Rgb(0.7f));
  EXPECT_LT(largest_difference(fresnel_film_on_metal({0.1f, 2.4f}, 0.7f, f0, b), fresnel_f82(0.7f, f0, b)), 0.02f);
}

TEST(ThinFilm, ReflectsAllWhereNothingPasses) {
  EXPECT_EQ(fresnel_film_on_dielectric({300.0f, 1.3f}, 0.3f, 1.0f / 1.5f, Rgb(0.04f)), Rgb(1.0f));  // at the lower face
  EXPECT_EQ(fresnel_film_on_dielectric({300.0f, 0.5f}, 0.3f, 1.5f, Rgb(0.04f)), Rgb(1.0f));         // at the upper one
  EXPECT_EQ(fresnel_film_on_metal({300.0f, 0.5f}, 0.3f, Rgb(0.5f), Rgb(0.0f)), Rgb(1.0f));
}

TEST(ThinFilm, ReflectsNoLessThanNothingAndNoMoreThanAll) {
  for (const float thickness : {0.11f, 1.0f, 300.0f, 1e4f, 1e9f})
    for (const float film_ior : {1e-5f, 0.3f, 1.0f, 1.5f, 1e3f})
      for (const float ior : {1e-5f, 0.5f, 1.0f, 1.5f, 1e3f})
        for (const float cosine : {0.0f, 1e-20f, 1e-3f, 0.5f, 1.0f}) {
          const ThinFilm film{thickness, film_ior};
          for (const Rgb& f0 : {Rgb(0.0f), Rgb(0.04f, 0.5f, 1.0f)}) {
            const Rgb all[] = {fresnel_film_on_dielectric(film, cosine, ior, f0),
                               fresnel_film_on_metal(film, cosine, f0, f82_coefficient(f0, Rgb(0.3f))),
                               fresnel_film_on_conductor(film, cosine, Rgb(ior), f0)};
            for (const Rgb& f : all)
              EXPECT_TRUE(f == min(max(f, Rgb(0.0f)), Rgb(1.0f))) << thickness << " " << film_ior << " " << ior;
          }
          EXPECT_LE(largest_film_reflectance(film, ior), 1.0f);
        }
}

}  // namespace
}  // namespace cistern::test
