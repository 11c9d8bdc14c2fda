#pragma once

#include "shading/lobe_diffuse.h"

namespace cistern {

// Velvet: grooves whose walls are nearly upright, so that it shines where it is seen or lit at grazing angles.
// f cos = D G / (4 cos_o), D = exp(-cot^2 / sigma^2) / (pi sigma^2 sin^4) of the angle between h and n, without
// Fresnel. [Ashikhmin, Premoze and Shirley 2000, A Microfacet-Based BRDF Generator, sec. 5.2, without its constant
// part] G = min(1, 2 cos_h cos_o / o.h, 2 cos_h cos_i / o.h) [Cook and Torrance 1982, eq. 10], so f is reciprocal.
// Density: normals that wo sees of such grooves, and so f cos over it is at most 1. [Heitz and d'Eon 2014, Importance
// Sampling Microfacet-Based BSDFs using the Distribution of Visible Normals, sec. 4.2]

/// `roughness` in [0, 1]: how far the walls lean over.
VelvetLobe make_velvet(Vec3 n, float roughness);

/// About what it reflects towards `wo` under an even sky: within 0.04, head-on of stiff velvet 0.13 too little.
float velvet_albedo(const VelvetLobe& lobe, Vec3 wo);

LobeEvaluation evaluate_lobe(const VelvetLobe& lobe, Vec3 wo, Vec3 wi);
std::optional<Vec3> sample_lobe(const VelvetLobe& lobe, Vec3 wo, float u_wall, Vec2 u);

}  // namespace cistern
