#pragma once

#include "shading/lobe_diffuse.h"

namespace cistern {

// Light of cartoons: as bright in all of a cone, around the normal or around the mirror direction, with an edge that
// may fade out. f cos is what the cone's even density is times 1, less where it fades: with fading, some light is lost,
// and so is what of a glossy cone lies below the horizon. Neither reciprocal nor a surface that there could be. As in
// Cycles. Density: even in the cone, the fading edge included.

/// `size` and `smooth` in [0, 1], of a right angle.
ToonCone make_toon_cone(float size, float smooth);

LobeEvaluation evaluate_lobe(const ToonDiffuseLobe& lobe, const Vec3& wo, const Vec3& wi);
std::optional<Vec3> sample_lobe(const ToonDiffuseLobe& lobe, const Vec3& wo, float, Vec2 u);

LobeEvaluation evaluate_lobe(const ToonGlossyLobe& lobe, const Vec3& wo, const Vec3& wi);
std::optional<Vec3> sample_lobe(const ToonGlossyLobe& lobe, const Vec3& wo, float, Vec2 u);

}  // namespace cistern
