#pragma once

#include "base/rgb.h"

namespace cistern {

// Fresnel reflectance of a surface under a film so thin that the waves which its two faces reflect interfere: soap,
// oil, oxide. At one wavelength that is Airy's sum over the times light passes the film; colours are integrals over
// those, which in the sum are Fourier transforms of the colour matching functions: a table by the difference of optical
// paths. [Belcour and Barla 2017, A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence,
// eqs. 3, 5 and 8 to 10] As in Cycles 5.0, also where that departs from the paper: functions of Rec. 709 in place of
// fits to XYZ; films below 1 nm fade out; the roughness of the film is that of the surface; and seen from inside of
// glass, all indices are taken relative to it, but not the wavelength, so that the film seems thinner and f is not
// reciprocal across the surface. Light loses nothing but what a metal absorbs: reflectances lie in [0, 1].

struct ThinFilm {
  float thickness_nm = 0.0f;
  float ior = 1.0f;  // relative to the near side
};
/// Films up to this are none.
inline constexpr float kThinnestFilm = 0.1f;
inline bool has_film(const ThinFilm& film) { return film.thickness_nm > kThinnestFilm; }

/// Above a dielectric of index `ior`, which would reflect `f0` head-on without the film: where that is not what the
/// index says, as far as F is low it is multiplied by as much. `cos_t` as in `fresnel_dielectric`.
Rgb fresnel_film_on_dielectric(const ThinFilm& film, float cos_i, float ior, const Rgb& f0, float* cos_t = nullptr);

/// Above a metal of that F82 curve, the index of which is guessed from its values at cos = 1 and 1/7.
Rgb fresnel_film_on_metal(const ThinFilm& film, float cos_i, const Rgb& f0, const Rgb& b);

/// A metal of index `n` + i `k` for each channel, without a film and with one.
Rgb fresnel_conductor(float cos_i, const Rgb& n, const Rgb& k);
Rgb fresnel_film_on_conductor(const ThinFilm& film, float cos_i, const Rgb& n, const Rgb& k);

/// What film and dielectric reflect head-on at most, of whatever wavelength.
float largest_film_reflectance(const ThinFilm& film, float ior);

}  // namespace cistern
