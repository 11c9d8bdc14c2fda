#pragma once

namespace cistern {

// Directional albedos of GGX microfacet surfaces, tabulated at build time by tools/generate_albedo_tables.cpp.
// `roughness` is sqrt(alpha), `mu` the cosine towards the eye; all arguments are clamped to [0, 1] (`ior` is free).
// Linear interpolation; nodes are exact to about 1e-4. The grids are those of Cycles 5.0 (32 x 32 and 16 x 16 x 16), so
// that what interpolation gets wrong, both get wrong.

/// Index -> [0, 1), most of it for the common indices: (|ior - 1| / (ior + 1))^(1/2), the same for ior and 1/ior.
float ior_coordinate(float ior);

/// Reflectance of a perfectly reflecting microfacet surface, one bounce; and its cosine-weighted mean over mu.
float ggx_albedo(float roughness, float mu);
float ggx_average_albedo(float roughness);

/// Reflection and transmission together of a dielectric microfacet surface, one bounce; `ior` relative, above or
/// below 1.
float ggx_glass_albedo(float roughness, float mu, float ior);
float ggx_glass_average_albedo(float roughness, float ior);

/// Mean over visible normals of where Fresnel stands between F0 (0) and F90 (1): for the dielectric curve of `ior`, and
/// for Schlick's curve. Directions below the horizon count as 0.
float ggx_dielectric_fresnel_fraction(float roughness, float mu, float ior);
float ggx_schlick_fresnel_fraction(float roughness, float mu);

}  // namespace cistern
