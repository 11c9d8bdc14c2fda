#include "shading/lobe_albedo.h"

#include "shading/lobe_hair.h"
#include "shading/lobe_microfacet.h"
#include "shading/lobe_microfacet_hair.h"
#include "shading/lobe_velvet.h"

namespace cistern {
namespace {

// For std::visit: the closest of these answers.
Rgb albedo_of(const auto&, const Vec3&) { return Rgb(1.0f); }
Rgb albedo_of(const MicrofacetLobe& lobe, const Vec3& wo) { return microfacet_albedo(lobe, wo); }
Rgb albedo_of(const HairLobe& lobe, const Vec3& wo) { return hair_albedo(lobe, wo); }
Rgb albedo_of(const MicrofacetHairLobe& lobe, const Vec3& wo) { return Rgb(microfacet_hair_albedo(lobe, wo)); }
Rgb albedo_of(const VelvetLobe& lobe, const Vec3& wo) { return Rgb(velvet_albedo(lobe, wo)); }

}  // namespace

Vec3 normal_of(const Lobe& lobe) {
  return std::visit([](const auto& model) { return model.n; }, lobe.model);
}

Rgb lobe_albedo(const Lobe& lobe, const Vec3& wo) {
  return std::visit([&](const auto& model) { return albedo_of(model, wo); }, lobe.model);
}

Rgb lobe_color(const Lobe& lobe, const Vec3& wo) {
  if (const auto* hair = std::get_if<HairLobe>(&lobe.model)) return hair_color(*hair, wo);
  return std::holds_alternative<VelvetLobe>(lobe.model) ? Rgb(1.0f) : lobe_albedo(lobe, wo);
}

Rgb bsdf_albedo(const Bsdf& bsdf) {
  Rgb albedo;
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    albedo += lobe.weight * lobe_albedo(lobe, bsdf.wo);
  }
  for (int i = 0; i < bsdf.subsurface_count; ++i) {
    const Subsurface& subsurface = bsdf.subsurfaces[static_cast<size_t>(i)];
    albedo += subsurface.weight * subsurface.albedo;
  }
  return albedo;
}

Vec3 bsdf_normal(const Bsdf& bsdf) {
  Vec3 sum;
  for (int i = 0; i < bsdf.count; ++i) {
    const Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    sum += normal_of(lobe) * average(lobe.weight);
  }
  for (int i = 0; i < bsdf.subsurface_count; ++i) {
    const Subsurface& subsurface = bsdf.subsurfaces[static_cast<size_t>(i)];
    sum += subsurface.n * average(subsurface.weight * subsurface.albedo);
  }
  return normalize_or(sum, bsdf.ns == Vec3{} ? bsdf.ng : bsdf.ns);
}

}  // namespace cistern
