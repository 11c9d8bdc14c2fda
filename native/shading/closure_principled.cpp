// The Principled BSDF as Cycles 5.0 layers it: alpha, then sheen over coat over emission, then metal, glass and a
// dielectric over diffuse. A layer takes from those below what it reflects itself, in the strongest channel.
// [OpenPBR 1.1] describes the same stack; the order of factors follows Cycles. Of thin walls, as Cycles 5.2 has them,
// glass is a sheet with both its faces, and what would get below the surface leaves on either side.
#include "shading/closure_parts.h"
#include "shading/dispersion.h"
#include "shading/fresnel.h"
#include "shading/thin_sheet.h"

namespace cistern {
namespace {

constexpr float kDefaultSpecularLevel = 0.5f;  // leaves F0 to the index

/// Operands by name; scene/op_table.cpp lists them.
struct Principled {
  std::span<const Vec3> in;

  float scalar(size_t i) const { return in[i].x; }
  float weight() const { return scalar(0); }
  Rgb base_color() const { return non_negative(to_rgb(in[1])); }
  float metallic() const { return clamp01(scalar(2)); }
  float roughness() const { return clamp01(scalar(3)); }
  float ior() const { return std::max(scalar(4), kMinIor); }
  float alpha() const { return clamp01(scalar(5)); }
  Vec3 normal() const { return in[6]; }
  float diffuse_roughness() const { return clamp01(scalar(7)); }
  float subsurface() const { return clamp01(scalar(8)); }
  float specular_level() const { return std::max(scalar(9), 0.0f); }
  Rgb specular_tint() const { return non_negative(to_rgb(in[10])); }
  float anisotropic() const { return clamp01(scalar(11)); }
  float rotation() const { return scalar(12); }
  Vec3 tangent() const { return in[13]; }
  float transmission() const { return clamp01(scalar(14)); }
  float coat() const { return std::max(scalar(15), 0.0f); }
  float coat_roughness() const { return clamp01(scalar(16)); }
  float coat_ior() const { return std::max(scalar(17), 1.0f); }
  Rgb coat_tint() const { return non_negative(to_rgb(in[18])); }
  Vec3 coat_normal() const { return in[19]; }
  float sheen() const { return std::max(scalar(20), 0.0f); }
  float sheen_roughness() const { return clamp01(scalar(21)); }
  Rgb sheen_tint() const { return non_negative(to_rgb(in[22])); }
  Rgb emission() const { return to_rgb(in[23]) * scalar(24); }
  Rgb subsurface_radius() const { return non_negative(to_rgb(in[25]) * scalar(26)); }
  float subsurface_ior() const { return scalar(27); }
  float subsurface_anisotropy() const { return scalar(28); }
  ThinFilm film() const { return {scalar(29), scalar(30)}; }
  float inverse_abbe() const { return std::max(scalar(31), 0.0f); }
};

bool compensates(const int32_t* parameters) { return parameters[0] != 0; }
bool covers_metal(const int32_t* parameters) { return (parameters[2] & 1) != 0; }
bool has_anisotropic_glass(const int32_t* parameters) { return (parameters[2] & 2) != 0; }
bool has_dim_base(const int32_t* parameters) { return (parameters[2] & 4) != 0; }
bool has_whole_coat(const int32_t* parameters) { return (parameters[2] & 8) != 0; }
bool is_thin(const int32_t* parameters) { return parameters[3] != 0; }
float sheet_width(const Principled& p, const int32_t* parameters) {
  return sheet_alpha(sqr(p.roughness()), p.ior(), parameters[3] == 2);
}

/// What layers have left for those below them.
struct Remainder {
  Rgb weight;
  Rgb even;               // seen head-on, so that it is the same for all who look: the even part of a BSDF
  float unshaded = 1.0f;  // of what leaves head-on, what leaves at grazing angles

