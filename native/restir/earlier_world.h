#pragma once

#include "lights/emitter_match.h"
#include "restir/light_target.h"

namespace cistern {

/// What history was found in, where light has changed since. A reservoir's W is good for any integrand of its sample
/// [Lin et al. 2022], so history outlives edits. But it can only have made what its own point could have made *then*:
/// MIS weights ask for the target of that time, with the lights and the shadows of that time.
struct EarlierWorld {
  EarlierWorld(const PathContext& the_paths, const EmitterMatch& the_emitters)
      : paths(the_paths), emitters(the_emitters) {}
  const PathContext& paths;
  const EmitterMatch& emitters;
};

/// A point that light reservoirs were made for, and when. `world` null: in the present one.
struct LightDomain {
  const VisiblePoint* point = nullptr;
  const EarlierWorld* world = nullptr;
};

/// light_target of a sample of the present lights; zero for emitters that a domain of the past did not know.
float domain_target(const PathContext& present, float candidates, const LightDomain& domain, const LightSample& sample);
/// is_visible, then.
bool is_visible_in(const PathContext& present, const LightDomain& domain, const LightSample& sample);

/// A reservoir of an earlier world as one of the present: null where its emitter is gone.
LightReservoir to_present(const EarlierWorld* world, LightReservoir reservoir);

}  // namespace cistern
