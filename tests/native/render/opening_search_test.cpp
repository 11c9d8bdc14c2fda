#include "render/opening_search.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <atomic>

#include "transport/path_scenes.h"

namespace cistern::test {
namespace {

constexpr float kHalf = 2.0f, kHeight = 2.5f;               // of a square room, m
constexpr float kSide = 0.6f, kBottom = 0.8f, kTop = 1.8f;  // of its window, in the wall at x = kHalf

/// A room with a window, under an even sky, seen from inside.
struct Room : PathScene {
  Settings settings;

  explicit Room(float sky = 1.0f) {
    const int plaster = diffuse(0.7f);
    const Vec3 x{2 * kHalf, 0, 0}, y{0, 2 * kHalf, 0}, z{0, 0, kHeight};
    const float middle = 0.5f * kHeight;
    quad({0, 0, 0}, x, y, plaster);
    quad({0, 0, kHeight}, y, x, plaster);
    quad({-kHalf, 0, middle}, y, z, plaster);
    quad({0, -kHalf, middle}, z, x, plaster);
    quad({0, kHalf, middle}, x, z, plaster);
    const float beside = kHalf - kSide, above = kHeight - kTop;
    quad({kHalf, -kSide - 0.5f * beside, middle}, z, {0, beside, 0}, plaster);
    quad({kHalf, kSide + 0.5f * beside, middle}, z, {0, beside, 0}, plaster);
    quad({kHalf, 0, 0.5f * kBottom}, {0, 0, kBottom}, {0, 2 * kSide, 0}, plaster);
    quad({kHalf, 0, kTop + 0.5f * above}, {0, 0, above}, {0, 2 * kSide, 0}, plaster);
    if (sky > 0.0f) environment({sky, sky, sky});
    settings.width = settings.height = 64;
    settings.region = {0, 0, 64, 64};
    look({-1.8f, -1.5f, 1.2f}, {1, 0.6f, -0.1f});
  }

  void look(Vec3 from, Vec3 along) {
    const Vec3 back = normalize(-along), right = normalize(cross({0, 0, 1}, back)), up = cross(back, right);
    Camera camera;
    camera.camera_to_world = {{right.x, up.x, back.x}, {right.y, up.y, back.y}, {right.z, up.z, back.z}, from};
    builder.set_camera(camera, "camera");
  }
};

struct Search {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Accel> accel;
  SkyWalks walks;

  explicit Search(const Room& room)
      : scene(room.builder.snapshot()), accel(Accel::build(scene)), walks(*scene, *accel, room.settings) {}

