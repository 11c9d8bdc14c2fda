#pragma once

#include "shading/lobe_diffuse.h"

namespace cistern {

// A strand of hair that reflects light around the mirror cone of its tangent, or lets it pass. f cos is a density over
// directions: of half the sum of both inclinations, Lorentzian around `shift`, and of the turn about the strand, where
// reflected light falls off like a cosine around the eye and what passes is Lorentzian around the far side. Light is
// reflected up to a right angle from the eye and to the side of n, passes to the other side, and is lost elsewhere:
// from the far side there is none. Not reciprocal; conserves energy where n is across the strand. [Ou, Xie,
// Krishnamachari and Pellacini 2012, ISHair: Importance Sampling for Hair Scattering; as Cycles evaluates it, whose own
// samples reach beyond] Density: the same over what of the turns is within reach, sides of n not counted.

/// `tangent` unit; widths in [0.001, 1], clamped to it.
SimpleHairLobe make_simple_hair(Vec3 tangent, float along, float across, bool passes);

/// Whether its paths should not be joined to other vertices: as wide as a microfacet lobe of kReconnectRoughness.
bool is_smooth(const SimpleHairLobe& lobe);

LobeEvaluation evaluate_lobe(const SimpleHairLobe& lobe, const Vec3& wo, const Vec3& wi);
std::optional<Vec3> sample_lobe(const SimpleHairLobe& lobe, const Vec3& wo, float, Vec2 u);

}  // namespace cistern
