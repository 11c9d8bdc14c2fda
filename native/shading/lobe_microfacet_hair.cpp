#include "shading/lobe_microfacet_hair.h"

#include "base/rng.h"
#include "shading/albedo_tables.h"
#include "shading/fresnel.h"
#include "shading/ggx.h"
#include "shading/lobe_hair.h"
#include "shading/strand_inclination.h"

namespace cistern {
namespace {

using Way = MicrofacetHairLobe::Way;

constexpr float kSmoothest = 1e-3f;  // GGX width, as in Cycles
/// Of what meets the last interface from inside; the mean facet may reflect all where others do not.
constexpr float kLeastExit = 0.1f;

float width_of(const MicrofacetHair& hair) { return std::clamp(hair.alpha, kSmoothest, 1.0f); }

/// Smith's Lambda of a surface with the same width in all directions.
float lambda(float alpha, float cosine) {
  const float squared = sqr(cosine);
  return 0.5f * (std::sqrt(1.0f + sqr(alpha) * std::max(1.0f - squared, 0.0f) / squared) - 1.0f);
}

/// Masking and shadowing together over the masking of where light comes from.
float shadowing(float alpha, float cos_from, float cos_to) {
  const float from = 1.0f + lambda(alpha, cos_from);
  return from / (from + lambda(alpha, cos_to));
}

/// By how much more light there is than what facets send on at once. [as of glass, albedo_tables.h]
float energy_scale(float alpha, float cosine, float ior) {
  return 1.0f / ggx_glass_albedo(std::sqrt(alpha), cosine, ior);
}

/// A side of a strand's surface in one place.
struct Interface {
  Vec3 facing, tilted;  // normals of the strand and of its scales
  bool is_seen_from(const Vec3& v) const { return dot(facing, v) > 0.0f && dot(tilted, v) > 0.0f; }
};

Vec3 sample_facet(float alpha, const Vec3& tilted, const Vec3& v, Vec2 u) {
  const Frame frame(tilted);
  return frame.to_world(sample_ggx_visible_normal({alpha, alpha}, frame.to_local(v), u));
}

/// Density of facets that are seen from v, times v.h: D(h) v.h / v.tilted, without masking.
float facet_density(const MicrofacetHairLobe& lobe, const Vec3& v, const Vec3& h) {
  const float density = ggx_normal_density({lobe.alpha, lobe.alpha}, Frame(lobe.tilted).to_local(h));
  return density * dot(v, h) / dot(lobe.tilted, v);
}

/// Direction in which light goes on that came from `v`; `ior` of the far side over the near one.
Vec3 refracted(const Vec3& v, const Vec3& h, float cos_t, float ior) { return (dot(v, h) / ior - cos_t) * h - v / ior; }

/// A cross-section: an ellipse with a half axis of 1 along x and one of `minor` along z; y is along the strand. Places
/// on it are (sin a, minor cos a), a their angle.
class Section {
 public:
  Section(const MicrofacetHair& hair, const Vec3& tangent, const Vec3& ng, const Vec3& wo)
      : minor_(std::clamp(hair.aspect_ratio > 1.0f ? 1.0f / hair.aspect_ratio : hair.aspect_ratio, 1e-3f, 1.0f)),
        frame_(make_frame(hair, tangent, wo)),
        o_(frame_.to_local(wo)) {
    const float across = std::max(std::sqrt(sqr(o_.x) + sqr(o_.z)), 1e-12f);
    seen_ = std::sqrt(sqr(o_.z) + sqr(minor_ * o_.x)) / across;
    offset_ = -dot(strand_frame(tangent, wo).t, ng);
  }