  std::vector<AreaLight> find() const { return find_openings(walks, {}); }
  bool pay(const std::vector<AreaLight>& openings) const {
    const LightSet without(scene, LightSampling::TREE, EnvironmentDensity::COMPENSATED);
    const LightSet with(without, openings);
    return openings_pay(walks, without, with, {});
  }
};

TEST(OpeningSearch, FindsTheWindowOfARoom) {
  const Room room;
  const Search search(room);
  const std::vector<AreaLight> openings = search.find();
  ASSERT_EQ(openings.size(), 1u);
  EXPECT_LT(length(openings[0].center - Vec3{kHalf, 0, 0.5f * (kBottom + kTop)}), 0.1f);
  EXPECT_NEAR(length(openings[0].edge_u) * length(openings[0].edge_v), 1.1f * 2 * kSide * (kTop - kBottom), 0.15);
  EXPECT_TRUE(search.pay(openings));
}

TEST(OpeningSearch, IsTheSameOnAnyNumberOfThreads) {
  const Search search((Room()));
  std::vector<AreaLight> one, many;
  tbb::task_arena(1).execute([&] { one = search.find(); });
  tbb::task_arena(4).execute([&] { many = search.find(); });
  EXPECT_EQ(one.size(), 1u);
  EXPECT_EQ(one, many);
}

TEST(OpeningSearch, FindsNothingInTheOpen) {
  Room room;
  room.look({9.0f, -6.0f, 4.0f}, {-1, 0.7f, -0.2f});
  room.floor(-0.01f, 60.0f, room.diffuse(0.5f));
  EXPECT_TRUE(Search(room).find().empty());
}

TEST(OpeningSearch, FindsNothingWhereNothingIsOpen) {
  Room room;
  room.quad({kHalf, 0, 0.5f * (kBottom + kTop)}, {0, 0, kTop - kBottom}, {0, 2 * kSide, 0}, room.diffuse(0.5f));
  EXPECT_TRUE(Search(room).find().empty());
}

TEST(OpeningSearch, SeesThroughTransparentPanes) {
  Room room;
  room.quad({kHalf, 0, 0.5f * (kBottom + kTop)}, {0, 0, kTop - kBottom}, {0, 2 * kSide, 0},
            room.transparent({0.9f, 0.9f, 0.9f}));
  EXPECT_EQ(Search(room).find().size(), 1u);
}

TEST(OpeningSearch, EndsWithNothingWheneverItIsStopped) {
  const Search search((Room()));
  std::atomic<int> asked{0}, most{0};
  const auto is_stopped = [&] { return ++asked > most; };
  for (const int questions : {0, 100, 2047, 2060, 10'000, 16'385}) {
    asked = 0;
    most = questions;
    EXPECT_TRUE(find_openings(search.walks, is_stopped).empty()) << questions;
    EXPECT_LT(asked, questions + 300) << "walks go on";  // each block of them asks once more
  }
  most = 100'000;
  EXPECT_EQ(find_openings(search.walks, is_stopped).size(), 1u);
}

TEST(OpeningSearch, LampsThatOutshineTheSkyMakeItNotPay) {
  for (const float intensity : {0.02f, 50.0f}) {
    Room room;
    room.point_lamp({0.5f, 0.5f, 2.0f}, intensity, 0.05f);
    const Search search(room);
    const std::vector<AreaLight> openings = search.find();
    ASSERT_EQ(openings.size(), 1u);
    EXPECT_EQ(search.pay(openings), intensity < 1.0f) << intensity;
  }
}

/// A tinted pane dims what BSDF samples find of the sky as it dims light samples.
TEST(OpeningSearch, DarkPanesMakeItNotPayBesideALamp) {
  for (const float tint : {1.0f, 0.01f}) {
    Room room;
    room.quad({kHalf, 0, 0.5f * (kBottom + kTop)}, {0, 0, kTop - kBottom}, {0, 2 * kSide, 0},
              room.transparent({tint, tint, tint}));
    room.point_lamp({0.5f, 0.5f, 2.0f}, 0.02f, 0.05f);
    const Search search(room);
    const std::vector<AreaLight> openings = search.find();
    ASSERT_EQ(openings.size(), 1u);
    EXPECT_EQ(search.pay(openings), tint == 1.0f) << tint;
  }
}

bool may_find(const Room& room) {
  const auto scene = room.builder.snapshot();
  const LightSet lights(scene, LightSampling::TREE, EnvironmentDensity::COMPENSATED);
  return may_find_openings(*scene, room.settings, lights);
}

TEST(OpeningSearch, IsForLightSamplesThatCompeteWithTheBsdf) {
  Room room;
  EXPECT_TRUE(may_find(room));
  EXPECT_FALSE(may_find(Room(0.0f))) << "no sky";
  room.settings.find_openings = false;
  EXPECT_FALSE(may_find(room));
  room.settings.find_openings = true;
  room.settings.direct = DirectAnswer::RIS;
  EXPECT_FALSE(may_find(room));
  room.settings.direct = DirectAnswer::LEARNED;
  EXPECT_TRUE(may_find(room));
  Light portal = room.area_lamp({0, 0, 2}, 1.0f, -1.0f, 1.0f);
  std::get<AreaLight>(portal.shape).is_portal = true;
  room.builder.add_light(portal);
  EXPECT_FALSE(may_find(room)) << "somebody has said where it shines in";
}

TEST(OpeningSearch, IsNotForAnEvenSkyThatShadowRaysSeeOtherwise) {
  constexpr uint8_t kWithoutShadow = kVisibleToAll & ~kVisibleToShadow;
  for (const bool is_even : {true, false}) {
    Room room;
    if (!is_even) room.glowing_environment(1.0f, 5.0f);
    EXPECT_TRUE(may_find(room));
    room.floor(0.5f, 1.0f, room.diffuse(0.5f), kWithoutShadow);
    EXPECT_EQ(may_find(room), !is_even);
  }
}

}  // namespace
}  // namespace cistern::test
