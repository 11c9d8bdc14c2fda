#pragma once

#include "shading/lobe_diffuse.h"

namespace cistern {

// Sheen of a layer of fibres, as a cosine lobe stretched by a linear transform:
// f cos = (a / |w'|^2)^2 max(0, w.z) / pi with w' = (a w.x + b w.z, a w.y, w.z) in the frame of n and wo.
// [Zeltner, Burley and Chiang 2022, Practical Multiple-Scattering Sheen Using Linearly Transformed Cosines]
// a, b and the albedo are the rational fits published for MaterialX rather than the paper's tables, which Cycles uses.
// They differ by up to 0.09 in a, 0.04 in b and 0.014 in albedo for roughness above 1/4; below it the lobe hardly
// reflects except at grazing angles. Density: f cos, exactly.

struct Sheen {
  SheenLobe lobe;
  float albedo;  // multiplies f and is not part of it; 0 where there is no sheen
};
/// `roughness` in [0, 1].
Sheen make_sheen(Vec3 n, Vec3 wo, float roughness);

LobeEvaluation evaluate_lobe(const SheenLobe& lobe, Vec3 wo, Vec3 wi);
std::optional<Vec3> sample_lobe(const SheenLobe& lobe, Vec3 wo, float, Vec2 u);

}  // namespace cistern
