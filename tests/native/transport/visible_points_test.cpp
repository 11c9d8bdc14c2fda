#include "transport/visible_points.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "base/warp.h"
#include "shading/bsdf_statistics.h"
#include "shading/closures.h"

namespace cistern::test {
namespace {

Vec3 grey(float v) { return {v, v, v}; }

/// Resampling of light never brings what its target has none of. From inside of glass, leaning facets let light through
/// where the surface as a whole reflects all of it: at cosines below 0.74 with an index of 1.5.
TEST(VisiblePoints, RespondToLightThatRoughGlassLetsThroughBeyondTheCriticalAngle) {
  Scene scene;
  scene.materials.push_back(std::make_shared<const MaterialProgram>());
  const Frame frame(kTestNormal);
  const std::array inputs{grey(1.0f), grey(1.0f), grey(0.6f), grey(1.5f), kTestNormal};
  const int32_t parameters[1] = {0};
  for (const float cosine : {0.9f, 0.6f, 0.3f, 0.1f}) {
    SurfacePoint point;
    point.ng = point.ns = kTestNormal;
    point.wo = at_angle(frame, cosine);
    point.material = 0;
    point.is_backface = true;
    Bsdf bsdf;
    bsdf.ng = point.ng;
    bsdf.wo = point.wo;
    add_closure(bsdf, Op::CLOSURE_REFRACTION, inputs, parameters, point);
    const Receiver receiver = make_visible_point(scene, point, bsdf).receiver;
    Rng rng(3, 0, 0, 0);
    int transmitted = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 wi = square_to_sphere(rng.next_vec2());
      if (is_black(evaluate_bsdf(bsdf, wi).total_cos())) continue;
      ++transmitted;
      EXPECT_FALSE(is_black(respond(receiver, wi).f_cos)) << cosine;
    }
    EXPECT_GT(transmitted, 20) << cosine;
  }
}

}  // namespace
}  // namespace cistern::test