  /// Takes a layer off: of that albedo, its weight included, which reflects `head_on` of what meets it there and
  /// `shade` of the rest at grazing angles.
  void put_below(Rgb layer_albedo, float head_on, float shade) {
    const auto ratio = [](float a, float w) { return w != 0.0f ? a / w : 0.0f; };
    const float strongest =
        std::max({ratio(layer_albedo.r, weight.r), ratio(layer_albedo.g, weight.g), ratio(layer_albedo.b, weight.b)});
    weight *= clamp01(1.0f - strongest);
    even *= clamp01(1.0f - head_on);
    unshaded *= 1.0f - clamp01(shade);
  }
  void scale(float s) { weight *= s, even *= s; }
};

/// For put_below, of a microfacet layer: the rougher, the less it differs. Fitted to albedos with an index of 1.5.
float grazing_shade(float alpha) {
  const float smooth = 1.0f - clamp01(alpha);
  return smooth * smooth * smooth;
}

/// Beer's law for the refracted ray: the tint is that of the ray head-on.
Rgb coat_passage(const Principled& p, float cos_o) {
  const Rgb tint = p.coat_tint();
  if (tint == Rgb(1.0f)) return tint;
  return passage(tint, std::sqrt(1.0f - (1.0f - sqr(cos_o)) / sqr(p.coat_ior())));
}

/// `albedo`: of the coat, its weight included. Where it covers a part, that part alone is both dimmed and tinted from
/// Blender 5.3 on, by what facets reflect at once; before, all is dimmed by the share that is reflected, what facets
/// lose between them taken off, and then tinted by the share that is covered.
void put_below_coat(Remainder& rest, const Principled& p, const MicrofacetLobe& coat, Rgb albedo, Vec3 wo,
                    bool is_whole) {
  constexpr float kEvenCosine = 0.5f;
  const float head_on = f0_from_ior(coat.ior), shade = p.coat() * grazing_shade(coat.alpha_x);
  const Rgb passed = coat_passage(p, dot(wo, coat.n)), passed_evenly = coat_passage(p, kEvenCosine);
  if (!is_whole) {
    rest.put_below(albedo, p.coat() * head_on, shade);
    rest.weight *= lerp(Rgb(1.0f), passed, p.coat());
    rest.even *= lerp(Rgb(1.0f), passed_evenly, p.coat());
    return;
  }
  const float reflected = is_black(albedo) ? 0.0f : max_component(microfacet_albedo(coat, wo));
  const auto left = [&](float reflectance, Rgb passage) {
    return saturate(lerp(Rgb(1.0f), (1.0f - reflectance) * passage, p.coat()));
  };
  rest.weight *= left(reflected, passed);
  rest.even *= left(head_on, passed_evenly);
  rest.unshaded *= 1.0f - clamp01(shade);
}

/// Sheen and coat; returns what is left for those below them.
Remainder add_top_layers(Bsdf& bsdf, const Principled& p, Vec3 n, const SurfacePoint& point, bool has_whole_coat) {
  const Rgb whole(p.weight() * p.alpha());
  Remainder rest{whole, whole};
  const bool has_sheen = p.sheen() > kNegligibleWeight, has_coat = p.coat() > kNegligibleWeight;
  if (!has_sheen && !has_coat) return rest;
  const Vec3 coat_normal = closure_normal(p.coat_normal(), point);
  if (has_sheen) {
    const Vec3 sheen_normal = normalize_or(lerp(n, coat_normal, clamp01(p.coat())), n);
    constexpr float kSheenHeadOn = 0.1f;
    const Rgb color = p.sheen() * p.sheen_tint() * rest.weight;
    rest.put_below(add_sheen(bsdf, sheen_normal, p.sheen_roughness(), color), kSheenHeadOn * p.sheen(), p.sheen());
  }
  if (has_coat) {
    MicrofacetLobe coat = make_microfacet(specular_normal(coat_normal, point), sqr(p.coat_roughness()));
    coat.fresnel = FresnelModel::DIELECTRIC;
    coat.ior = p.coat_ior();
    const Rgb mean(fresnel_dielectric_average(coat.ior));
    const Rgb albedo = add_microfacet(bsdf, coat, p.coat() * rest.weight, mean);
    put_below_coat(rest, p, coat, albedo, point.wo, has_whole_coat);
  }
  const float strongest = std::max(p.coat(), max_component(p.sheen() * p.sheen_tint()));
  if (strongest > 1.0f) rest.even = {};  // seen from some side there may be nothing left
  return rest;
}

void add_metal(Bsdf& bsdf, const Principled& p, Vec3 n, const Anisotropy& anisotropy, Rgb weight,
               const int32_t* parameters) {
  MicrofacetLobe lobe = make_microfacet(n, 0.0f);
  set_anisotropy(lobe, anisotropy);
  lobe.fresnel = FresnelModel::F82_TINT;
  lobe.f0 = saturate(p.base_color());
  lobe.f90_or_b = f82_coefficient(lobe.f0, saturate(p.specular_tint()));
  if (covers_metal(parameters)) put_film_on(lobe, p.film());
  std::optional<Rgb> mean;
  if (compensates(parameters)) mean = fresnel_f82_average(lobe.f0, lobe.f90_or_b);
  add_microfacet(bsdf, lobe, weight, mean);
}

void add_glass(Bsdf& bsdf, const Principled& p, Vec3 n, const Anisotropy& facets, Rgb weight, const SurfacePoint& point,
               bool compensate) {
  float ior = p.ior();
  if (p.inverse_abbe() > 0.0f && bsdf.wavelength > 0.0f) {
    bsdf.disperses = true;
    ior = dispersed_ior(ior, p.inverse_abbe(), bsdf.wavelength);
  }
  MicrofacetLobe lobe = make_refraction(n, facets, ior, point, true);
  lobe.fresnel = FresnelModel::GENERALIZED_SCHLICK;
  lobe.f0 = saturate(f0_from_ior(p.ior()) * p.specular_tint());
  lobe.f90_or_b = Rgb(1.0f);
  const Rgb base = saturate(p.base_color());
  lobe.transmission_tint = {std::sqrt(base.r), std::sqrt(base.g), std::sqrt(base.b)};  // passed twice: in and out
  put_film_around(lobe, p.film(), ior, point);
  std::optional<Rgb> mean;
  if (compensate) mean = mean_schlick_reflectance(lobe);
  add_microfacet(bsdf, lobe, weight, mean);
}

/// A face of a thin wall, met from outside or from inside.
MicrofacetLobe sheet_face(const Principled& p, bool is_inside) {
  MicrofacetLobe face;
  face.transmits = true;
  face.ior = is_inside ? 1.0f / p.ior() : p.ior();
  face.fresnel = FresnelModel::GENERALIZED_SCHLICK;
  face.f0 = saturate(f0_from_ior(p.ior()) * p.specular_tint());
  face.f90_or_b = Rgb(1.0f);
  ThinFilm film = p.film();
  if (is_inside) film.ior /= p.ior();
  put_film_on(face, film);
  return face;
}

SheetOptics sheet_of(const Principled& p, Vec3 n, Vec3 wo) {
  return sheet_optics(sheet_face(p, false), sheet_face(p, true), saturate(p.base_color()), clamp01(dot(n, wo)));
}

/// What passes it is not bent, and to all but the camera as if nothing was there.
bool is_clear_sheet(const Principled& p, const int32_t* parameters) {
  return sqr(sheet_width(p, parameters)) <= kDeltaAlphaProduct;
}

/// Of a clear sheet below all its layers, whatever of them paths keep back: shadow rays know nothing of that.
Rgb sheet_transparency(const Principled& p, Vec3 n, const SurfacePoint& point, bool has_whole_coat) {
  Bsdf layers;
  layers.ng = point.ng;
  layers.wo = point.wo;
  const Rgb weight =
      (1.0f - p.metallic()) * p.transmission() * add_top_layers(layers, p, n, point, has_whole_coat).weight;
  const Rgb through = weight * sheet_of(p, specular_normal(n, point), point.wo).transmittance;
  return is_negligible(through) ? Rgb(0.0f) : through;
}

/// Both lobes with the energy that facets lose.
void add_sheet(Bsdf& bsdf, const Principled& p, Vec3 n, Rgb weight, const int32_t* parameters) {
  const SheetOptics optics = sheet_of(p, n, bsdf.wo);
  MicrofacetLobe reflection = make_microfacet(n, sqr(p.roughness()));
  add_microfacet(bsdf, reflection, weight * optics.reflectance, p.specular_tint());
  MicrofacetLobe transmission = make_microfacet(n, sheet_width(p, parameters));
  transmission.reflects = false;
  transmission.transmits = true;
  if (is_clear_sheet(p, parameters)) {
    if (bsdf.ray_kind == kVisibleToCamera) add_microfacet(bsdf, transmission, weight * optics.transmittance, {});
    return;
  }
  transmission.is_sheet = true;
  add_microfacet(bsdf, transmission, weight * optics.transmittance, Rgb(1.0f));
}

/// The dielectric interface above the diffuse base, of which it returns the index; `rest` is then what is left for the
/// base.
float add_specular(Bsdf& bsdf, const Principled& p, Vec3 n, const Anisotropy& anisotropy, Remainder& rest,
                   bool compensate, const SurfacePoint& point) {
  float ior = p.ior();
  float f0 = f0_from_ior(ior);
  if (p.specular_level() != kDefaultSpecularLevel) {
    f0 *= 2.0f * p.specular_level();
    ior = p.ior() < 1.0f ? 1.0f / ior_from_f0(f0) : ior_from_f0(f0);
  }
  const ThinFilm film = p.film();
  if (ior == 1.0f && !has_film(film)) return ior;
  MicrofacetLobe lobe = make_microfacet(specular_normal(n, point), 0.0f);
  set_anisotropy(lobe, anisotropy);
  lobe.fresnel = FresnelModel::GENERALIZED_SCHLICK;
  lobe.ior = ior;
  lobe.f0 = saturate(f0 * p.specular_tint());
  lobe.f90_or_b = Rgb(1.0f);
  put_film_on(lobe, film);
  std::optional<Rgb> mean;
  if (compensate) mean = mean_schlick_reflectance(lobe);
  const Rgb albedo = add_microfacet(bsdf, lobe, rest.weight, mean);
  if (has_film(film))  // the albedo is then that of a smooth surface
    rest.put_below(albedo, largest_film_reflectance(lobe.film, ior), grazing_shade(0.0f));
  else
    rest.put_below(albedo, max_component(lobe.f0), grazing_shade(std::sqrt(lobe.alpha_x * lobe.alpha_y)));
  return ior;
}

/// `ior` of the interface above.
void add_subsurface(Bsdf& bsdf, const Principled& p, Vec3 n, Rgb weight, const int32_t* parameters, float ior,
                    const SurfacePoint& point) {
  Subsurface subsurface{specular_normal(n, point), weight, saturate(p.base_color()), p.subsurface_radius()};
  subsurface.method = subsurface_method(parameters[1]);
  set_boundary(subsurface, subsurface.is_skin() ? p.subsurface_ior() : ior, sqr(clamp01(p.roughness())),
               p.subsurface_anisotropy());
  add_subsurface(bsdf, subsurface, least_radius(point, subsurface.method));
}

/// In place of what gets below the surface of thick things: a part is reflected and a part comes out on the other side.
void add_thin_subsurface(Bsdf& bsdf, const Principled& p, Vec3 n, const Remainder& rest, bool is_dim) {
  const Rgb color = p.subsurface() * saturate(p.base_color());
  const float reflected = clamp01(0.5f * (1.0f - p.subsurface_anisotropy()));
  const float passed = clamp01(0.5f * (1.0f + p.subsurface_anisotropy()));
  const auto add = [&](const auto& lobe, float share) {
    add_diffuse(bsdf, lobe, share * color * rest.weight, share * color * rest.even);
  };
  if (p.diffuse_roughness() < kNegligibleWeight) {
    add(LambertLobe{n}, reflected);
    add(TranslucentLobe{n}, passed);
    return;
  }
  const OrenNayarLobe rough = make_oren_nayar(n, bsdf.wo, p.diffuse_roughness(), saturate(p.base_color()), is_dim);
  add(rough, reflected);
  add(RoughTranslucentLobe{rough}, passed);
}

void add_base(Bsdf& bsdf, const Principled& p, Vec3 n, const Remainder& rest, bool is_dim) {
  const Rgb base = p.base_color();
  const Rgb color = base * (1.0f - p.subsurface());
  if (p.diffuse_roughness() < kNegligibleWeight)
    add_diffuse(bsdf, LambertLobe{n}, color * rest.weight, color * rest.even);
  else
    add_diffuse(bsdf, make_oren_nayar(n, bsdf.wo, p.diffuse_roughness(), base, is_dim), color * rest.weight,
                color * rest.even);
  if (1.0f - rest.unshaded > bsdf.even_shade) {
    bsdf.even_shade = 1.0f - rest.unshaded;
    bsdf.even_normal = n;
  }
}

}  // namespace

void add_principled(Bsdf& bsdf, std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point) {
  const Principled p{inputs};
  const Vec3 n = closure_normal(p.normal(), point);
  const bool compensate = compensates(parameters);
  bsdf.transparency += principled_transparency(inputs, parameters, point, bsdf.ray_kind);
  Remainder rest = add_top_layers(bsdf, p, n, point, has_whole_coat(parameters));
  if (const Rgb emission = p.emission(); !is_black(emission)) {
    // A coat that is kept back still dims it: a light is the same one to all paths.
    bsdf.emission +=
        bsdf.gloss.has_reflection ? emission * rest.weight : principled_emission(inputs, parameters, point);
  }

  const Anisotropy anisotropy = disney_anisotropy(p.roughness(), p.anisotropic(), p.tangent(), p.rotation(), n);
  if (const float metallic = p.metallic(); metallic > kNegligibleWeight) {
    add_metal(bsdf, p, specular_normal(n, point), anisotropy, metallic * rest.weight, parameters);
    rest.scale(1.0f - metallic);
  }
  if (const float transmission = p.transmission(); transmission > kNegligibleWeight) {
    const Vec3 glass_normal = specular_normal(n, point);
    if (is_thin(parameters))
      add_sheet(bsdf, p, glass_normal, transmission * rest.weight, parameters);
    else {
      const float alpha = sqr(p.roughness());
      const Anisotropy facets = has_anisotropic_glass(parameters) ? anisotropy : Anisotropy{alpha, alpha, {}};
      add_glass(bsdf, p, glass_normal, facets, transmission * rest.weight, point, compensate);
    }
    rest.scale(1.0f - transmission);
  }
  if (is_negligible(rest.weight)) return;
  const float ior = add_specular(bsdf, p, n, anisotropy, rest, compensate, point);
  if (p.subsurface() > kNegligibleWeight) {
    if (is_thin(parameters))
      add_thin_subsurface(bsdf, p, n, rest, has_dim_base(parameters));
    else
      add_subsurface(bsdf, p, n, p.subsurface() * rest.weight, parameters, ior, point);
  }
  add_base(bsdf, p, n, rest, has_dim_base(parameters));
}

Rgb principled_emission(std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point) {
  const Principled p{inputs};
  const Rgb emission = p.emission();
  if (is_black(emission)) return Rgb(0.0f);
  Bsdf layers;
  layers.ng = point.ng;
  layers.wo = point.wo;
  return emission *
         add_top_layers(layers, p, closure_normal(p.normal(), point), point, has_whole_coat(parameters)).weight;
}

Rgb principled_transparency(std::span<const Vec3> inputs, const int32_t* parameters, const SurfacePoint& point,
                            uint8_t ray_kind) {
  const Principled p{inputs};
  const Rgb weight(p.weight() * (1.0f - p.alpha()));
  const Rgb cut_out = is_negligible(weight) ? Rgb(0.0f) : weight;
  const bool is_sheet = is_thin(parameters) && p.transmission() > kNegligibleWeight && is_clear_sheet(p, parameters);
  if (!is_sheet || ray_kind == kVisibleToCamera) return cut_out;
  return cut_out + sheet_transparency(p, closure_normal(p.normal(), point), point, has_whole_coat(parameters));
}

}  // namespace cistern
