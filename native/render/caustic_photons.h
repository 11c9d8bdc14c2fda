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
  Found trace_part(uint32_t first, uint32_t last, const NestedCells& cells,
                   const std::function<bool()>& is_stopped) const;
  void walk(Rng& rng, const NestedCells& cells, Found& found) const;
  std::optional<Photon> shoot(const SurfacePoint& point, const Hit& hit, Rng& rng, Found& found) const;
  void follow(Photon photon, Rng& rng, const NestedCells& cells, Found& found) const;

  static bool is_reached(const Photon& photon, const BsdfSample& sample);
  bool is_pane(const SurfacePoint& point, const Bsdf& bsdf) const;
  Vec2 place_in_picture(Vec2 u) const {
    return {film_begin_.x + film_size_.x * u.x, film_begin_.y + film_size_.y * u.y};
  }

  PathContext context_;  // that paths have, but for what they leave to others or have in parts
  uint64_t seed_;
  Vec2 film_begin_, film_size_;  // of what is rendered of the full frame
};

/// The guide that settings ask for. Null where no photon arrives, for paths that could not find what photons do, for
/// pictures of so few samples that a guide would take much of their time, for few photons, and when stopped.
std::shared_ptr<const CausticGuide> make_caustic_guide(const Settings& settings, const Scene& scene, const Accel& accel,
                                                       const LightSet& lights, const std::function<bool()>& is_stopped);

}  // namespace cistern
