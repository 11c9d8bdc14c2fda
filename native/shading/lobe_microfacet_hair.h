#pragma once

#include "shading/lobe_diffuse.h"

namespace cistern {

// A strand of hair as a rod of tinted glass with an elliptic cross-section, whose surface, tilted by its scales, is
// made of GGX facets. [Huang, Hullin and Hanika 2022, A Microfacet-based Hair Scattering Model; with what Cycles adds:
// energy that facets lose is returned as for glass, and what is reflected inside more than once is spread evenly
// around] The paper integrates over the facets by which light enters and turns back, anew for each pair of directions.
// Here they are drawn a few times for each point, by a hash of where it lies, as if the strand had a texture of fine
// grain: given these, each way of light ends at one facet more, so that its lobe has a closed form, and a density. The
// mean over points is the model's. [Guo, Hasan and Zhao 2018, Position-Free Monte Carlo Simulation for Arbitrary
// Layered BSDFs, whose paths these are] Where light leaves the strand is taken to be where it entered. Densities: of
// visible normals times the Jacobian of reflection or refraction; of what is spread, that of light.

struct MicrofacetHair {
  Rgb absorption;                   // over half the major axis
  float alpha = 0.3f, ior = 1.55f;  // GGX width, clamped to [0.001, 1]
  float tilt = 0.0f;                // of the scales, radians, towards the root
  float aspect_ratio = 1.0f;        // of the axes, either over the other
  Vec3 major_axis;                  // about that; zero: (1, 1, 1), as in Cycles
  /// Factors: of light that is reflected at once, that passes, and that is reflected inside once.
  float reflection = 1.0f, transmission = 1.0f, twice = 1.0f;
  bool is_seen_from_afar = false;  // light enters anywhere across, whatever the normal: on what is no strand
};

/// Whether light passes a strand along `tangent` where its round hull is met in a point of normal `ng`: at the sides of
/// an ellipse that is seen on edge.
bool passes_beside(const MicrofacetHair& hair, const Vec3& tangent, const Vec3& ng, const Vec3& wo);

/// The lobes of a point that light does not pass. `seed`: its place_hash.
struct MicrofacetHairWays {
  /// Times that the facets inside are drawn. (Variance x CPU time of fur under lamps with 1, 2, 3 and 6: 1, 0.92, 0.88
  /// and 0.99; one run, another script.)
  static constexpr int kWalks = 3;
  struct Way {
    MicrofacetHairLobe lobe;
    Rgb weight;
  };
  std::array<Way, 1 + 3 * kWalks> ways;
  size_t count = 0;
};
/// `walks`: at most kWalks.
MicrofacetHairWays make_microfacet_hair(const MicrofacetHair& hair, const Vec3& tangent, const Vec3& ng, const Vec3& wo,
                                        uint32_t seed, int walks = MicrofacetHairWays::kWalks);

/// What is sent on of light from everywhere, about; lobe weight not included.
float microfacet_hair_albedo(const MicrofacetHairLobe& lobe, const Vec3& wo);

LobeEvaluation evaluate_lobe(const MicrofacetHairLobe& lobe, const Vec3& wo, const Vec3& wi);
std::optional<Vec3> sample_lobe(const MicrofacetHairLobe& lobe, const Vec3& wo, float u_branch, Vec2 u);

}  // namespace cistern
