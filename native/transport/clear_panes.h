#pragma once

#include "lights/light_set.h"
#include "shading/pane_face.h"
#include "transport/path_context.h"

namespace cistern {

// Windows: panes of flat smooth glass in front of distant light. A ray that is refracted by two parallel faces goes on
// in the direction it had, so the sky and suns that are seen through a pane can be sampled where they light a receiver
// as if there were none: the light sample's path is that of a BSDF sample which every face refracts, found with the
// density of the direction at the receiver. The two are weighed by their densities there (balance or power heuristic of
// [Veach 1997, 9.2]), without the probability of refraction, which both could count and need not.
//
// The path of a light sample may pass more faces than one pane has. It has to end in the direction it began with, and
// nothing opaque may lie on the straight line to the light, panes aside: shadow rays look there first, since they
// mostly end there. Whatever light samples do not find for these reasons is left to BSDF samples whole. Reflections
// within a pane, curved glass, single faces and near lamps are, too.

/// Whether light samples pass panes in this scene: there are some, and what their paths meet depends on nothing but
/// the way, neither on the kind of their rays nor on linked lights.
bool may_pass_panes(const Scene& scene, const PathLimits& limits);

/// Whether a light is one that is looked for through panes: distant, and found by BSDF samples, too.
inline bool is_sought_through_panes(const IncidentLight& light) {
  return std::isinf(light.distance) && !light.is_delta && light.use_mis;
}

/// Whether a path may pass so many faces after it was scattered at a vertex, whatever the kind of that scattering.
/// `vertex`: state at the vertex.
bool may_pass_faces(const PathState& vertex, int faces, const PathLimits& limits);

/// Whether a ray has the direction again that it began with.
bool is_parallel(Vec3 begin, Vec3 end);

/// How light passes panes on its way to a receiver.
struct PanePassage {
  Rgb share{1.0f};
  int faces = 0;   // that refracted it
  Vec3 direction;  // in which the ray from the receiver went on
};
/// Along a shadow ray that begins with `footprint` and is occluded_but_for_panes by nothing; nothing passes where it
/// ends in another direction, unless it `may_turn`. `vertex` is the state where it begins, `shadow` that of the ray.
PanePassage pass_panes(const PathContext& context, float footprint, Ray ray, bool may_turn, const PathState& vertex,
                       PathState shadow);

}  // namespace cistern
