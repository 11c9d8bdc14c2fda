#include "film/film.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "base/rng.h"

namespace cistern::test {
namespace {

constexpr float kNoHitDepth = 1e10f;
const std::vector<Pass> kAllPasses{Pass::DIRECT,          Pass::INDIRECT, Pass::EMISSION, Pass::ENVIRONMENT,
                                   Pass::DEPTH,           Pass::NORMAL,   Pass::POSITION, Pass::DENOISING_ALBEDO,
                                   Pass::DENOISING_NORMAL};

/// A record of a hit at depth 4 k, everything in it proportional to k.
PathRecord make_record(float k) {
  PathRecord record;
  record.direct = Rgb(k), record.indirect = Rgb(0.0f, 2.0f * k, 0.0f);
  record.emission = Rgb(0.0f, 0.0f, 3.0f * k), record.environment = Rgb(0.5f * k);
  record.alpha = 0.25f * k;
  record.hit = true, record.depth = 4.0f * k;
  record.position = {k, 2.0f * k, 3.0f * k}, record.normal = {0.0f, 0.0f, k};
  record.albedo = Rgb(0.1f * k), record.denoising_normal = {0.0f, k, 0.0f};
  return record;
}

TEST(Film, ResolvesMeans) {
  Film film(2, 1, kAllPasses);
  film.add(1, make_record(1.0f));
  film.add(1, make_record(3.0f));  // mean: k = 2
  const auto at = [&](Pass pass, size_t channel) {
    const auto channels = static_cast<size_t>(describe(pass).channels);
    return film.resolve(pass)[channels + channel];
  };
  EXPECT_FLOAT_EQ(at(Pass::COMBINED, 0), 3.0f);  // direct 2 + environment 1
  EXPECT_FLOAT_EQ(at(Pass::COMBINED, 1), 7.0f);
  EXPECT_FLOAT_EQ(at(Pass::COMBINED, 2), 9.0f);
  EXPECT_FLOAT_EQ(at(Pass::COMBINED, 3), 0.5f);
  EXPECT_FLOAT_EQ(at(Pass::DIRECT, 2), 2.0f);
  EXPECT_FLOAT_EQ(at(Pass::INDIRECT, 1), 4.0f);
  EXPECT_FLOAT_EQ(at(Pass::EMISSION, 2), 6.0f);
  EXPECT_FLOAT_EQ(at(Pass::ENVIRONMENT, 0), 1.0f);
  EXPECT_FLOAT_EQ(at(Pass::DEPTH, 0), 8.0f);
  EXPECT_FLOAT_EQ(at(Pass::POSITION, 2), 6.0f);
  EXPECT_FLOAT_EQ(at(Pass::NORMAL, 2), 2.0f);
  EXPECT_FLOAT_EQ(at(Pass::DENOISING_ALBEDO, 0), 0.2f);
  EXPECT_FLOAT_EQ(at(Pass::DENOISING_NORMAL, 1), 2.0f);
  EXPECT_EQ(film.resolve(Pass::COMBINED)[0], 0.0f) << "the other pixel has no sample yet";
}

TEST(Film, KeepsApartWhatIsSeenOnShadowCatchers) {
  Film film(1, 1, {Pass::CAUGHT});
  PathRecord caught = make_record(1.0f);
  caught.alpha = 0.75f;  // a tenth of the sky is seen before the catcher, and more through it
  caught.caught = 0.9f, caught.alpha_before_catcher = 0.9f, caught.light_before_catcher = Rgb(0.5f);
  film.add(0, caught);
  film.add(0, make_record(5.0f));
  const std::vector<float> pixel = film.resolve(Pass::CAUGHT);
  EXPECT_FLOAT_EQ(pixel[0], 0.5f * (1.5f - 0.5f));
  EXPECT_FLOAT_EQ(pixel[1], 0.5f * (3.5f - 0.5f));
  EXPECT_FLOAT_EQ(pixel[3], 0.5f * (0.9f - 0.15f));
}

TEST(Film, GeometryIsAMeanOverHitsOnly) {
  Film film(1, 1, kAllPasses);
  PathRecord miss;
  miss.environment = Rgb(1.0f);
  miss.depth = kNoHitDepth;
  for (int i = 0; i < 3; ++i) film.add(0, miss);
  EXPECT_EQ(film.resolve(Pass::DEPTH)[0], kNoHitDepth);
  EXPECT_EQ(film.resolve(Pass::NORMAL)[2], 0.0f);
  film.add(0, make_record(1.0f));
  EXPECT_FLOAT_EQ(film.resolve(Pass::DEPTH)[0], 4.0f);
  EXPECT_FLOAT_EQ(film.resolve(Pass::POSITION)[0], 1.0f);
  EXPECT_FLOAT_EQ(film.resolve(Pass::NORMAL)[2], 1.0f);
  EXPECT_FLOAT_EQ(film.resolve(Pass::ENVIRONMENT)[0], 3.5f / 4.0f);
}

/// Light of all kinds, proportional to k.
LightByKind make_light(float k) {
  LightByKind light;
  for (size_t kind = 0; kind < kLightKinds; ++kind) {
    light.direct[kind] = Rgb(k * static_cast<float>(kind + 1));
    light.indirect[kind] = Rgb(0.0f, k, 0.0f);
  }
  light.color = {Rgb(0.5f, 0.0f, 0.25f), Rgb(0.25f), Rgb()};
  light.emission = Rgb(7.0f * k), light.environment = Rgb(9.0f * k);
  return light;
}

TEST(Film, ExposureMultipliesLightAndNothingElse) {
  std::vector<Pass> all;
  for (int pass = 0; pass < static_cast<int>(Pass::CELLS); ++pass) all.push_back(static_cast<Pass>(pass));
  Film plain(1, 1, all, 1), exposed(1, 1, all, 1, 4.0f);
  const std::vector<Rgb> group{Rgb(0.7f)};
  for (const float k : {1.0f, 3.0f, 2.0f}) {
    PathRecord record = make_record(k);
    record.caught = 0.5f;
    const LightByKind light = make_light(k);
    for (Film* film : {&plain, &exposed}) film->add(0, record, &light, group);
  }
  const auto expect = [](std::span<const float> pixels, std::span<const float> times_1, bool is_exposed) {
    for (size_t c = 0; c < pixels.size(); ++c)
      EXPECT_FLOAT_EQ(pixels[c], times_1[c] * (is_exposed && c < 3 ? 4.0f : 1.0f)) << c;
  };
  for (const Pass pass : all) {
    SCOPED_TRACE(describe(pass).name);
    const bool is_color = pass == Pass::DIFFUSE_COLOR || pass == Pass::GLOSSY_COLOR || pass == Pass::TRANSMISSION_COLOR;
    expect(exposed.resolve(pass), plain.resolve(pass), pass < Pass::DEPTH && !is_color);
  }
  expect(exposed.resolve_light_group(0), plain.resolve_light_group(0), true);
  EXPECT_GT(plain.resolve(Pass::COMBINED_NOISE)[0], 0.0f);
}

TEST(Film, LateSamplesCountAsMuchAsEarlyOnes) {
  // Rounded to the nearest number, samples that are alike err alike: a mean of 0.1 was 1 % too bright. By chance they
  // go up and down, and a million of them leave 2^-24 * sqrt(2^20 / 3) = 3.5e-5, of which this is eight.
  constexpr uint32_t kSamples = 1 << 20;
  Film film(1, 1, {Pass::DEPTH, Pass::DIFFUSE_COLOR}, 1);
  PathRecord record = make_record(0.1f);
  const LightByKind light = make_light(0.1f);
  const std::vector<Rgb> group{Rgb(0.7f)};
  for (uint32_t k = 0; k < kSamples; ++k) film.add(0, record, &light, group);
  const auto expect = [](float mean, float sample) { EXPECT_NEAR(mean / sample, 1.0f, 2.8e-4f); };
  expect(film.resolve(Pass::COMBINED)[0], record.combined().r);
  expect(film.resolve(Pass::COMBINED)[3], record.alpha);
  expect(film.resolve(Pass::DEPTH)[0], record.depth);
  expect(film.resolve(Pass::DIFFUSE_COLOR)[0], light.color[0].r);
  expect(film.resolve_light_group(0)[0], group[0].r);
}

TEST(Film, LightOfKindsIsDividedByTheMeanOfTheirColours) {
  Film film(1, 1,
            {Pass::DIFFUSE_DIRECT, Pass::GLOSSY_INDIRECT, Pass::TRANSMISSION_DIRECT, Pass::VOLUME_DIRECT,
             Pass::UNSCATTERED_EMISSION});
  for (const float k : {1.0f, 3.0f}) {  // mean: k = 2
    const LightByKind light = make_light(k);
    film.add(0, make_record(k), &light);
  }
  const auto at = [&](Pass pass, size_t channel) { return film.resolve(pass)[channel]; };
  EXPECT_TRUE(film.has(Pass::DIFFUSE_COLOR) && film.has(Pass::GLOSSY_COLOR));
  EXPECT_FLOAT_EQ(at(Pass::DIFFUSE_COLOR, 0), 0.5f);
  EXPECT_FLOAT_EQ(at(Pass::DIFFUSE_DIRECT, 0), 4.0f);
  EXPECT_FLOAT_EQ(at(Pass::DIFFUSE_DIRECT, 2), 8.0f);
  EXPECT_FLOAT_EQ(at(Pass::DIFFUSE_DIRECT, 1), 6.0f) << "the mean of the others, where there is no colour";
  EXPECT_FLOAT_EQ(at(Pass::GLOSSY_INDIRECT, 1), 8.0f);
  EXPECT_EQ(at(Pass::TRANSMISSION_DIRECT, 0), 0.0f);
  EXPECT_FLOAT_EQ(at(Pass::VOLUME_DIRECT, 0), 8.0f);
  EXPECT_FLOAT_EQ(at(Pass::UNSCATTERED_EMISSION, 0), 14.0f);
}

TEST(Film, CombinedIsTheSameWhetherKindsFitOrNot) {
  Film film(1, 1, {Pass::VOLUME_DIRECT});
  LightByKind light = make_light(1.0f);
  light.direct[0] = Rgb(INFINITY);
  film.add(0, make_record(1.0f), &light);
  EXPECT_FLOAT_EQ(film.resolve(Pass::COMBINED)[0], 1.5f);
  EXPECT_EQ(film.resolve(Pass::VOLUME_DIRECT)[0], 0.0f);
  EXPECT_EQ(film.non_finite_samples(), 1u);
}

/// Emission Noise of one pixel whose k-th sample sees `emission(k)`.
template <typename Emission>
float emission_noise(uint32_t samples, const Emission& emission) {
  Film film(1, 1, {Pass::EMISSION_NOISE});
  for (uint32_t k = 0; k < samples; ++k) {
    PathRecord record;
    record.emission = Rgb(emission(k));
    film.add(0, record);
  }
  return film.resolve(Pass::EMISSION_NOISE)[0];
}

TEST(Film, EvenEmissionHasNoNoiseWhateverTheNumberOfSamples) {
  for (const uint32_t samples : {2u, 3u, 16u, 17u, 100u})
    EXPECT_NEAR(emission_noise(samples, [](uint32_t) { return 500.0f; }), 0.0f, 1e-3f) << samples;
}

TEST(Film, EmissionOfOneSampleIsAllNoise) {
  EXPECT_EQ(emission_noise(1, [](uint32_t) { return 500.0f; }), 500.0f);
  EXPECT_EQ(emission_noise(0, [](uint32_t) { return 500.0f; }), 0.0f);
}

TEST(Film, EmissionNoiseIsTheStandardErrorInTheMean) {
  constexpr uint32_t kSamples = 15;
  constexpr int kPixels = 20000;
  Rng rng(1, 0, 0, 0);
  double squares = 0.0;
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    const float noise = emission_noise(kSamples, [&](uint32_t) { return rng.next_float(); });
    squares += double{noise} * double{noise} / kPixels;
  }
  // The variance of uniform numbers is 1/12. Squares have one degree of freedom, so their mean is off by one in
  // sqrt(2 / kPixels) = 1 %: five of these are a false alarm in two million. With two halves of 8 and 7 samples it is
  // 15^2 / (4 * 8 * 7) = 1.0045 of the variance of the mean.
  EXPECT_NEAR(squares * 12.0 * kSamples, 1.0045, 0.05);
}

TEST(Film, CombinedNoiseIsThatOfItsColourAndAlpha) {
  Film film(1, 1, {Pass::COMBINED_NOISE, Pass::EMISSION_NOISE});
  for (const float k : {1.0f, 3.0f}) {
    PathRecord record = make_record(k);
    record.alpha = 0.25f * k;
    film.add(0, record);
  }
  const std::vector<float> noise = film.resolve(Pass::COMBINED_NOISE);
  ASSERT_EQ(noise.size(), 4u);
  // One of the halves has a single sample of k = 1, the other of k = 3; green is 2 k of indirect light and the sky.
  EXPECT_FLOAT_EQ(noise[0], 1.5f);
  EXPECT_FLOAT_EQ(noise[1], 2.5f + 1.0f);
  EXPECT_FLOAT_EQ(noise[2], 1.5f + 3.0f);
  EXPECT_FLOAT_EQ(noise[3], 0.25f);
  EXPECT_FLOAT_EQ(film.resolve(Pass::EMISSION_NOISE)[2], 3.0f);
}

TEST(Film, HalvesOfEmissionNoiseCoverThePixelEvenly) {
  const auto left_half = [](uint32_t k) { return k % 2 == 0 ? 1.0f : 0.0f; };  // of Sobol's first dimension
  EXPECT_EQ(emission_noise(16, left_half), 0.0f) << "even and odd samples as halves would give 0.5";
  EXPECT_EQ(emission_noise(2, left_half), 0.5f);
}

TEST(Film, NonFiniteRecordsAreCountedNotAdded) {
  Film film(1, 1, kAllPasses);
  film.add(0, make_record(1.0f));
  const std::vector<Rgb PathRecord::*> colors{&PathRecord::direct, &PathRecord::indirect, &PathRecord::emission,
                                              &PathRecord::environment, &PathRecord::albedo};
  for (Rgb PathRecord::*color : colors) {
    PathRecord record = make_record(1.0f);
    (record.*color).g = NAN;
    film.add(0, record);
  }
  for (const float bad : {NAN, INFINITY, 3e38f}) {
    PathRecord record = make_record(1.0f);
    record.alpha = bad;
    film.add(0, record);
    record = make_record(1.0f);
    record.position.x = bad;
    film.add(0, record);
    record = make_record(1.0f);
    record.normal.y = bad;
    film.add(0, record);
    record = make_record(1.0f);
    record.depth = bad;
    film.add(0, record);
    record = make_record(1.0f);
    record.denoising_normal.z = bad;
    film.add(0, record);
  }
  EXPECT_EQ(film.non_finite_samples(), colors.size() + 15);
  EXPECT_FLOAT_EQ(film.resolve(Pass::COMBINED)[0], 1.5f / 21.0f) << "they count as black samples";
  EXPECT_FLOAT_EQ(film.resolve(Pass::DEPTH)[0], 4.0f);
  for (const Pass pass : kAllPasses)
    for (const float value : film.resolve(pass)) EXPECT_TRUE(std::isfinite(value)) << describe(pass).name;
}

TEST(Film, KeepsOnlyWhatWasAskedFor) {
  const Film film(4, 4, {Pass::DEPTH});
  EXPECT_TRUE(film.has(Pass::COMBINED));
  EXPECT_TRUE(film.has(Pass::DEPTH));
  EXPECT_FALSE(film.has(Pass::NORMAL));
  EXPECT_THROW(film.resolve(Pass::NORMAL), Error);
  EXPECT_LT(film.memory_bytes(), Film(4, 4, kAllPasses).memory_bytes());
}

TEST(Film, PassesAreFoundByName) {
  for (size_t i = 0; i < static_cast<size_t>(Pass::COUNT); ++i)
    EXPECT_EQ(find_pass(describe(static_cast<Pass>(i)).name), static_cast<Pass>(i));
  try {
    find_pass("Beauty");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("Beauty"), std::string::npos);
  }
}

