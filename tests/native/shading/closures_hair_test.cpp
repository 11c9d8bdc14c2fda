#include "shading/closure_inputs.h"
#include "transport/visible_points.h"

namespace cistern::test {
namespace {

/// Operands of CLOSURE_MICROFACET_HAIR of white glass, op_table.cpp.
Inputs microfacet_hair(float aspect_ratio) {
  const Vec3 one = grey(1.0f), none{};
  return {one,        kFrame.s,           kFrame.t,    one,  none, none, one, none,
          grey(0.3f), grey(aspect_ratio), grey(1.55f), none, one,  one,  one};
}

SurfacePoint strand_point(Rng& rng) {
  SurfacePoint point = make_point(0.3f + 0.6f * rng.next_float());
  const float turn = kPi * (rng.next_float() - 0.5f);
  point.ng = point.ns = std::cos(turn) * kFrame.n + std::sin(turn) * kFrame.t;
  if (dot(point.wo, point.ng) < 0.0f) point.ng = point.ns = -point.ng;
  point.is_strand = true;
  point.position = {rng.next_float(), 0.0f, 0.0f};
  return point;
}

TEST(HairClosures, ShadowRaysPassHairWherePathsDo) {
  Rng rng(4, 0, 0, 0);
  const int32_t parameter = 2;
  int passed = 0;
  for (int i = 0; i < 500; ++i) {
    SurfacePoint point = strand_point(rng);
    const Inputs in = microfacet_hair(rng.next_float());
    const Bsdf bsdf = build(Op::CLOSURE_MICROFACET_HAIR, in, point, parameter);
    EXPECT_EQ(bsdf.transparency, closure_transparency(Op::CLOSURE_MICROFACET_HAIR, in, &parameter, point, 0));
    EXPECT_TRUE(is_black(bsdf.transparency) || bsdf.count == 0);
    passed += is_black(bsdf.transparency) ? 0 : 1;
    point.is_strand = false;  // then its section turns with the view
    EXPECT_TRUE(is_black(build(Op::CLOSURE_MICROFACET_HAIR, in, point, parameter).transparency));
    EXPECT_TRUE(is_black(closure_transparency(Op::CLOSURE_MICROFACET_HAIR, in, &parameter, point, 0)));
  }
  EXPECT_GT(passed, 50);
  EXPECT_LT(passed, 450);
}

/// Resampling evaluates materials again at points that it keeps.
TEST(HairClosures, KeptPointsOfStrandsStayStrands) {
  Rng rng(7, 0, 0, 0);
  SurfacePoint point = strand_point(rng);
  const Bsdf bsdf = build(Op::CLOSURE_MICROFACET_HAIR, microfacet_hair(1.0f), point, 2);
  for (const bool is_strand : {false, true}) {
    point.is_strand = is_strand;
    EXPECT_EQ(surface_point(make_visible_point(Scene{}, point, bsdf)).is_strand, is_strand);
    EXPECT_EQ(place_hash(surface_point(make_visible_point(Scene{}, point, bsdf))), place_hash(point));
  }
}

TEST(HairClosures, ManyHairsFitIntoOneMaterial) {
  Rng rng(5, 0, 0, 0);
  const int32_t parameter = 2;
  for (int i = 0; i < 20; ++i) {
    const SurfacePoint point = strand_point(rng);
    Bsdf bsdf = build(Op::CLOSURE_MICROFACET_HAIR, microfacet_hair(1.0f), point, parameter);
    for (int k = 1; k < 14; ++k)
      add_closure(bsdf, Op::CLOSURE_MICROFACET_HAIR, microfacet_hair(1.0f), &parameter, point);
    EXPECT_LT(bsdf.count, Bsdf::kMaxLobes);
  }
}

/// Weights that nearly nothing is left of made samples that were not finite.
TEST(HairClosures, BlackHairScattersNothing) {
  Rng rng(6, 0, 0, 0);
  Inputs in = microfacet_hair(1.0f);
  in[3] = Vec3{};
  in[7] = grey(60.0f);
  in[12] = Vec3{};
  for (int i = 0; i < 300000; ++i) {
    const Bsdf bsdf = build(Op::CLOSURE_MICROFACET_HAIR, in, strand_point(rng), 0);
    const float u = rng.next_float();
    const auto sample = sample_bsdf(bsdf, u, rng.next_vec2());
    if (sample) EXPECT_TRUE(is_finite(sample->rough_weight + sample->smooth_weight));
  }
}

}  // namespace
}  // namespace cistern::test
