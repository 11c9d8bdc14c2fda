#pragma once

#include "shading/bsdf.h"

namespace cistern {

/// What a sheet of a dielectric reflects and lets through by way of both faces, which are so close together that what
/// leaves after however many reflections between them leaves in one place. [OpenPBR 1.1, thin-walled case]
struct SheetOptics {
  Rgb reflectance, transmittance;
};

/// What passes a layer at a cosine of `cos_t` inside, of what passes it head-on, by Beer's law; nothing where there is
/// no refracted ray.
Rgb passage(Rgb tint, float cos_t);

/// `front` and `back`: a face met from outside, and from inside. `tint` is what passes through the inside head-on;
/// `cos_o` the cosine between the normal and the direction.
SheetOptics sheet_optics(const MicrofacetLobe& front, const MicrofacetLobe& back, Rgb tint, float cos_o);

/// GGX width of what passes both faces of a sheet with facets of that width and an index of `ior`, as if it was
/// reflected; 0 below an index of 1. [Kulla and Conty 2017, p. 40, where 3.7 is to be 3.4, and the square root is for
/// roughness; in Blender 5.2 it was for the width: `is_wide`]
float sheet_alpha(float alpha, float ior, bool is_wide = false);

}  // namespace cistern
