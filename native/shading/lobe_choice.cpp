#include "shading/lobe_choice.h"

#include <algorithm>
#include <span>

namespace cistern {
namespace {

/// How much more often sharp lobes are chosen, as long as that makes them no more than this share of all: beyond it
/// other lobes would be chosen too seldom. (Variance x time of path tracing at 1, 4 and 8 px with 4, 16 samples, 8
/// seeds: glossy hall 0.90, 0.94 and 0.96, with 8 0.89, 0.96 and 1.02; bedroom, 5 seeds, 1.00, 0.99 and 0.98; outdoors
/// the same within 0.012. All of these without a bound. At first vertices it was worse: outdoors 1.08, 1.06 and 1.05.)
constexpr float kPreference = 4.0f, kMostShare = 0.5f;

/// By which the weights of sharp lobes are multiplied, if `share` of all is theirs.
float preference(float share) {
  const float to_most = kMostShare / (1.0f - kMostShare) * (1.0f - share) / share;
  return std::clamp(to_most, 1.0f, kPreference);
}

}  // namespace

bool is_sharp(const Lobe& lobe) {
  const auto* facets = std::get_if<MicrofacetLobe>(&lobe.model);
  return facets && facets->alpha_x * facets->alpha_y <= sqr(kSharpAlpha);
}

void prefer_sharp_lobes(Bsdf& bsdf) {
  if (bsdf.count + bsdf.subsurface_count < 2) return;
  const std::span<Lobe> lobes(bsdf.lobes.data(), static_cast<size_t>(bsdf.count));
  const float all = bsdf.total_sample_weight;
  float sharp = 0.0f;
  for (const Lobe& lobe : lobes) sharp += is_sharp(lobe) ? lobe.sample_weight : 0.0f;
  if (!(sharp > 0.0f) || !(sharp < all)) return;
  const float factor = preference(sharp / all), scale = all / (all + (factor - 1.0f) * sharp);
  for (Lobe& lobe : lobes) lobe.sample_weight *= is_sharp(lobe) ? factor * scale : scale;
  for (int i = 0; i < bsdf.subsurface_count; ++i) bsdf.subsurfaces[static_cast<size_t>(i)].sample_weight *= scale;
}

}  // namespace cistern
