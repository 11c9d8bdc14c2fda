#pragma once

#include <cstdint>

#include "base/vec.h"

namespace cistern {

/// As Cycles: beyond it the phase function is a spike that single precision does not resolve.
inline constexpr float kLargestAnisotropy = 0.999f;

/// Density per solid angle of deflection by an angle of that cosine; over the sphere it integrates to 1.
/// [Henyey and Greenstein 1941, Diffuse radiation in the Galaxy]
float henyey_greenstein(float cosine, float g);

/// The direction of light that went along `direction`, and was deflected by an angle of that cosine; `turns`: azimuth.
Vec3 deflected(Vec3 direction, float cosine, float turns);

/// The direction of light that went along `direction`, by that density.
Vec3 sample_henyey_greenstein(Vec3 direction, float g, Vec2 u);

/// Those of Blender's nodes.
enum class Phase { HENYEY_GREENSTEIN, RAYLEIGH, DRAINE, MIE, FOURNIER_FORAND };

/// How light is deflected where it is scattered once, whatever the azimuth.
class PhaseFunction {
 public:
  /// Isotropic.
  PhaseFunction() = default;

  /// `g`: mean cosine, in [-kLargestAnisotropy, kLargestAnisotropy] or clamped to it; 0 where it is not finite.
  static PhaseFunction henyey_greenstein(float g) { return draine(g, 0.0f); }

  /// Of what is much smaller than the wavelength: Draine's with a `g` of 0 and an `alpha` of 1.
  static PhaseFunction rayleigh() { return draine(0.0f, 1.0f); }

  /// Henyey and Greenstein's times 1 + alpha cosine^2, normalised. `alpha` from 0, which is theirs; negative ones and
  /// what is not finite count as 0. [Draine 2003, Scattering by Interstellar Dust Grains, eq. 5]
  static PhaseFunction draine(float g, float alpha);

  /// Of particles in water, of many sizes. `ior`: theirs over that of the water, 1.001 at least. `backscatter`: the
  /// fraction that is scattered by more than a right angle, from 0.0001 to 0.499. Both are clamped; what is not finite
  /// is 1.33 and 0.1. Within 0.1 degree, where it has a pole, it is the mean over that cone.
  /// [Fournier and Forand 1994, Analytic Phase Function for Ocean Water; Mobley et al. 2002, Phase Function Effects on
  /// Oceanic Light Fields, eqs. 6 and 7]
  static PhaseFunction fournier_forand(float ior, float backscatter);

  bool is_henyey_greenstein() const { return kind_ == Kind::DRAINE && alpha_ == 0.0f; }

  /// Mean cosine of one of Henyey and Greenstein's.
  float g() const { return g_; }

  /// Per solid angle; over the sphere it integrates to 1.
  float density(float cosine) const;

  /// The cosine that `u` of all light exceeds, in [0, 1).
  float sample_cosine(float u) const;

  bool operator==(const PhaseFunction&) const = default;

 private:
  enum class Kind : uint8_t { DRAINE, FOURNIER_FORAND };
  Kind kind_ = Kind::DRAINE;
  float g_ = 0.0f, alpha_ = 0.0f;      // Draine's
  float slope_ = 0.0f, power_ = 0.0f;  // Fournier and Forand's: delta over sin^2 of half the angle, and -nu
};

/// Droplets of water, as in fog and clouds: a mixture of two.
struct DropletPhase {
  PhaseFunction henyey_greenstein, draine;
  float draine_share = 0.0f;
};

/// `diameter` in micrometres, fitted up to 50; what is no positive number is 0.
/// [Jendersie and d'Eon 2023, An Approximate Mie Scattering Function for Fog and Cloud Rendering, eqs. 4 to 7, and
/// their supplement, eqs. 11 to 22, for less than 5]
DropletPhase droplet_phase(float diameter);

}  // namespace cistern
