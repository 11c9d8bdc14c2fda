#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "base/rng.h"
#include "render/settings.h"
#include "transport/caustic_guide.h"
#include "transport/path_context.h"

namespace cistern {

/// Photons for a CausticGuide. Walks from the camera meet smooth surfaces; wherever one does, a light sample is taken
/// there, and if its light is small, a photon follows from it by the smooth surface, and others behind that, to the
/// rough ones that it reaches. So photons are where the picture may show them, and none has to hit a far window from a
/// sun. How many start at a place depends on how walks get there, which a guide need not know.
class CausticPhotons {
 public:
  /// `lights` choose the light samples.
  CausticPhotons(const Scene& scene, const Accel& accel, const LightSet& lights, const Settings& settings);

  /// What so many walks leave, but for photons whose light is found well enough by chance. The same for the same seed,
  /// on any number of threads; none when stopped.
  std::vector<CausticPhoton> trace(uint32_t walks, const NestedCells& cells,
                                   const std::function<bool()>& is_stopped) const;

 private:
  struct Found;
  struct Photon;
  void walk(Rng& rng, const NestedCells& cells, Found& found) const;
  std::optional<Photon> shoot(const SurfacePoint& point, const Hit& hit, Rng& rng, Found& found) const;
  void follow(Photon photon, Rng& rng, const NestedCells& cells, Found& found) const;

  PathContext context_;
  uint64_t seed_;
};

/// The guide that settings ask for. Null where no photon arrives, for paths that could not find what photons do, for
/// pictures of so few samples that a guide would take much of their time, and when stopped.
std::shared_ptr<const CausticGuide> make_caustic_guide(const Settings& settings, const Scene& scene, const Accel& accel,
                                                       const LightSet& lights, const std::function<bool()>& is_stopped);

}  // namespace cistern
