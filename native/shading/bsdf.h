#pragma once

#include <array>
#include <new>
#include <optional>
#include <variant>

#include "base/direction_guide.h"
#include "base/frame.h"
#include "base/rgb.h"
#include "shading/subsurface.h"
#include "shading/surface_point.h"
#include "shading/thin_film.h"

namespace cistern {

/// How a scattering event counts for max bounces, ray visibility and Light Path nodes: reflection and transmission,
/// each diffuse or glossy.
enum class ScatterKind : uint8_t { DIFFUSE, GLOSSY, TRANSMISSION, TRANSLUCENT };
inline constexpr size_t kScatterKinds = 4;
/// The RayVisibility bit of rays scattered so.
constexpr uint8_t ray_kind(ScatterKind kind) {
  constexpr uint8_t kKinds[kScatterKinds] = {kVisibleToDiffuse, kVisibleToGlossy, kVisibleToTransmission,
                                             kVisibleToTranslucent};
  return kKinds[static_cast<size_t>(kind)];
}

/// Roughness (sqrt of the GGX alpha) below which a lobe is too smooth for its paths to be joined to another
/// vertex: light through it counts as seen directly, not as reflected once.
inline constexpr float kReconnectRoughness = 0.2f;
/// GGX width below which a lobe is narrow: what was scattered towards one direction says little about others.
inline constexpr float kNarrowAlpha = 0.3f;
/// Roughness up to which glass is clear enough to leave the film transparent; Cycles' default.
inline constexpr float kClearRoughness = 0.1f;

// --- Lobes: one file each (lobe_*.h/.cpp). Each documents f, its density and its source.
struct LambertLobe {
  Vec3 n;
};
struct OrenNayarLobe {
  Vec3 n;
  float a = 1.0f, b = 0.0f;
  Rgb multi_scatter;
};
struct TranslucentLobe {
  Vec3 n;
};
/// Scatters to the other side what an Oren-Nayar surface reflects.
struct RoughTranslucentLobe : OrenNayarLobe {};
struct SheenLobe {
  Vec3 n;
  float a = 1.0f, b = 0.0f;
};
struct VelvetLobe {
  Vec3 n;
  float sigma = 1.0f;
};

/// Even up to `size` from its axis, then fading out over `fade`, but not beyond a right angle; radians.
struct ToonCone {
  float size = 0.5f, fade = 0.0f;
};
inline float half_angle(const ToonCone& cone) { return std::min(cone.size + cone.fade, 0.5f * kPi); }
struct ToonDiffuseLobe {
  Vec3 n;
  ToonCone cone;
};
struct ToonGlossyLobe {
  Vec3 n;
  ToonCone cone;
};

enum class FresnelModel : uint8_t {
  NONE,
  DIELECTRIC,
  GENERALIZED_SCHLICK,
  F82_TINT,
  FILM_ON_DIELECTRIC,
  FILM_ON_METAL,
  CONDUCTOR
};
enum class Microfacets : uint8_t { GGX, BECKMANN, ASHIKHMIN_SHIRLEY };
/// Reflection, refraction, or both (glass; but of Ashikhmin and Shirley's). `alpha_*` 0 is a perfect mirror (a delta
/// lobe). `tangent` is unit and orthogonal to n; read only where alpha_x and alpha_y differ.
struct MicrofacetLobe {
  Vec3 n, tangent;
  float alpha_x = 0.0f, alpha_y = 0.0f;
  float ior = 1.0f;  // of the far side relative to the near one
  bool reflects = true, transmits = false;
  bool is_sheet = false;  // transmits what facets would reflect, mirrored: a thin sheet, with an `ior` of 1
  Microfacets microfacets = Microfacets::GGX;
  FresnelModel fresnel = FresnelModel::NONE;
  Rgb f0,
      f90_or_b;  // GENERALIZED_SCHLICK: F0, F90; F82_TINT: F0, b; those they are without their film; CONDUCTOR: n, k
  Rgb reflection_tint{1.0f}, transmission_tint{1.0f};
  float energy_scale = 1.0f;  // multiple-scattering compensation
  ThinFilm film;              // of FILM_ON_DIELECTRIC, FILM_ON_METAL and, if any, CONDUCTOR
};

/// A strand of hair along `tangent`. `h` in [-1, 1] is where across it the point lies as seen from wo.
struct HairLobe {
  Vec3 n, tangent;
  Rgb absorption;
  float variance = 0.0f, coat_variance = 0.0f;  // along the strand; of what is reflected at once
  float scale = 0.0f;                           // of the logistic distribution across it
  float h = 0.0f, ior = 1.55f, tilt = 0.0f;
  bool is_smooth = false;
};

/// A simpler strand, of its light either what is reflected or what passes; radians.
struct SimpleHairLobe {
  Vec3 n, tangent;
  float along = 0.1f, across = 1.0f;  // widths of the distributions
  float shift = 0.0f;                 // of the mirror direction, towards the tip
  bool passes = false;
};

/// One way of light through a strand of rough glass, lobe_microfacet_hair.h.
struct MicrofacetHairLobe {
  /// At once; out of the inside; after many turns there.
  enum class Way : uint8_t { REFLECTED, LEFT, SPREAD };
  Vec3 n;
  Vec3 origin;          // LEFT: back along the light inside; SPREAD: along the strand; else wo
  Vec3 facing, tilted;  // normals of the strand and of its scales where light meets it last, on the side of `origin`
  float alpha = 0.3f;   // GGX width
  float ior = 1.55f;
  Way way = Way::REFLECTED;
};

struct Lobe {
  std::variant<LambertLobe, OrenNayarLobe, TranslucentLobe, SheenLobe, ToonDiffuseLobe, MicrofacetLobe, HairLobe,
               ToonGlossyLobe, VelvetLobe, RoughTranslucentLobe, SimpleHairLobe, MicrofacetHairLobe>
      model;
  Rgb weight;                  // multiplies f
  Rgb even;                    // its part of the even part, below; black unless diffuse
  float sample_weight = 0.0f;  // unnormalised probability of choosing this lobe
  float albedo = 0.0f;         // about what it scatters: the same unless sharp lobes are preferred, see lobe_choice.h
};

/// Density by which directions of lobes that are not smooth are sampled: their own; or the same for all of them, by the
/// cosine to ns or evenly over the hemispheres they scatter into.
enum class RoughSampling : uint8_t { BSDF, COSINE, UNIFORM };

/// Where light that reaches a point comes from in place of what lies behind: a ray from another place in another
/// direction.
struct RayPortal {
  Rgb weight;
  Vec3 position, direction;  // the latter unit
};

/// The scattering at one point: a sum of lobes, what passes straight through, and what is emitted. Lobes beyond `count`
/// are never touched: neither constructed nor copied, since most materials have one and a Bsdf is made at every hit.
struct Bsdf {
  static constexpr int kMaxLobes = 64;  // as Cycles
  static constexpr int kMaxSubsurfaces = 16, kMaxPortals = 16;
  int count = 0;
  int subsurface_count = 0;  // light that leaves elsewhere, beside the lobes
  int portal_count = 0;
  Rgb transparency;                  // weight of light passing through, straight or by way of ray portals
  Rgb emission;                      // radiance towards wo
  float holdout = 0.0f;              // in [0, 1]
  Vec3 ng, wo;                       // of the surface point: unit, same side
  Vec3 ns;                           // interpolated normal, before bump mapping; zero: ng, without bump shadowing
  Vec3 bump_ns;                      // bent by displacement: what bump shadowing compares normals with; zero: ns
  bool corrects_bumps = true;        // false: bump shadowing only keeps light off where normals disagree about sides
  bool is_strand = false;            // lobes go by their own normals alone, wherever these point, as in Cycles 5.0
  float total_sample_weight = 0.0f;  // of the lobes and subsurfaces, transparency not included
  float even_shade = 0.0f;           // of the layers above diffuse lobes, see even_transmittance
  Vec3 even_normal;                  // of those layers
  RoughSampling rough_sampling = RoughSampling::BSDF;
  GlossLimits gloss;                    // of the path, for those who add lobes
  uint8_t ray_kind = kVisibleToCamera;  // the same: PathState::ray_kind
  bool disperses = false;               // refracts light by its wavelength: it is the BSDF of that of the path
  float wavelength = 0.0f;              // the same: PathState::wavelength
  /// Lobes that are not narrow take a share of their directions from it, as far as they could have been their own:
  /// elsewhere its density counts as 0. What it refers to lives longer than the Bsdf.
  DirectionGuide guide;
  union {
    std::array<Lobe, kMaxLobes> lobes;  // the first `count` are valid; late, so that what is read lies together
  };
  union {
    std::array<Subsurface, kMaxSubsurfaces> subsurfaces;  // the same
  };
  union {
    std::array<RayPortal, kMaxPortals> portals;  // the same
  };

