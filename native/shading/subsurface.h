#pragma once

#include <optional>

#include "base/rgb.h"
#include "base/vec.h"

namespace cistern {

/// Light that enters a surface, wanders through what lies below it and leaves the same object elsewhere, evenly.
struct Subsurface {
  Vec3 n;
  Rgb weight;  // of what enters, without the albedo
  Rgb albedo;  // of a half space of what lies below
  Rgb radius;  // metres; see subsurface_medium
  float anisotropy = 0.0f;
  float ior = 1.4f;    // where rays are refracted on entering
  float alpha = 1.0f;  // and the GGX width there
  /// Below is living tissue: half of the light enters diffusely, and the radius is how far light gets in all.
  bool is_skin = false;
  bool is_profile = false;     // there is no walk: light leaves as far away as a DiffusionProfile says
  float sample_weight = 0.0f;  // unnormalised probability of being chosen among the lobes
};

/// Homogeneous, with the phase function of Henyey and Greenstein.
struct SubsurfaceMedium {
  Rgb sigma_t;         // 1/m
  Rgb single_scatter;  // albedo of one scattering, below 1
  float g = 0.0f;
};

/// The medium whose half space has the albedo, as far as a fit can say. The mean free path, corrected for how far
/// scattering leads forward, is radius / (4 pi), Blender's custom since its profiles had that width; with skin, the
/// radius is the diffusion length of a dipole of that albedo [Jensen et al. 2001].
SubsurfaceMedium subsurface_medium(const Subsurface& subsurface);

/// The medium without preferred direction in which light that was scattered often goes as far. [van de Hulst 1980:
/// similarity]
SubsurfaceMedium similar_isotropic(const SubsurfaceMedium& medium);

/// A direction below the surface for light seen from `wo`: refracted at a microfacet that wo sees, no light lost, or
/// diffuse. Empty where it would not enter. `u_choice` decides between the two.
std::optional<Vec3> sample_entry(const Subsurface& subsurface, const Vec3& wo, float u_choice, Vec2 u_direction);

}  // namespace cistern
