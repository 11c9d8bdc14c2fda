#include "render/settings.h"

#include <gtest/gtest.h>

#include <functional>

#include "base/check.h"

namespace cistern::test {
namespace {

std::string error_of(const std::function<void(Settings&)>& change) {
  Settings settings;
  settings.width = 64, settings.height = 32;
  change(settings);
  try {
    check_settings(settings);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Settings, DefaultsAreValidAndCoverTheFrame) {
  Settings settings;
  settings.width = 64, settings.height = 32;
  check_settings(settings);
  EXPECT_EQ(settings.region.width, 64);
  EXPECT_EQ(settings.region.height, 32);
}

TEST(Settings, EveryMemberOutOfRangeIsNamedWithItsValue) {
  struct Case {
    std::string name, value;
    std::function<void(Settings&)> change;
  };
  const Case cases[] = {
      {"width", "0", [](Settings& s) { s.width = 0; }},
      {"height", "-5", [](Settings& s) { s.height = -5; }},
      {"width", "100000", [](Settings& s) { s.width = 100000; }},
      {"samples", "0", [](Settings& s) { s.samples = 0; }},
      {"threads", "-1", [](Settings& s) { s.threads = -1; }},
      {"filter_width", "0.0", [](Settings& s) { s.filter_width = 0.0f; }},
      {"filter_width", "31", [](Settings& s) { s.filter_width = 31.0f; }},
      {"filter_width", "nan", [](Settings& s) { s.filter_width = NAN; }},
      {"time_limit", "-1", [](Settings& s) { s.time_limit = -1.0; }},
      {"time_limit", "nan", [](Settings& s) { s.time_limit = NAN; }},
      {"noise_threshold", "nan", [](Settings& s) { s.noise_threshold = NAN; }},
      {"display_exposure", "-1", [](Settings& s) { s.display_exposure = -1.0; }},
      {"film_exposure", "-1", [](Settings& s) { s.film_exposure = -1.0f; }},
      {"shutter_curve", "-1",
       [](Settings& s) {
         s.shutter_curve = {1.0f, -1.0f};
       }},
      {"shutter_curve", "larger than 0",
       [](Settings& s) {
         s.shutter_curve = {0.0f, 0.0f};
       }},
      {"max_bounces", "-1", [](Settings& s) { s.limits.max_bounces = -1; }},
      {"max_diffuse_bounces", "-1", [](Settings& s) { s.limits.max_diffuse_bounces = -1; }},
      {"max_glossy_bounces", "5000", [](Settings& s) { s.limits.max_glossy_bounces = 5000; }},
      {"max_transmission_bounces", "-1", [](Settings& s) { s.limits.max_transmission_bounces = -1; }},
      {"max_transparent_bounces", "-1", [](Settings& s) { s.limits.max_transparent_bounces = -1; }},
      {"min_bounces", "-1", [](Settings& s) { s.limits.min_bounces = -1; }},
      {"clamp_direct", "nan", [](Settings& s) { s.limits.clamp_direct = NAN; }},
      {"clamp_indirect", "-1", [](Settings& s) { s.limits.clamp_indirect = -1.0f; }},
      {"region x", "64",
       [](Settings& s) {
         s.region = {64, 0, 1, 1};
       }},
      {"region width", "10",
       [](Settings& s) {
         s.region = {60, 0, 10, 1};
       }},
      {"region height", "0",
       [](Settings& s) {
         s.region = {0, 0, 5, 0};
       }},
      {"pixels", "4294967296", [](Settings& s) { s.width = s.height = 65536; }},
      {"light_candidates", "-1", [](Settings& s) { s.direct_reuse.light_candidates = -1; }},
      {"confidence_cap", "nan", [](Settings& s) { s.direct_reuse.confidence_cap = NAN; }},
      {"spatial_neighbours", "33", [](Settings& s) { s.direct_reuse.spatial_neighbours = 33; }},
      {"spatial_radius", "-1", [](Settings& s) { s.direct_reuse.spatial_radius = -1.0f; }},
      {"spatial_rounds", "17", [](Settings& s) { s.direct_reuse.spatial_rounds = 17; }},
      {"path_spatial_cap", "-1", [](Settings& s) { s.screen_paths.spatial_cap = -1.0f; }},
      {"path_cell_count", "0", [](Settings& s) { s.world_paths.max_count = 0; }},
      {"cache_merged", "33", [](Settings& s) { s.light_cache.merged = 33; }},
      {"cache_candidates", "-5", [](Settings& s) { s.light_cache.candidates = -5; }},
      {"min_cell_size", "2", [](Settings& s) { s.grid.min_cell_size = 2.0f; }},
      {"cell_pixels", "0.5", [](Settings& s) { s.grid.cell_pixels = 0.5f; }},
  };
  for (const Case& c : cases) {
    const std::string error = error_of(c.change);
    EXPECT_NE(error.find(c.name), std::string::npos) << c.name << ": " << error;
    EXPECT_NE(error.find(c.value), std::string::npos) << c.name << ": " << error;
  }
}

TEST(Settings, ZeroIsTheNumberOfThePaper) {
  Settings s;
  s.direct = DirectAnswer::RESTIR_CACHE;
  s.direct_reuse.spatial_neighbours = 3;
  check_settings(s);
  EXPECT_EQ(s.direct_reuse.light_candidates, 8);  // [Stefanescu 2025] §4.2
  EXPECT_EQ(s.direct_reuse.spatial_neighbours, 3);
  EXPECT_EQ(s.light_cache.merged, 4);
  s = {};
  s.direct = DirectAnswer::RIS;
  check_settings(s);
  EXPECT_FALSE(s.direct_reuse.temporal_reuse || s.direct_reuse.spatial_reuse);
  EXPECT_EQ(s.grid.cell_pixels, 10.0f);
  s = {};
  s.indirect = IndirectAnswer::WORLD_REUSE;
  check_settings(s);
  EXPECT_FLOAT_EQ(s.grid.cell_pixels, 192.0f);  // [Zhang and Wang 2023] §5.2: 10 % of the resolution
}

TEST(Settings, TellWhetherTheChosenAnswersUseEarlierFrames) {
  struct Case {
    const char* name;
    DirectAnswer direct;
    SecondaryAnswer secondary;
    IndirectAnswer indirect;
    bool reuses, reuses_without;  // with temporal reuse switched on, and off
  };
  constexpr auto kNee = DirectAnswer::NEE;
  constexpr auto kLater = SecondaryAnswer::NEE;
  constexpr auto kPath = IndirectAnswer::PATH;
  const Case cases[] = {
      {"path tracing", kNee, kLater, kPath, false, false},
      {"learned", DirectAnswer::LEARNED, SecondaryAnswer::LEARNED, kPath, false, false},
      {"RIS", DirectAnswer::RIS, SecondaryAnswer::RIS, kPath, false, false},
      {"ReSTIR", DirectAnswer::RESTIR, kLater, kPath, true, false},
      {"light cache", DirectAnswer::RESTIR_CACHE, kLater, kPath, true, false},
      {"cell reservoirs", kNee, SecondaryAnswer::CELL_RESERVOIRS, kPath, true, false},
      {"RIS and cell reservoirs", DirectAnswer::RIS, SecondaryAnswer::CELL_RESERVOIRS, kPath, true, false},
      {"screen", kNee, kLater, IndirectAnswer::SCREEN_REUSE, true, false},
      {"world", kNee, kLater, IndirectAnswer::WORLD_REUSE, true, true},
      {"shared", kNee, kLater, IndirectAnswer::CELL_SHARED, true, false},
  };
  for (const Case& c : cases) {
    for (const bool is_on : {true, false}) {
      Settings s;
      s.direct = c.direct, s.secondary = c.secondary, s.indirect = c.indirect;
      s.direct_reuse.temporal_reuse = s.secondary_reuse.temporal_reuse = s.screen_paths.temporal_reuse = is_on;
      s.world_paths.temporal_reuse = s.path_sharing.temporal_reuse = is_on;
      check_settings(s);
      EXPECT_EQ(s.has_temporal_reuse(), c.reuses && is_on) << c.name;
      EXPECT_EQ(s.uses_earlier_frames(), is_on ? c.reuses : c.reuses_without) << c.name;
    }
  }
  Settings alone;
  alone.indirect = IndirectAnswer::WORLD_REUSE;
  alone.world_paths.temporal_reuse = alone.world_paths.spatial_reuse = false;
  EXPECT_FALSE(alone.uses_earlier_frames());
}

TEST(Settings, OnePixelOfAnEnormousFrameIsFine) {
  EXPECT_EQ(error_of([](Settings& s) {
              s.width = s.height = 65536;
              s.region = {65535, 65535, 1, 1};
            }),
            "");
}

}  // namespace
}  // namespace cistern::test
