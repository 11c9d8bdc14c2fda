#include "transport/clear_panes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "transport/court.h"
#include "transport/transmittance.h"

// Light samples through panes of glass: they find what scattered rays find, and no more.

namespace cistern::test {
namespace {

/// Unpolarised light that a face lets pass.
double face_transmittance(double cosine) {
  const double cos_t = std::sqrt(1.0 - (1.0 - cosine * cosine) / (kIor * kIor));
  const double s = (cosine - kIor * cos_t) / (cosine + kIor * cos_t);
  const double p = (kIor * cosine - cos_t) / (kIor * cosine + cos_t);
  return 1.0 - 0.5 * (s * s + p * p);
}

IncidentLight sky_light(Vec3 towards) {
  IncidentLight light;
  light.wi = normalize(towards);
  light.distance = INFINITY;
  light.radiance = Rgb(1.0f);
  light.pdf = 1.0f;
  light.is_environment = true;
  return light;
}
IncidentLight sun_light(Vec3 towards) {
  IncidentLight light = sky_light(towards);
  light.is_environment = false;
  return light;
}

/// What the middle of the floor receives.
PassedLight arriving(const Court& court, const IncidentLight& light, const PathLimits& limits = {},
                     const PathState& path = {}) {
  Tracer tracer(court, limits);
  tracer.pass_panes();
  const Scene& scene = *tracer.scene();
  const Ray ray{{0.013f, 0.017f, 0.5f}, {0, 0, -1}};
  const SurfacePoint floor = make_surface_point(scene, ray, *tracer.context().accel.intersect(ray, kVisibleToAll));
  return passed_light(tracer.context(), floor, light, path);
}

TEST(ClearPanes, LetLightPassAsFresnelHasIt) {
  for (const Vec3 towards : {Vec3{0, 0, 1}, Vec3{0.5f, 0, 1}, Vec3{1, 2, 1}}) {
    Court court;
    court.pane();
    const double expected = std::pow(face_transmittance(normalize(towards).z), 2.0);
    for (const IncidentLight& light : {sky_light(towards), sun_light(towards)}) {
      const PassedLight passed = arriving(court, light);
      EXPECT_NEAR(passed.radiance.g, expected, 1e-5);
      EXPECT_EQ(passed.faces, 2);
    }
    court.pane(2.0f);
    const PassedLight twice = arriving(court, sun_light(towards));
    EXPECT_NEAR(twice.radiance.g, expected * expected, 1e-5);
    EXPECT_EQ(twice.faces, 4);
  }
}

TEST(ClearPanes, AreOpaqueToLightThatScatteredRaysDoNotFind) {
  Court court;
  court.pane();
  IncidentLight delta = sun_light({0, 0, 1}), hidden = delta;
  delta.is_delta = true;
  hidden.use_mis = false;
  for (const IncidentLight& light : {delta, hidden}) EXPECT_TRUE(is_black(arriving(court, light).radiance));
}

TEST(ClearPanes, WhatLiesBeforeOrBehindThemIsInTheWay) {
  for (const float z : {0.7f, 1.01f, 1.5f}) {
    Court court;
    court.pane();
    court.face(z, 1.0f, court.diffuse(0.5f), 0.5f);
    EXPECT_TRUE(is_black(arriving(court, sky_light({0, 0, 1})).radiance)) << z;
    EXPECT_FALSE(is_black(arriving(court, sky_light({2, 0, 1})).radiance)) << z;
  }
}

TEST(ClearPanes, TransparentSurfacesTintWhatTheyLetPass) {
  for (const float z : {0.7f, 1.01f, 1.5f}) {
    Court court;
    court.pane();
    court.face(z, 1.0f, court.transparent({0.5f, 0.25f, 1.0f}));
    const Rgb passed = arriving(court, sun_light({0, 0, 1})).radiance;
    EXPECT_NEAR(passed.r, 0.5 * passed.b, 1e-6);
    EXPECT_NEAR(passed.g, 0.25 * passed.b, 1e-6);
    EXPECT_NEAR(passed.b, std::pow(face_transmittance(1.0), 2.0), 1e-5);
  }
}

TEST(ClearPanes, TheSkyAloneIsSeenInOtherDirections) {
  Court court;
  court.glowing_environment(0.1f, 4.0f);
  court.face(1.0f, -1.0f, court.glass);  // all above is glass
  const Vec3 towards = normalize(Vec3{0.8f, 0, 1});
  EXPECT_TRUE(is_black(arriving(court, sun_light(towards)).radiance));
  EXPECT_FALSE(is_black(arriving(court, sun_light({0, 0, 1})).radiance));
  const float sine = towards.x / kIor, up = std::sqrt(1.0f - sine * sine);
  const double sky = 0.1 + 4.0 * std::pow(up, 8.0);
  EXPECT_NEAR(arriving(court, sky_light(towards)).radiance.g, sky * face_transmittance(towards.z), 1e-4);
}

TEST(ClearPanes, RoughOrBentGlassIsNone) {
  for (const bool is_rough : {false, true}) {
    Court court;
    court.glass = is_rough ? court.clear_glass(kIor, 0.1f) : court.clear_glass(kIor, 0.0f, {0.1f, 0, 1});
    court.pane();
    EXPECT_TRUE(is_black(arriving(court, sky_light({0, 0, 1})).radiance));
  }
}

TEST(ClearPanes, LimitsOfBouncesHold) {
  const auto passes = [](int total, int transmission, const PathState& path = {}) {
    Court court;
    court.pane();
    PathLimits limits;
    limits.max_bounces = total;
    limits.max_transmission_bounces = transmission;
    return !is_black(arriving(court, sun_light({0, 0, 1}), limits, path).radiance);
  };
  EXPECT_TRUE(passes(2, 2));
  EXPECT_FALSE(passes(1, 2));
  EXPECT_FALSE(passes(2, 1));
  PathState later;
  later.depth = later.diffuse_depth = 1;
  EXPECT_TRUE(passes(3, 2, later));
  EXPECT_FALSE(passes(2, 2, later));
}

// --- Against scattered rays alone. ---------------------------------------------------------------------------------

struct Case {
  const char* name;
  void (*build)(Court&);
  PathLimits limits;
};

PathLimits limits_of(int total, int diffuse = 12, int transmission = 12) {
  PathLimits limits;
  limits.max_bounces = total;
  limits.max_diffuse_bounces = diffuse;
  limits.max_transmission_bounces = transmission;
  return limits;
}

const Case kCases[] = {
    {"a sun", [](Court& c) { c.pane(), c.sun(0.6f); }, {}},
    {"the sky", [](Court& c) { c.pane(), c.glowing_environment(0.1f, 4.0f); }, {}},
    {"both, two panes", [](Court& c) { c.pane(), c.pane(1.5f), c.sun(0.6f), c.glowing_environment(0.1f, 4.0f); }, {}},
    {"a pane that not all rays pass", [](Court& c) { c.pane(1.0f, 1.5f), c.sun(0.6f); }, {}},
    {"one face",
     [](Court& c) {
       c.face(1.0f, -1.0f, c.glass), c.glowing_environment(0.1f, 4.0f), c.sun(0.6f, {0, 0, 1});
     },
     {}},
    {"a wedge",
     [](Court& c) {
       c.face(1.0f, -1.0f, c.glass);
       c.quad({0, 0, 5}, {kWide, 0, 0.2f * kWide}, {0, kWide, 0}, c.glass);
       c.glowing_environment(0.1f, 4.0f), c.sun(0.6f);
     },
     {}},
    {"a board above", [](Court& c) { c.pane(), c.sun(0.6f), c.face(1.03f, 1.0f, c.diffuse(0.5f), 0.5f); }, {}},
    {"a board within", [](Court& c) { c.pane(), c.sun(0.6f), c.face(1.01f, 1.0f, c.diffuse(0.5f), 0.3f); }, {}},
    {"a curtain",
     [](Court& c) {
       c.pane(), c.sun(0.6f), c.face(0.5f, 1.0f, c.transparent({1, 0.5f, 1}, 0.7f, 0.3f));
     },
     {}},
    {"few bounces", [](Court& c) { c.pane(), c.sun(0.6f), c.face(3.0f, -1.0f, c.diffuse(0.5f), 1.0f); }, limits_of(3)},
    {"fewer", [](Court& c) { c.pane(), c.sun(0.6f); }, limits_of(2)},
    {"few diffuse bounces", [](Court& c) { c.pane(), c.sun(0.6f); }, limits_of(12, 1)},
    {"few refractions", [](Court& c) { c.pane(), c.pane(2.0f, 1.0f), c.sun(0.6f); }, limits_of(12, 12, 2)},
    {"gloss", [](Court& c) { c.floor(0.1f, 3.0f, c.mixed(0.7f, 0.3f, 0.5f)), c.pane(), c.sun(0.6f); }, {}},
    {"smooth gloss",
     [](Court& c) {
       c.floor(0.1f, kWide, c.glossy(0.15f)), c.pane(), c.sun(0.6f, {-0.1f, 0, 1});
     },
     {}},
    {"fewer refractions", [](Court& c) { c.pane(), c.sun(0.6f), c.glowing_environment(0.1f, 4.0f); },
     limits_of(12, 12, 1)},
    {"gloss alone",
     [](Court& c) {
       c.floor(0.1f, 3.0f, c.mixed(0.7f, 0.5f, 0.5f)), c.pane(), c.sun(0.6f, {-0.1f, 0, 1});
     },
     limits_of(12, 0)},
    {"a board that refraction passes",
     [](Court& c) {
       c.face(1.0f, -1.0f, c.glass), c.half_environment(2.0f);
       c.quad({20, 0, 20}, {16, 0, 0}, {0, 40, 0}, c.diffuse(0.0f));
     },
     {}},
    {"a sky that is black on one side, through a portal",
     [](Court& c) {
       c.quad({0, 0, 10}, {kWide, 0, -0.5f * kWide}, {0, -kWide, 0}, c.glass);
       c.half_environment(2.0f);
       Light portal = c.area_lamp({0, 0, 0.9f}, 1.5f, -1.0f, 1.0f);
       std::get<AreaLight>(portal.shape).is_portal = true;
       c.builder.add_light(portal);
     },
     {}},
    {"a panel under the sky",
     [](Court& c) {
       c.pane(), c.face(1.5f, -1.0f, c.emission({3, 3, 3}), 1.5f), c.glowing_environment(0.1f, 0.5f);
     },
     {}},
    {"a panel",
     [](Court& c) {
       c.pane(), c.face(1.5f, -1.0f, c.emission({3, 3, 3}), 1.5f);
     },
     {}},
    {"a panel that is there four times",
     [](Court& c) {
       c.pane();
       const int glow = c.emission({3, 3, 3});
       const Instance panel = c.quad({0, 0, 1.5f}, {1.5f, 0, 0}, {0, 1.5f, 0}, glow);
       c.builder.add_instance(panel), c.face(1.5f, -1.0f, glow, 1.5f), c.builder.add_instance(panel);
     },
     {}},
    {"a large panel that emits unevenly",
     [](Court& c) { c.pane(), c.face(1.5f, -1.0f, c.striped_emission(3.0f), 6.0f); },
     {}},
    {"a panel behind thick glass",
     [](Court& c) {
       c.pane(1.0f, kWide, 0.6f), c.face(1.8f, -1.0f, c.emission({3, 3, 3}), 0.8f);
     },
     {}},
    {"a panel behind one face",
     [](Court& c) {
       c.face(1.0f, -1.0f, c.glass), c.face(1.5f, -1.0f, c.emission({3, 3, 3}), 1.5f);
     },
     {}},
    {"a panel beside a board",
     [](Court& c) {
       c.pane(1.0f, kWide, 0.8f), c.face(2.4f, -1.0f, c.emission({3, 3, 3}), 4.0f);
       c.quad({1.3f, 0, 1.9f}, {1.6f, 0, 0}, {0, 8, 0}, c.diffuse(0.0f));
     },
     {}},
    {"a panel behind a curtain",
     [](Court& c) {
       c.pane(), c.face(1.5f, -1.0f, c.emission({3, 3, 3}), 1.0f);
       c.face(1.2f, 1.0f, c.transparent({1, 0.5f, 1}, 0.7f, 0.3f));
     },
     {}},
    {"panels before and behind",
     [](Court& c) {
       c.pane(), c.pane(1.6f), c.face(1.5f, -1.0f, c.emission({3, 3, 3}), 0.7f);
       c.face(0.8f, -1.0f, c.emission({1, 1, 1}), 0.3f), c.face(2.0f, -1.0f, c.emission({5, 5, 5}), 2.0f);
     },
     {}},
    {"glass with dust",
     [](Court& c) { c.glass = c.clear_glass(kIor, 0, {}, 0.4f), c.pane(), c.sun(0.6f), c.area(1.4f); },
     {}},
    {"glass with holes",
     [](Court& c) { c.glass = c.clear_glass(kIor, 0, {}, 0, 0.4f), c.pane(), c.sun(0.6f), c.area(1.4f); },
     {}},
    {"a soft lamp",
     [](Court& c) {
       c.pane(), c.soft_lamp({0.1f, 0.2f, 1.5f}, 0.3f);
     },
     {}},
    {"an area lamp", [](Court& c) { c.pane(), c.area(1.4f); }, {}},
    {"one in the pane", [](Court& c) { c.pane(), c.area(1.01f); }, {}},
    {"one that not all sees through the pane", [](Court& c) { c.pane(1.0f, 1.0f), c.area(1.4f); }, {}},
    {"a ball",
     [](Court& c) {
       c.pane(), c.point_lamp({0.1f, 0.2f, 1.5f}, 1.0f, 0.3f);
     },
     {}},
    {"a ball through the pane",
     [](Court& c) {
       c.pane(), c.point_lamp({0.1f, 0.2f, 1.0f}, 1.0f, 0.3f);
     },
     {}},
    {"lamps behind two panes",
     [](Court& c) {
       c.pane(), c.pane(1.2f), c.area(1.4f), c.point_lamp({0.4f, 0, 1.5f}, 1.0f, 0.3f);
     },
     {}},
    {"a lamp behind thick glass", [](Court& c) { c.pane(1.0f, kWide, 1.0f), c.area(2.2f); }, {}},
    {"a lamp behind one face", [](Court& c) { c.face(1.0f, -1.0f, c.glass), c.area(1.4f); }, {}},
    {"lamp and curtain",
     [](Court& c) {
       c.pane(), c.area(1.4f), c.face(1.2f, 1.0f, c.transparent({1, 0.5f, 1}, 0.7f, 0.3f));
       c.face(0.8f, 1.0f, c.transparent({1, 0.5f, 1}, 0.7f, 0.3f));
     },
     {}},
    {"lamp and board", [](Court& c) { c.pane(), c.area(1.4f), c.face(1.1f, 1.0f, c.diffuse(0.5f), 0.3f); }, {}},
    {"lamps on both sides",
     [](Court& c) {
       c.pane(), c.sun(0.6f), c.area(2.0f), c.point_lamp({0, 0.5f, 0.6f}, 0.3f, 0.1f);
       c.builder.add_light(c.area_lamp({0.5f, 0, 0.8f}, 0.5f, -1.0f, 0.5f));
     },
     {}},
};

struct Sums {
  Moments all, direct, indirect, seen;
  Moments brighter;  // all, times 1.15
};
Sums trace(const Case& of, bool passes) {
  constexpr uint32_t kPaths = 100000;
  Court court;
  of.build(court);
  Tracer tracer(court, of.limits, EnvironmentDensity::COMPENSATED);
  if (passes) tracer.pass_panes();
  EXPECT_EQ(tracer.context().passes_panes, passes);
  PathScratch scratch;
  Sums sums;
  for (uint32_t i = 0; i < kPaths; ++i) {
    PathSampler sampler(passes ? 1 : 2, 0, i, SampleSequence::RANDOM);
    const PathRecord r =
        trace_path(tracer.context(), {{0.1f, 0, 0.4f}, normalize(Vec3{-0.1f, 0, -1})}, sampler, scratch);
    sums.direct.add(r.direct.g), sums.indirect.add(r.indirect.g);
    sums.seen.add((r.emission + r.environment).g);
    const float all = (r.direct + r.indirect + r.emission + r.environment).g;
    sums.all.add(all), sums.brighter.add(1.15 * all);
  }
  return sums;
}

/// False-alarm rate kFalseAlarmRate for all of them together. Planted bug: 15 % more light.
TEST(ClearPanes, ChangeNothingButNoise) {
  const int count = static_cast<int>(4 * std::size(kCases));
  for (const Case& of : kCases) {
    SCOPED_TRACE(of.name);
    const Sums with = trace(of, true), without = trace(of, false);
    const auto compare = [&](const char* name, const Moments& a, const Moments& b) {
      if (a.variance() == 0.0 && b.variance() == 0.0)
        EXPECT_EQ(a.mean(), b.mean()) << name;
      else
        EXPECT_GT(same_mean_p_value(a, b), shared_rate(count)) << name << ": " << a.mean() << " for " << b.mean();
    };
    compare("all", with.all, without.all);
    compare("direct", with.direct, without.direct);
    compare("indirect", with.indirect, without.indirect);
    compare("seen", with.seen, without.seen);
    EXPECT_LT(same_mean_p_value(with.brighter, without.all), shared_rate(count)) << "planted";
  }
}

/// Of these seeds; without, few paths find the light at all.
TEST(ClearPanes, LowerTheNoise) {
  for (const std::string name : {"a sun", "the sky", "an area lamp", "a panel", "a ball", "lamps behind two panes"}) {
    const auto of = std::ranges::find(kCases, name, &Case::name);
    ASSERT_NE(of, std::end(kCases));
    EXPECT_LT(trace(*of, true).all.variance(), 0.5 * trace(*of, false).all.variance()) << name;
  }
}

}  // namespace
}  // namespace cistern::test
