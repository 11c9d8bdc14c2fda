#pragma once

#include "base/direction_guide_lanes.h"
#include "shading/bsdf.h"

namespace cistern {

/// BSDFs of several points at once that have the form most rough surfaces have: a Lambert lobe on a normal that nothing
/// bends, isotropic GGX reflection of a dielectric or without Fresnel (what the Principled BSDF is by default), or
/// both.
class BsdfLanes {
 public:
  /// Of the rough lobes, as BsdfEvaluation has it; all 0 in directions that are never sampled.
  struct Evaluation {
    RgbLanes rough_cos, even_cos;
    Lanes pdf;
  };

  /// False, and nothing is set, if it has another form. Its guide is not looked at.
  bool set(size_t lane, const Bsdf& bsdf);
  const LaneMask& is_set() const { return is_set_; }

  /// Of those places that are asked for, and set; `guides` of these, or null.
  Evaluation evaluate(const Vec3Lanes& wi, const LaneMask& is_asked, const DirectionGuideLanes* guides) const;

 private:
  /// Light that facets reflect. The weight has all constant factors; it is 0 for smooth lobes.
  struct Reflection {
    Vec3Lanes n;
    RgbLanes weight, f0, f90;  // what stretches the curve of a dielectric, tinted
    Lanes ior = 1.0f, alpha2 = 1.0f;
    Lanes cos_o = 1.0f, q_o = 1.0f;  // q as in lobe_microfacet.cpp
    Lanes sample_weight = 0.0f;
    LaneMask is_real{false};  // the curve is that of the dielectric itself
    LaneMask is_narrow{false};
  };
  void set_reflection(size_t lane, const Bsdf& bsdf, const Lobe& lobe, const MicrofacetLobe& model);
  void add_reflection(const Vec3Lanes& wi, Evaluation& evaluation, Lanes& guided_pdf) const;

  LaneMask is_set_{false};
  Vec3Lanes ng_, ns_, wo_;
  RgbLanes diffuse_, even_;
  Lanes diffuse_sample_weight_ = 0.0f;
  bool has_reflections_ = false;
  Reflection reflection_;
  Lanes guided_weight_ = 1.0f;  // sample weights of lobes that are not narrow
  Lanes over_sample_weight_ = 0.0f;
};

}  // namespace cistern
