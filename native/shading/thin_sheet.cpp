#include "shading/thin_sheet.h"

#include <cmath>
#include <limits>

#include "shading/lobe_microfacet.h"

namespace cistern {

Rgb passage(Rgb tint, float cos_t) {
  if (!(cos_t > 0.0f)) return Rgb(0.0f);
  if (tint == Rgb(1.0f)) return tint;
  const float depth = 1.0f / cos_t;
  return {std::pow(tint.r, depth), std::pow(tint.g, depth), std::pow(tint.b, depth)};
}

SheetOptics sheet_optics(const MicrofacetLobe& front, const MicrofacetLobe& back, Rgb tint, float cos_o) {
  const FresnelTerms in = facet_fresnel(front, cos_o);
  const Rgb pass = passage(tint, in.cos_t);
  if (is_black(pass)) return {in.reflectance, {}};
  const FresnelTerms out = facet_fresnel(back, in.cos_t);
  const Rgb turned = out.reflectance * pass;  // from one face to the other and back off it
  const Rgb leaving = max(Rgb(1.0f) - turned * turned, Rgb(std::numeric_limits<float>::min()));
  const Rgb whole = in.transmittance * pass * out.transmittance / leaving;
  return {in.reflectance + whole * turned, whole};
}

float sheet_alpha(float alpha, float ior, bool is_wide) {
  const float widening = std::max(3.4f * (ior - 1.0f) * (ior - 0.5f) * (ior - 0.5f) / (ior * ior * ior), 0.0f);
  return std::min(alpha * (is_wide ? std::sqrt(widening) : widening), 1.0f);
}

}  // namespace cistern