TEST(Film, KeepsLightGroupsAsMeansOverSamples) {
  Film film(2, 1, {}, 2);
  const std::vector<Rgb> first{{1, 2, 3}, {4, 5, 6}}, second{{3, 2, 1}, {0, 1, 2}};
  film.add(1, make_record(1.0f), nullptr, first);
  film.add(1, make_record(1.0f), nullptr, second);
  EXPECT_EQ(film.resolve_light_group(0), (std::vector<float>{0, 0, 0, 2, 2, 2}));
  EXPECT_EQ(film.resolve_light_group(1), (std::vector<float>{0, 0, 0, 2, 3, 4}));
  EXPECT_THROW(film.resolve_light_group(2), Error);
  const std::vector<Rgb> broken{{NAN, 0, 0}, {1, 1, 1}};
  film.add(0, make_record(1.0f), nullptr, broken);
  EXPECT_EQ(film.non_finite_samples(), 1u);
  EXPECT_EQ(film.resolve_light_group(1)[0], 0.0f);
  EXPECT_GT(film.resolve(Pass::COMBINED)[0], 0.0f);
}

TEST(Film, LightGroupsHaveNamesByNumber) {
  EXPECT_EQ(light_group_name(12), "Light Group 12");
  EXPECT_EQ(find_light_group("Light Group 12"), 12);
  for (const char* name : {"Light Group ", "Light Group -1", "Light Group 1x", "Light Group 1024", "Light Choice 1"})
    EXPECT_EQ(find_light_group(name), std::nullopt) << name;
}

}  // namespace
}  // namespace cistern::test
