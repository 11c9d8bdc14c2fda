#pragma once

#include "shading/lobe_diffuse.h"

namespace cistern {

// A strand of hair as a tinted glass cylinder of rough surface with tilted scales, seen and lit from the side: what is
// reflected at once, passes, is reflected inside once, or more often. f cos is the sum of A_p M_p N_p over these, which
// conserves energy but for absorption. [Marschner et al. 2003; d'Eon et al. 2011, An Energy-Conserving Hair Reflectance
// Model; Chiang et al. 2016, A Practical and Controllable Hair and Fur Model for Production Path Tracing]
// Density: the same sum, with grey A_p that sum up to 1. Where light leaves the strand is taken to be where it entered.

/// s along a strand, t across it as seen from `wo`, n away from there.
Frame strand_frame(const Vec3& tangent, const Vec3& wo);

struct HairAppearance {
  Rgb absorption;                                                // over the radius of the strand
  float roughness = 0.3f, radial_roughness = 0.3f, coat = 0.0f;  // in [0, 1]; the coat makes reflection sharper
  float ior = 1.55f;
  float tilt = 0.0f;  // of the scales, radians, towards the root
};
/// At a point of normal `ng` on a strand along `tangent`.
HairLobe make_hair(const HairAppearance& hair, Vec3 tangent, Vec3 ng, Vec3 wo);

/// Makes it rough: no variance, and no scale of the distribution across, below `least`. As in Cycles.
void soften(HairLobe& lobe, float least);

LobeEvaluation evaluate_lobe(const HairLobe& lobe, const Vec3& wo, const Vec3& wi);
std::optional<Vec3> sample_lobe(const HairLobe& lobe, const Vec3& wo, float u_branch, Vec2 u);

/// What leaves the strand for light from everywhere; lobe weight not included.
Rgb hair_albedo(const HairLobe& lobe, const Vec3& wo);

/// Colour of a mass of it, for the colour pass of glossy light: the estimate of Cycles, with what is reflected at once.
Rgb hair_color(const HairLobe& lobe, const Vec3& wo);

/// Absorption by which a mass of hair has that colour; fit of [Chiang et al. 2016, eq. 9].
Rgb hair_absorption(Rgb color, float radial_roughness);
/// Absorption by melanin, `amount` in [0, 1] and of that the share `redness` pheomelanin. [d'Eon et al. 2011, §6.1]
Rgb melanin_absorption(float amount, float redness);

}  // namespace cistern