  const Frame& frame() const { return frame_; }
  const Vec3& view() const { return o_; }
  bool is_beside() const { return std::abs(offset_) >= seen_; }
  /// Where the ray of the view meets it, or one at that share of its half width.
  float first_place() const { return place_seen_at(std::clamp(offset_ / seen_, -1.0f, 1.0f)); }
  float place_seen_at(float share) const { return std::atan2(minor_ * o_.x, o_.z) - std::asin(share); }
  /// Normals on the side that light in direction `d` from place `a` meets from inside.
  float next_inner_angle(float a, const Vec3& d) const { return 2.0f * std::atan2(minor_ * d.x, d.z) - a; }
  float distance(float a, float b) const {
    return std::sqrt(sqr(std::sin(a) - std::sin(b)) + sqr(minor_ * (std::cos(a) - std::cos(b))));
  }
  Interface interface_at(float a, float lean) const {
    const Vec3 facing = normalize({minor_ * std::sin(a), 0.0f, std::cos(a)});
    return {facing, std::cos(lean) * facing + Vec3{0.0f, std::sin(lean), 0.0f}};
  }

 private:
  Frame make_frame(const MicrofacetHair& hair, const Vec3& tangent, const Vec3& wo) const {
    if (minor_ == 1.0f) {
      const Frame towards = strand_frame(tangent, wo);
      return {towards.t, tangent, -towards.n};
    }
    const auto across = [&](const Vec3& v) { return v - dot(v, tangent) * tangent; };
    Vec3 major = across(hair.major_axis);
    if (!(length_squared(major) > 1e-12f)) major = across({1.0f, 1.0f, 1.0f});
    const Vec3 x = normalize_or(major, Frame(tangent).s);
    return {x, tangent, cross(x, tangent)};
  }

  float minor_;
  Frame frame_;
  Vec3 o_;
  float seen_, offset_;  // half the width that is seen, and how far from its middle
};

/// Follows light backwards through a strand, in the coordinates of its section.
class Walk {
 public:
  Walk(const MicrofacetHair& hair, const Section& section, const Vec3& ng, MicrofacetHairWays& found, uint32_t seed)
      : hair_(hair), section_(section), ng_(ng), found_(found), alpha_(width_of(hair)), rng_(seed, 0, 0, 0) {}

  void go(int walks) {
    const float place =
        hair_.is_seen_from_afar ? section_.place_seen_at(2.0f * rng_.next_float() - 1.0f) : section_.first_place();
    const Interface side = section_.interface_at(place, -hair_.tilt);
    const Vec3 o = section_.view();
    if (!side.is_seen_from(o)) return;
    const Rgb met(energy_scale(alpha_, dot(side.tilted, o), hair_.ior));
    add(Way::REFLECTED, hair_.reflection * met, o, side);
    for (int i = 0; i < walks; ++i) enter(place, side, met / static_cast<float>(walks));
  }

