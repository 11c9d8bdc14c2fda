#pragma once

#include "lights/light_set.h"
#include "shading/pane_face.h"
#include "transport/path_context.h"

namespace cistern {

// Windows: panes of flat smooth glass in front of lights. A ray that is refracted by two parallel faces goes on in the
// direction it had, so what is seen through a pane can be sampled where it lights a receiver as if there were none: the
// light sample's path is that of a BSDF sample which every face refracts, found with the density of its direction at
// the receiver. The two are weighed by their densities there [Veach 1997, 9.2], without the probability of refraction,
// which both could count and need not.
//
// The path of a light sample may pass more faces than one pane has. Where it leads is followed exactly: to a sun in the
// direction it began with, to the sky in any, and to the lamp or triangle that the straight ray was aimed at, if it is
// met in the direction that ray had. Nothing opaque may lie on the straight line to the light, panes aside: shadow rays
// look there first, since they mostly end there. Whatever light samples do not find for these reasons is left to BSDF
// samples whole, and so are reflections within a pane, and curved glass.

/// Whether light samples pass panes in this scene: there are some, and what their paths meet depends on nothing but
/// the way, neither on the kind of their rays nor on linked lights.
bool may_pass_panes(const Scene& scene, const PathLimits& limits);

/// Whether a light is one that is looked for through panes: found by BSDF samples, too.
inline bool is_sought_through_panes(const IncidentLight& light) { return !light.is_delta && light.use_mis; }

/// Whether a path may pass so many faces after it was scattered at a vertex, whatever the kind of that scattering.
/// `vertex`: state at the vertex.
bool may_pass_faces(const PathState& vertex, int faces, const PathLimits& limits);

/// Whether a ray has the direction again that it began with.
bool is_parallel(Vec3 begin, Vec3 end);

/// A ray towards a light that goes on behind panes and transparent surfaces. Up to the first pane it is straight, and
/// must be occluded_but_for_panes by nothing.
class PaneRay {
 public:
  /// `ray` begins with `footprint` in the state `vertex`; `shadow`: its own.
  PaneRay(const PathContext& context, float footprint, const Ray& ray, const PathState& vertex, PathState shadow);

  /// The next surface that it meets.
  std::optional<Hit> meet() const;
  /// Goes on behind the surface; false where that lets nothing pass.
  bool pass(const Hit& hit);

  Rgb share() const { return share_; }
  int faces() const { return faces_; }
  Vec3 direction() const { return ray_.direction; }
  bool is_parallel_again() const { return is_parallel(begin_, ray_.direction); }
  /// The way to the next surface, from the last face on.
  Ray segment(const std::optional<Hit>& next) const;
  /// The next surface's point.
  SurfacePoint point(const Hit& next) const;

 private:
  bool pass_transparent(const SurfacePoint& point);

  const PathContext& context_;
  Ray ray_;
  PathState vertex_, shadow_;
  RayCone cone_;
  Vec3 begin_, last_face_;
  Rgb share_{1.0f};
  int faces_ = 0;
  float before_ = 0.0f;  // length of its way to the last face
};

/// How light passes panes on its way to a receiver.
struct PanePassage {
  Rgb share;
  int faces = 0;   // that refracted it
  Vec3 direction;  // in which the ray from the receiver went on
};
/// Of distant light; nothing passes where the ray ends in another direction, unless it `may_turn`.
PanePassage pass_panes(PaneRay ray, bool may_turn);

/// What arrives of a light.
struct PassedLight {
  Rgb radiance;
  int faces = 0;  // of panes, that refracted it
};
/// Of a lamp, or of an emissive triangle.
PassedLight find_lamp_past_panes(const PathContext& context, PaneRay ray, uint32_t emitter);
PassedLight find_triangle_past_panes(const PathContext& context, PaneRay ray, uint32_t emitter);

}  // namespace cistern
