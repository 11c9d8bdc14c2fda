#pragma once

#include "restir/light_target.h"
#include "transport/path_scenes.h"

namespace cistern::test {

/// A floor under lamps and a glowing quad, with a dim lamp below the floor that only a tilted receiver sees.
inline std::shared_ptr<const Scene> lit_floor() {
  PathScene scene;
  scene.floor(0.0f, 4.0f, scene.diffuse(0.5f));
  scene.quad({0.3f, 0.2f, 3.0f}, {0.0f, 0.5f, 0.0f}, {0.5f, 0.0f, 0.0f}, scene.emission({4, 3, 2}));
  scene.point_lamp({1.0f, -1.0f, 1.5f}, 2.0f, 0.05f);
  scene.point_lamp({-1.5f, 0.5f, 0.8f}, 1.0f, 0.0f);
  scene.point_lamp({0.8f, 0.1f, -0.4f}, 0.5f, 0.0f);
  return scene.builder.snapshot();
}

/// A scene ready to evaluate light in.
struct LightBench {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Accel> accel;
  LightSet lights;
  PathContext context;

  explicit LightBench(std::shared_ptr<const Scene> of, LightSampling sampling = LightSampling::POWER)
      : scene(of), accel(Accel::build(of)), lights(of, sampling), context{*scene, *accel, lights, {}, {}} {}
};

/// White paint on the floor; `n` may be tilted, as on a bumpy surface.
inline VisiblePoint paint_at(Vec3 position, Vec3 n) {
  VisiblePoint visible;
  visible.receiver = {position, n, n, {0.0f, 0.0f, 1.0f}, Rgb(1.0f), Rgb(), 1.0f, 0.0f};
  visible.ng = visible.ns = {0.0f, 0.0f, 1.0f};
  visible.exists = true;
  visible.distance = 1.0f;
  visible.throughput = Rgb(1.0f);
  visible.scattered.ray_kind = kVisibleToDiffuse;
  visible.scattered.depth = visible.scattered.diffuse_depth = 1;
  return visible;
}

/// Sum over emitters of the integral of the receiver's target over their squares, by the midpoint rule.
inline double exact_sum(const LightBench& bench, float candidates, const VisiblePoint& visible) {
  constexpr int kSteps = 32;
  double sum = 0.0;
  for (uint32_t e = 0; e < bench.lights.emitter_count(); ++e)
    for (int i = 0; i < kSteps * kSteps; ++i) {
      const Vec2 uv{(static_cast<float>(i % kSteps) + 0.5f) / kSteps, (static_cast<float>(i / kSteps) + 0.5f) / kSteps};
      sum += light_target(bench.context, candidates, visible, {e, uv}) / (kSteps * kSteps);
    }
  return sum;
}

inline constexpr Vec3 kTilted{0.8f, 0.0f, 0.6f};

}  // namespace cistern::test