 private:
  /// One walk; `left` is what arrives of light that each next way sends back along it.
  void enter(float place, Interface side, Rgb left) {
    // In by a facet, and through.
    const Vec3 o = section_.view();
    float cos_from = dot(side.tilted, o);
    const Vec3 entry = sample_facet(alpha_, side.tilted, o, rng_.next_vec2());
    float cos_t = 0.0f;
    left *= 1.0f - fresnel_dielectric(dot(o, entry), hair_.ior, &cos_t);
    Vec3 inside = refracted(o, entry, cos_t, hair_.ior);
    if (!(dot(o, entry) > 0.0f) || !(dot(side.facing, inside) < 0.0f)) return;
    left *= shadowing(alpha_, cos_from, dot(side.tilted, inside));
    const Rgb entering = cross(place, side, inside);
    if (!side.is_seen_from(-inside)) return;
    cos_from = -dot(side.tilted, inside);
    left *= entering * energy_scale(alpha_, cos_from, 1.0f / hair_.ior);
    add(Way::LEFT, hair_.transmission * left, -inside, side);
    if (!(hair_.twice > 0.0f)) return;

    // Back by another, and through again.
    const Vec3 turn = sample_facet(alpha_, side.tilted, -inside, rng_.next_vec2());
    const float turned = fresnel_dielectric(-dot(inside, turn), 1.0f / hair_.ior);
    inside = reflect(-inside, turn);
    if (!side.is_seen_from(inside) || !(dot(inside, turn) > 0.0f)) return;
    left *= turned * shadowing(alpha_, cos_from, dot(side.tilted, inside));
    const Rgb returning = cross(place, side, inside);
    if (!side.is_seen_from(-inside)) return;
    cos_from = -dot(side.tilted, inside);
    left *= returning * energy_scale(alpha_, cos_from, 1.0f / hair_.ior);
    add(Way::LEFT, hair_.twice * left, -inside, side);

    // What is reflected more often: as much again each time.
    const Vec3 last = sample_facet(alpha_, side.tilted, -inside, rng_.next_vec2());
    const float again = fresnel_dielectric(-dot(inside, last), 1.0f / hair_.ior);
    const Vec3 onwards = reflect(-inside, last);
    const float leaves = std::max(1.0f - 0.5f * (turned + again), 1e-5f);
    const Rgb both = entering * returning, passed{std::sqrt(both.r), std::sqrt(both.g), std::sqrt(both.b)};
    left *= again * shadowing(alpha_, cos_from, dot(side.tilted, onwards));
    add(Way::SPREAD, left * leaves * passed / (Rgb(1.0f) - (1.0f - leaves) * passed), {0.0f, 1.0f, 0.0f}, side);
  }

  /// To the other side, of which `place` and `side` become; returns what is not absorbed.
  Rgb cross(float& place, Interface& side, const Vec3& inside) const {
    const float inner = section_.next_inner_angle(place, inside), next = inner + kPi;
    const float across = std::max(std::sqrt(sqr(inside.x) + sqr(inside.z)), 1e-6f);
    const Rgb passed = exp((-section_.distance(place, next) / across) * hair_.absorption);
    place = next;
    side = section_.interface_at(inner, hair_.tilt);
    return passed;
  }

  void add(Way way, const Rgb& weight, const Vec3& origin, const Interface& side) {
    if (!(average(weight) > 0.0f) || !is_finite(weight)) return;
    const Frame& frame = section_.frame();
    const MicrofacetHairLobe lobe{
        ng_, frame.to_world(origin), frame.to_world(side.facing), frame.to_world(side.tilted), alpha_, hair_.ior, way};
    found_.ways[found_.count++] = {lobe, weight};
  }

