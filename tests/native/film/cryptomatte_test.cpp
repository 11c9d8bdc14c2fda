#include "film/cryptomatte.h"

#include <gtest/gtest.h>

#include <array>

#include "film/surface_film.h"
#include "render/render_scenes.h"

namespace cistern::test {
namespace {

const SampleRounding kFirst(0, 0);

TEST(Mattes, SharesOfAnIdAreAddedUp) {
  std::array<MatteShare, 4> slots{};
  for (const float id : {3.0f, -7.0f, 3.0f, 5.0f}) add_matte(slots, id, 0.25f, kFirst);
  EXPECT_EQ(slots[0].id, 3.0f);
  EXPECT_EQ(slots[0].weight, 0.5f);
  EXPECT_EQ(slots[1].id, -7.0f);
  EXPECT_EQ(slots[2].id, 5.0f);
  EXPECT_EQ(slots[3].id, 0.0f);
}

TEST(Mattes, WhatFindsNoSlotGoesToTheLast) {
  std::array<MatteShare, 2> slots{};
  for (const float id : {1.0f, 2.0f, 3.0f, 1.0f, 4.0f}) add_matte(slots, id, 1.0f, kFirst);
  EXPECT_EQ(slots[0].weight, 2.0f);
  EXPECT_EQ(slots[1].id, 2.0f);
  EXPECT_EQ(slots[1].weight, 3.0f);
}

TEST(Mattes, AreRankedByShareAndEqualOnesStayInOrder) {
  std::array<MatteShare, 5> slots{{{1.0f, 0.1f}, {2.0f, 0.4f}, {3.0f, 0.1f}, {4.0f, 0.4f}, {0.0f, 0.0f}}};
  rank_mattes(slots);
  const std::array<float, 5> ids{2.0f, 4.0f, 1.0f, 3.0f, 0.0f};
  for (size_t i = 0; i < ids.size(); ++i) EXPECT_EQ(slots[i].id, ids[i]) << i;
}

TEST(Mattes, FilmGivesTwoRankedSharesForEachLevel) {
  SurfacePasses passes;
  const auto object = [](int level) { return *find_surface_layer("CryptoObject0" + std::to_string(level)); };
  keep(object(1), passes);
  Scene scene = *small_room();
  scene.instances.resize(3);
  for (int i = 0; i < 3; ++i) {
    scene.instances[static_cast<size_t>(i)].object = i;
    scene.object_labels.resize(3);
    scene.object_labels[static_cast<size_t>(i)].matte = static_cast<float>(10 + i);
  }
  SurfaceFilm film(passes, 2, 1, {});
  SeenSurface seen;
  for (const uint32_t instance : {0u, 1u, 1u, 2u, 2u, 2u, 0u, 2u}) {  // shares 2/8, 2/8, 4/8
    seen.point.instance = instance;
    film.add(1, scene, {&seen, 1});
  }
  const std::vector<float> first = film.resolve(object(0)), second = film.resolve(object(1));
  EXPECT_EQ(std::vector<float>(first.begin(), first.begin() + 4), std::vector<float>(4, 0.0f)) << "no sample";
  EXPECT_EQ(std::vector<float>(first.begin() + 4, first.end()), (std::vector<float>{12.0f, 0.5f, 10.0f, 0.25f}));
  EXPECT_EQ(std::vector<float>(second.begin() + 4, second.end()), (std::vector<float>{11.0f, 0.25f, 0.0f, 0.0f}));
}

TEST(Mattes, WeighWhatIsSeenThroughAndWhatIsBehindIt) {
  SurfacePasses passes;
  keep(*find_surface_layer("CryptoObject00"), passes);
  Scene scene = *small_room();
  scene.instances.resize(2);
  scene.instances[0].object = 0, scene.instances[1].object = 1;
  scene.object_labels = {{0.0f, 10.0f, 0.0f}, {0.0f, 11.0f, 0.0f}};
  SurfaceFilm film(passes, 1, 1, {});
  std::array<SeenSurface, 2> seen;
  seen[0].alpha = 0.25f;
  seen[1].throughput = 0.75f;
  seen[1].point.instance = 1;
  film.add(0, scene, seen);
  EXPECT_EQ(film.resolve(*find_surface_layer("CryptoObject00")), (std::vector<float>{11.0f, 0.75f, 10.0f, 0.25f}));
}

}  // namespace
}  // namespace cistern::test