  Bsdf() {}
  Bsdf(const Bsdf& other) { *this = other; }
  Bsdf& operator=(const Bsdf& other);

  bool scatters() const { return count > 0 || subsurface_count > 0; }
};

inline const Vec3& bump_reference(const Bsdf& bsdf) { return bsdf.bump_ns == Vec3{} ? bsdf.ns : bsdf.bump_ns; }

/// Whether lobes of this model know nothing of wo but by fading out where layers above them do.
template <class Model>
inline constexpr bool kIsDiffuse = !std::is_same_v<Model, MicrofacetLobe> && !std::is_same_v<Model, HairLobe> &&
                                   !std::is_same_v<Model, ToonGlossyLobe> && !std::is_same_v<Model, VelvetLobe> &&
                                   !std::is_same_v<Model, SimpleHairLobe> && !std::is_same_v<Model, MicrofacetHairLobe>;

/// Whether the lobe is black for all directions: bump shadowing leaves nothing of diffuse ones whose normal is bent
/// away from its reference by more than a right angle.
template <class Model>
bool is_bent_away(const Bsdf& bsdf, const Model& model) {
  return kIsDiffuse<Model> && !bsdf.is_strand && dot(model.n, bump_reference(bsdf)) < 0.0f;
}

/// The lobe of that model and normal, or none; of models that have nothing but a normal.
template <class Model>
Lobe* find_equal(Bsdf& bsdf, const Model& model) {
  for (int i = 0; i < bsdf.count; ++i) {
    Lobe& lobe = bsdf.lobes[static_cast<size_t>(i)];
    if (const auto* other = std::get_if<Model>(&lobe.model); other && other->n == model.n) return &lobe;
  }
  return nullptr;
}

/// Adds a lobe: to one that differs in nothing but weights, or appended and built in place. Nothing happens, and false
/// is returned, where it is bent away, without a finite sample weight above 0 or once there are kMaxLobes. What a lobe
/// adds to guesses of what a point scatters it thus adds to what is scattered.
template <class Model>
bool add_lobe(Bsdf& bsdf, const Model& model, Rgb weight, float sample_weight, Rgb even = {}) {
  if (is_bent_away(bsdf, model) || !(sample_weight > 0.0f) || !std::isfinite(sample_weight)) return false;
  if constexpr (std::is_same_v<Model, LambertLobe> || std::is_same_v<Model, TranslucentLobe>) {
    if (Lobe* lobe = find_equal(bsdf, model)) {
      lobe->weight += weight;
      lobe->even += even;
      lobe->sample_weight += sample_weight;
      lobe->albedo += sample_weight;
      bsdf.total_sample_weight += sample_weight;
      return true;
    }
  }
  if (bsdf.count >= Bsdf::kMaxLobes) return false;
  new (&bsdf.lobes[static_cast<size_t>(bsdf.count++)]) Lobe{model, weight, even, sample_weight, sample_weight};
  bsdf.total_sample_weight += sample_weight;
  return true;
}

/// Adds a subsurface under the same conditions; as a Lambert lobe beyond kMaxSubsurfaces, and what has a radius below
/// `least_radius` (metres): rounding would show where light leaves.
void add_subsurface(Bsdf& bsdf, Subsurface subsurface, float least_radius);

/// Adds a ray portal, also to the transparency; nothing happens beyond kMaxPortals.
void add_portal(Bsdf& bsdf, const RayPortal& portal);

/// f(wo, wi) |cos(theta_i)| summed over the lobes, split by lobe: `smooth` from lobes with roughness below
/// kReconnectRoughness, `rough` from the others. Delta lobes contribute nothing.
/// `pdf` is the density of `sample_bsdf` for wi, per solid angle (delta lobes excluded but counted in the choice).
/// A lobe is 0 where wi lies on different sides of its normal and of ns, but on strands, where neither ns nor ng
/// matter. Elsewhere: Where ns and ng disagree about the side, a ray would leave through the wrong side of the flat
/// triangle. Such directions are never sampled, and their density is 0. What narrow microfacet lobes reflect there, all
/// that these transmit, glossy toon and hair are 0, too; for all others what arrives from there is left to next-event
/// estimation, whose shadow rays know the smooth surface (shadow_origin.h). Diffuse lobes on bump-mapped normals fade
/// out near the horizon of ns. [Conty Estevez et al. 2019, A Microfacet-Based Shadowing Function to Solve the Bump
/// Terminator Problem] `pdf_by_kind` has its parts by the kind of the lobe that is chosen, indexed by ScatterKind; a
/// guide has no kind of its own, and its part is divided like that of the lobes which it stands in for.
///
/// The even part is what all viewers of the point agree about: a sum of Lambert lobes f_even(wi) which does not know
/// wo. Towards wo it sends `even_transmittance` times what f_even reflects; that is close to what diffuse lobes send,
/// and seldom more. Its `even_cos` is 0 wherever `pdf` is.
struct BsdfEvaluation {
  Rgb rough_cos, smooth_cos, even_cos;
  float pdf = 0.0f, unguided_pdf = 0.0f;  // the second as if there were no guide
  float albedo_pdf = 0.0f;                // nor any lobe preferred
  std::array<float, kScatterKinds> pdf_by_kind{};
  Rgb total_cos() const { return rough_cos + smooth_cos; }
};
/// Lobes whose kind is not among the RayVisibility bits of `visibility` add nothing to
/// f but stay in the pdf: so lights can be hidden from a kind of scattering.
BsdfEvaluation evaluate_bsdf(const Bsdf& bsdf, const Vec3& wi, uint8_t visibility = kVisibleToAll);

/// What the layers above an even part let out towards a direction at that cosine, over what they let out head-on: by
/// Schlick's curve, `shade` of it.
inline float even_transmittance(float shade, float cos_o) {
  const float m = 1.0f - clamp01(cos_o);
  return 1.0f - shade * (sqr(sqr(m)) * m);
}

/// One direction. Weights are f cos / pdf over all lobes (for a delta lobe: its own weight / probability).
/// `pdf` is per solid angle, or for `is_delta` the discrete probability of the lobe; `kind_pdf` is its part by lobes of
/// the same kind, `albedo_pdf` what it would be without a guide and a preference for lobes (of a delta lobe nothing);
/// `guide_gain` is `pdf` over what it would be without a guide.
/// With a `subsurface`, light leaves elsewhere: there is no wi, and `smooth_weight` is that of what enters over `pdf`,
/// the probability of the choice.
struct BsdfSample {
  Vec3 wi;
  Rgb rough_weight, smooth_weight;
  Rgb even_cos;  // as BsdfEvaluation has it
  float pdf = 0.0f, kind_pdf = 0.0f, albedo_pdf = 0.0f, guide_gain = 1.0f;
  ScatterKind kind = ScatterKind::DIFFUSE;
  bool is_delta = false;
  bool is_clear = false;  // refracted by a lobe of at most kClearRoughness
  const Subsurface* subsurface = nullptr;
  Rgb total_weight() const { return rough_weight + smooth_weight; }
};
/// Empty when the sample is absorbed (below the surface or zero weight). Uses two dimensions for the direction
/// and one for the lobe. Transparency is not sampled here.
std::optional<BsdfSample> sample_bsdf(const Bsdf& bsdf, float u_lobe, Vec2 u_direction);

/// What render passes call diffuse, glossy and transmission. Unlike kinds of rays these are kinds of lobes, as in
/// Cycles: all light of diffuse lobes is diffuse, the translucent ones included, and all of hair glossy but for what a
/// simple one lets pass; of glass, what goes through is transmission.
enum class PassKind : uint8_t { DIFFUSE, GLOSSY, TRANSMISSION };
inline constexpr size_t kPassKinds = 3;
/// Indexed by PassKind.
using KindColors = std::array<Rgb, kPassKinds>;
/// The parts of BsdfEvaluation::rough_cos and smooth_cos.
struct BsdfKinds {
  KindColors rough{}, smooth{};
};
BsdfKinds evaluate_kinds(const Bsdf& bsdf, const Vec3& wi, uint8_t visibility = kVisibleToAll);
/// For the colour passes: estimates of the directional albedo, those of `bsdf_albedo` but for hair.
KindColors albedo_by_kind(const Bsdf& bsdf);
/// Each over the sum of all, by channel; 0 where that is 0.
KindColors shares_of(const KindColors& colors);
/// All of one kind.
KindColors all_of(PassKind kind);

/// Whether the lobe is below kReconnectRoughness.
bool is_smooth(const Lobe& lobe);
/// Whether the lobe is narrow; smooth ones are.
bool is_narrow(const Lobe& lobe);
/// Whether the lobe scatters to the far side of the surface.
bool transmits(const Lobe& lobe);
Vec3 normal_of(const Lobe& lobe);
/// Whether light may arrive at lobes from below ns without passing: on strands whose normals are bent.
bool turns_away(const Bsdf& bsdf);

/// Kinds of rays that lobes which are not delta lobes can scatter, as RayVisibility bits.
uint8_t scattered_kinds(const Bsdf& bsdf);
/// Kind of the lobe that is sampled most; of those that transmit, of what passes. The Bsdf must scatter.
ScatterKind strongest_kind(const Bsdf& bsdf);

/// What users set, mean over the lobes that reflect or refract by their weights; 1 without any. Hair counts as rough.
float mean_roughness(const Bsdf& bsdf);

/// Directional albedo estimate for denoising, [0, 1] for conserving materials; and the mean shading normal.
Rgb bsdf_albedo(const Bsdf& bsdf);
Vec3 bsdf_normal(const Bsdf& bsdf);

}  // namespace cistern
