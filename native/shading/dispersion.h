#pragma once

#include <string>

#include "base/rgb.h"
#include "scene/scene.h"

namespace cistern {

/// Index of refraction at a wavelength in micrometres of a dielectric that has `ior` at that of the d line of helium,
/// by Cauchy's equation. `inverse_abbe`: of the Abbe number, 0 without dispersion. [OpenPBR 1.1.1, eqs. 55 and 56]
float dispersed_ior(float ior, float inverse_abbe, float micrometres);

/// A wavelength, and what light of it alone adds to a picture in place of all wavelengths: its colour under D65 over
/// the density. White in the mean; a channel may be negative. Rec. 709.
struct WavelengthSample {
  float micrometres;
  Rgb weight;
};
WavelengthSample sample_wavelength(float u);

/// Name of a material in use that bends light by its wavelength; empty without any. What paths of one wavelength find
/// is not shared: techniques of reuse compare it by its brightness, which may be negative.
std::string find_dispersive_material(const Scene& scene);

}  // namespace cistern
