#include "shading/pane_face.h"

#include "shading/lobe_microfacet.h"

namespace cistern {
namespace {

static_assert(0.0035 * 0.0035 * 0.0035 * 0.0035 <= kDeltaAlphaProduct, "MaterialProgram::may_be_pane counts on it");

/// Cosine of a milliradian or so: what normals may be off without being those of a curve.
constexpr float kFlat = 1.0f - 1e-6f;

bool refracts_clearly(const MicrofacetLobe& lobe) { return lobe.transmits && is_delta(lobe); }

}  // namespace

std::optional<PaneFace> find_pane_face(const SurfacePoint& point, const Bsdf& bsdf) {
  if (!is_black(bsdf.transparency)) return {};
  const Lobe* found = nullptr;
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    const auto* model = std::get_if<MicrofacetLobe>(&lobe.model);
    if (!model || !refracts_clearly(*model)) continue;
    if (found) return {};
    found = &lobe;
  }
  if (!found) return {};
  const auto& model = std::get<MicrofacetLobe>(found->model);
  if (dot(model.n, point.ng) < kFlat) return {};
  const std::optional<DeltaSample> refracted = sample_delta_lobe(model, bsdf.wo, kOneMinusEpsilon);
  if (!refracted || !(dot(point.ng, refracted->wi) < 0.0f)) return {};
  return PaneFace{refracted->wi, found->weight * refracted->f};
}

}  // namespace cistern