  const MicrofacetHair& hair_;
  const Section& section_;
  Vec3 ng_;
  MicrofacetHairWays& found_;
  float alpha_;
  Rng rng_;
};

LobeEvaluation evaluate_reflection(const MicrofacetHairLobe& lobe, const Vec3& wo, const Vec3& wi) {
  if (!(dot(lobe.facing, wi) > 0.0f)) return {};
  const Vec3 h = normalize(wo + wi);
  if (!(dot(lobe.tilted, h) > 0.0f) || !(dot(wo, h) > 0.0f)) return {};
  const float pdf =
      facet_density(lobe, wo, h) / (4.0f * dot(wo, h) * (1.0f + lambda(lobe.alpha, dot(lobe.tilted, wo))));
  const float seen = shadowing(lobe.alpha, dot(lobe.tilted, wo), dot(lobe.tilted, wi));
  return {Rgb(pdf * seen * fresnel_dielectric(dot(wo, h), lobe.ior)), pdf};
}

LobeEvaluation evaluate_exit(const MicrofacetHairLobe& lobe, const Vec3& wi) {
  const Vec3& v = lobe.origin;
  if (!(dot(lobe.facing, wi) < 0.0f) || !(dot(lobe.tilted, wi) < 0.0f)) return {};
  const Vec3 sum = lobe.ior * v + wi;  // along the facet's normal [Walter et al. 2007, eq. 16]
  const float norm_squared = length_squared(sum);
  const Vec3 h = sum / std::sqrt(norm_squared);
  const float cos_v = dot(v, h), cos_i = -dot(wi, h);
  if (!(dot(lobe.tilted, h) > 0.0f) || !(cos_v > 0.0f) || !(cos_i > 0.0f)) return {};
  const float cos_from = dot(lobe.tilted, v), jacobian = cos_i / norm_squared;
  const float pdf = facet_density(lobe, v, h) * jacobian / (1.0f + lambda(lobe.alpha, cos_from));
  const float seen = shadowing(lobe.alpha, cos_from, dot(lobe.tilted, wi));
  return {Rgb(pdf * seen * (1.0f - fresnel_dielectric(cos_v, 1.0f / lobe.ior))), pdf};
}

Inclination inclination(const Vec3& tangent, const Vec3& w) {
  const float sine = std::clamp(dot(w, tangent), -1.0f, 1.0f);
  return {sine, cosine_of(sine)};
}

float spread_variance(const MicrofacetHairLobe& lobe) { return 4.0f * lobe.alpha; }

LobeEvaluation evaluate_spread(const MicrofacetHairLobe& lobe, const Vec3& wo, const Vec3& wi) {
  const Vec3& tangent = lobe.origin;
  const float density =
      longitudinal_density(inclination(tangent, wi), inclination(tangent, wo), spread_variance(lobe)) * 0.5f * kInvPi;
  return {Rgb(density), density};
}

}  // namespace

bool passes_beside(const MicrofacetHair& hair, const Vec3& tangent, const Vec3& ng, const Vec3& wo) {
  return Section(hair, tangent, ng, wo).is_beside();
}

MicrofacetHairWays make_microfacet_hair(const MicrofacetHair& hair, const Vec3& tangent, const Vec3& ng, const Vec3& wo,
                                        uint32_t seed, int walks) {
  MicrofacetHairWays found;
  Walk(hair, Section(hair, tangent, ng, wo), ng, found, seed).go(walks);
  return found;
}

float microfacet_hair_albedo(const MicrofacetHairLobe& lobe, const Vec3& wo) {
  switch (lobe.way) {
    case Way::REFLECTED:
      return fresnel_dielectric(clamp01(dot(lobe.tilted, wo)), lobe.ior);
    case Way::LEFT:
      return std::max(1.0f - fresnel_dielectric(dot(lobe.tilted, lobe.origin), 1.0f / lobe.ior), kLeastExit);
    case Way::SPREAD:
      break;
  }
  return 1.0f;
}

LobeEvaluation evaluate_lobe(const MicrofacetHairLobe& lobe, const Vec3& wo, const Vec3& wi) {
  if (lobe.way == Way::REFLECTED) return evaluate_reflection(lobe, wo, wi);
  return lobe.way == Way::LEFT ? evaluate_exit(lobe, wi) : evaluate_spread(lobe, wo, wi);
}

std::optional<Vec3> sample_lobe(const MicrofacetHairLobe& lobe, const Vec3& wo, float u_branch, Vec2 u) {
  if (lobe.way == Way::SPREAD) {
    const Frame around(lobe.origin);
    const Inclination i = sample_longitudinal(inclination(lobe.origin, wo), spread_variance(lobe), u_branch, u.y);
    const SineCosine azimuth = sine_cosine_of_turns(u.x);
    return normalize(around.to_world({i.cosine * azimuth.cosine, i.cosine * azimuth.sine, i.sine}));
  }
  const Vec3& v = lobe.way == Way::LEFT ? lobe.origin : wo;
  const Vec3 h = sample_facet(lobe.alpha, lobe.tilted, v, u);
  if (!(dot(v, h) > 0.0f)) return {};
  if (lobe.way == Way::REFLECTED) return reflect(wo, h);
  float cos_t = 0.0f;
  if (fresnel_dielectric(dot(v, h), 1.0f / lobe.ior, &cos_t) >= 1.0f) return {};
  return normalize(refracted(v, h, cos_t, 1.0f / lobe.ior));
}

}  // namespace cistern
