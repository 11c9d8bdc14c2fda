#pragma once

#include <functional>
#include <vector>

#include "base/rng.h"
#include "lights/light_set.h"
#include "render/settings.h"
#include "transport/path_context.h"

namespace cistern {

/// A point that a walk met, and where it looked from there.
struct WalkVertex {
  Vec3 position, normal;  // unit, geometric, on the side that the walk came from
  Vec3 origin;            // where rays to that side start
  Vec3 direction;         // unit, distributed by the cosine
  bool sees_sky = false;  // along it
  TriangleId leaves;      // of rays from there
};

/// Random walks from the camera over the surfaces of a scene, as if all were white and diffuse; each ends where it sees
/// the sky, which it may through transparent surfaces. They say how the sky lights a scene without rendering it.
class SkyWalks {
 public:
  SkyWalks(const Scene& scene, const Accel& accel, const Settings& settings);

  /// The vertices of walks [first, last), one after the other; `begins`: where each starts, and the end. The same for
  /// the same seed and stream, on any number of threads. None when stopped.
  struct Walks {
    std::vector<WalkVertex> vertices;
    std::vector<size_t> begins{0};
  };
  Walks walk(uint32_t first, uint32_t last, uint32_t stream, const std::function<bool()>& is_stopped) const;

  /// What of the sky arrives: less than all through transparent surfaces that are tinted.
  Rgb sky_share(const WalkVertex& from, Vec3 direction) const;
  const PathContext& context() const { return context_; }

 private:
  void add_walk(Rng& rng, std::vector<WalkVertex>& vertices) const;

  LightSet no_lights_;
  PathContext context_;
  uint64_t seed_;
};

}  // namespace cistern
