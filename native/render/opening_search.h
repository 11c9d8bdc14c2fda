#pragma once

#include <functional>

#include "lights/openings.h"
#include "render/sky_walks.h"

namespace cistern {

/// Whether to look for openings: where the settings ask for it, light samples compete with the BSDF's, there is a sky
/// for diffuse surfaces, and nobody has said where it shines in.
bool may_find_openings(const Scene& scene, const Settings& settings);

/// Openings through which the inside of a scene sees the sky, such as windows, as portals. None where the camera's
/// walks are mostly outside, or where the sky is not seen through openings that are few and clear. The same for the
/// same seed, on any number of threads; none when stopped.
std::vector<AreaLight> find_openings(const SkyWalks& walks, const std::function<bool()>& is_stopped);

/// Whether light samples that look through openings, as `with` does, leave less noise than those of `without`, enough
/// to be worth their time: by light that is sampled a few times at vertices of walks, where each reflects half of it.
bool openings_pay(const SkyWalks& walks, const LightSet& without, const LightSet& with,
                  const std::function<bool()>& is_stopped);

}  // namespace cistern
