#pragma once

#include <optional>

#include "base/rgb.h"
#include "base/vec.h"

namespace cistern {

/// How light gets below a surface, by the names of Blender 5.2: with skin, living tissue, half of it enters diffusely.
/// Before 5.2, RANDOM_WALK was what is RANDOM_WALK_LEGACY since.
enum class SubsurfaceMethod { BURLEY, RANDOM_WALK_LEGACY, RANDOM_WALK_SKIN, RANDOM_WALK };

/// Light that enters a surface, wanders through what lies below it and leaves the same object elsewhere, evenly.
struct Subsurface {
  Vec3 n;
  Rgb weight;  // of what enters, without the albedo
  Rgb albedo;  // of a half space of what lies below
  Rgb radius;  // metres; see subsurface_medium
  SubsurfaceMethod method = SubsurfaceMethod::RANDOM_WALK_LEGACY;
  float anisotropy = 0.0f;
  float ior = 1.4f;            // where rays are refracted on entering
  float alpha = 1.0f;          // and the GGX width there
  float sample_weight = 0.0f;  // unnormalised probability of being chosen among the lobes

  bool is_skin() const { return method == SubsurfaceMethod::RANDOM_WALK_SKIN; }
  /// There is no walk: light leaves as far away as a DiffusionProfile says.
  bool is_profile() const { return method == SubsurfaceMethod::BURLEY; }
};

/// Homogeneous, with the phase function of Henyey and Greenstein.
struct SubsurfaceMedium {
  Rgb sigma_t;         // 1/m
  Rgb single_scatter;  // albedo of one scattering, below 1
  float g = 0.0f;
  Rgb kept{1.0f};  // of the light that enters
};

/// The medium whose half space has the albedo, as far as a fit can say. The radius is its mean free path with
/// RANDOM_WALK. With RANDOM_WALK_LEGACY it is 4 pi mean free paths, Blender's custom since its profiles had that width,
/// corrected for how far scattering leads forward; with skin, the diffusion length of a dipole of that albedo [Jensen
/// et al. 2001]. These two know no medium that scatters backward: for such, their mean free paths are not corrected.
/// As in Cycles, no channel scatters less than 0.2 of what it meets: darker ones keep less of the light instead.
SubsurfaceMedium subsurface_medium(const Subsurface& subsurface);

/// The medium without preferred direction in which light that was scattered often goes as far. [van de Hulst 1980:
/// similarity]
SubsurfaceMedium similar_isotropic(const SubsurfaceMedium& medium);

/// A direction below the surface for light seen from `wo`: refracted at a microfacet that wo sees, no light lost, or
/// diffuse. Empty where it would not enter. `u_choice` decides between the two.
std::optional<Vec3> sample_entry(const Subsurface& subsurface, const Vec3& wo, float u_choice, Vec2 u_direction);

}  // namespace cistern
