#pragma once

#include <functional>

#include "lights/openings.h"
#include "render/sky_walks.h"

namespace cistern {

/// Whether to look for openings: where the settings ask for it, light samples compete with the BSDF's, there is a sky
/// for diffuse surfaces, and nobody has said where it shines in. `lights`: those without openings. If they have no
/// samples of the sky, because it is even, then not where shadow rays may find other surfaces than scattered rays do:
/// the two would not find the same light, and expectations depend on whether openings pay.
bool may_find_openings(const Scene& scene, const Settings& settings, const LightSet& lights);

/// Openings through which the inside of a scene sees the sky, such as windows, as portals. None where the camera's
/// walks are mostly outside (less than 0.3 of their points inside), or where the sky is not seen through openings that
/// are few and clear. The same for the same seed, on any number of threads; none when stopped.
std::vector<AreaLight> find_openings(const SkyWalks& walks, const std::function<bool()>& is_stopped);

/// Whether light samples that look through openings, as `with` does, leave less noise than those of `without`, enough
/// to be worth their time: by light that is sampled a few times at vertices of walks, where each reflects half of it.
/// False when stopped.
bool openings_pay(const SkyWalks& walks, const LightSet& without, const LightSet& with,
                  const std::function<bool()>& is_stopped);

}  // namespace cistern
