#pragma once

#include "resampling/reservoir.h"
#include "transport/path_tracer.h"

namespace cistern {

// A path sample is a point that sends radiance: its contribution weight W is per surface area at the sample point, and
// targets and integrands include |cos| / d^2 there. So it moves between receivers without a Jacobian. (In solid angle
// the weight would have to be *multiplied* by [Ouyang 2021] Eq. 11; their Alg. 4 l.11 divides the target by it.)
// With F_r(y) = f_r cos(wi) L(y -> r) |cos_y| / d^2 T(r, y), E[W F_r(y)] is the light that rough lobes at r reflect
// from rough lobes elsewhere, for every r. Light that y emits itself is direct light. A sample point is one side of a
// surface: it sends nothing to the other.
using PathReservoir = Reservoir<PathSample>;
/// For merges: path samples are large, and stay where they are.
using PathReference = Reservoir<const PathSample*>;

/// Whether the light a sample point sends is evaluated anew towards each receiver, from the light it received; or taken
/// as it was when found, as if the sample point were Lambertian (the papers).
enum class Reflection : uint8_t { EVALUATED, AS_FOUND };

/// What targets of path samples are proportional to, [Ouyang 2021] Eqs. 9 and 10: F_r without transmittance; or the
/// radiance sent alone, noisier for the receiver and of more use to others. The first is the product of two magnitudes,
/// not that of a product of colours: how bright and of what colour the light is that a path brings depends on who found
/// it, by roulette, and targets of different points may differ by a factor that does not.
enum class PathTarget : uint8_t { REFLECTED, RADIANCE };

/// The way from a point to a sample point: unit direction, distance, and |cos| / d^2 at the sample point. Empty where
/// that looks the other way.
struct PathConnection {
  Vec3 wi;
  float distance, geometry;
};
std::optional<PathConnection> connect(const VisiblePoint& visible, const PathSample& sample);

/// Radiance that the rough lobes of a sample point send along a connection, by its true BSDF.
Rgb sent_radiance(const PathContext& context, const PathSample& sample, const PathConnection& way);

/// What a kind of ray makes of a direction: `pdf` is the part of the density by lobes of that kind, `rough_cos` what
/// such rays carry in the mean, per density: the share of the kind in all that is scattered, or by its own lobes alone
/// (PathContext::divides_kinds).
BsdfEvaluation evaluate_kind(const PathContext& context, const Bsdf& bsdf, const Vec3& wi, FoundKind kind);

/// Target of a path sample at a visible point, by the Receivers of both ends; zero across a surface. Up to a factor
/// that all points have in common it does not depend on who found the sample.
float path_target(const VisiblePoint& visible, const PathSample& sample, PathTarget target, Reflection reflection);

/// Transmittance between a point and a sample point.
Rgb path_transmittance(const PathContext& context, const VisiblePoint& visible, const PathSample& sample);

/// Whether a ray from a point reaches a sample point past as many transparent surfaces as the path that found it. What
/// the sample point received may have passed all that were left to that path: with more or fewer left, others would
/// have found something else.
bool reaches_as_found(const PathContext& context, const VisiblePoint& visible, const PathSample& sample);

/// F_r with the true BSDFs, times the throughput to the camera.
Rgb reflected_path(const PathContext& context, const VisiblePoint& visible, const PathSample& sample,
                   Reflection reflection);

/// Shares that kinds of scattering have in it.
KindColors reflected_shares(const PathContext& context, const VisiblePoint& visible, const PathSample& sample);

/// Adds `factor` times its light to the groups that it is of; `continuation`: radiance of the sample's, by group.
void add_reflected_groups(const PathContext& context, const VisiblePoint& visible, const PathSample& sample,
                          Reflection reflection, std::span<const Rgb> continuation, Rgb factor, std::span<Rgb> sums);

/// The lobes that `evaluate_kind` knows, as RayVisibility bits.
inline uint8_t lobes_of_kind(const PathContext& context, FoundKind kind) {
  return kind != 0 && context.divides_kinds ? kind : uint8_t{kVisibleToAll};
}

}  // namespace cistern
