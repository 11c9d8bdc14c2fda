#include "film/picture_noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/rng.h"

namespace cistern::test {
namespace {

constexpr int kSide = 80;  // 100 blocks
constexpr uint32_t kSamples = 64;

/// A square picture whose samples are `sample(pixel, rng)`.
template <class Sample>
Film make_film_of(uint32_t samples, const Sample& sample) {
  Film film(kSide, kSide, {Pass::COMBINED_NOISE});
  for (uint32_t pixel = 0; pixel < kSide * kSide; ++pixel) {
    Rng rng(pixel, 0, 0, 7);
    for (uint32_t k = 0; k < samples; ++k) film.add(pixel, sample(pixel, rng));
  }
  return film;
}

PathRecord make_sample(float radiance, float alpha) {
  PathRecord record;
  record.direct = Rgb(radiance);
  record.alpha = alpha;
  return record;
}

/// An opaque one of this radiance.
template <class Radiance>
Film make_film(uint32_t samples, const Radiance& radiance) {
  return make_film_of(samples, [&](uint32_t pixel, Rng& rng) { return make_sample(radiance(pixel, rng), 1.0f); });
}

float uniform(uint32_t, Rng& rng) { return rng.next_float(); }

TEST(PictureNoise, IsNothingInAnEvenPicture) {
  EXPECT_NEAR(PictureNoise(make_film(kSamples, [](uint32_t, Rng&) { return 0.5f; }), 1.0).of_most(), 0.0, 1e-6);
  EXPECT_EQ(PictureNoise(make_film(kSamples, [](uint32_t, Rng&) { return 0.0f; }), 1.0).of_most(), 0.0);
  EXPECT_EQ(PictureNoise(Film(kSide, kSide, {Pass::COMBINED_NOISE}), 1.0).of_most(), 0.0) << "without samples";
}

/// Of uniform numbers the mean of n has the variance 1 / (12 n), and the display shows that times its slope at a half.
/// Blocks tell it to one in sqrt(2 * 64) = 9 % of its root: the nineteenth of twenty is above it by 1.6 of these.
TEST(PictureNoise, IsTheStandardErrorOfWhatIsDisplayed) {
  const double slope = (displayed(0.501) - displayed(0.499)) / 0.002;
  const double expected = slope * std::sqrt(1.0 / (12.0 * kSamples));
  EXPECT_NEAR(PictureNoise(make_film(kSamples, uniform), 1.0).of_most() / expected, 1.15, 0.12);
}

TEST(PictureNoise, FallsWithTheRootOfTheSamples) {
  const double few = PictureNoise(make_film(16, uniform), 1.0).of_most(),
               many = PictureNoise(make_film(256, uniform), 1.0).of_most();
  EXPECT_NEAR(few / many, 4.0, 0.8);
}

TEST(PictureNoise, IsThatOfTheExposedPicture) {
  const auto dim = [](uint32_t pixel, Rng& rng) { return uniform(pixel, rng) / 1024.0f; };
  const Film film = make_film(kSamples, dim);
  EXPECT_NEAR(PictureNoise(film, 1024.0).of_most(), PictureNoise(make_film(kSamples, uniform), 1.0).of_most(), 1e-4);
  EXPECT_LT(PictureNoise(film, 1.0).of_most(), 0.1 * PictureNoise(film, 1024.0).of_most());
}

/// Four of a hundred blocks are noisy, or six.
TEST(PictureNoise, LeavesOutOneBlockInTwenty) {
  const auto noisy_blocks = [](uint32_t blocks) {
    return make_film(kSamples, [=](uint32_t pixel, Rng& rng) {
      const bool is_noisy = pixel / kSide < 8 && pixel % kSide < 8 * blocks;
      return is_noisy ? rng.next_float() : 0.5f;
    });
  };
  EXPECT_LT(PictureNoise(noisy_blocks(4), 1.0).of_most(), 1e-6);
  EXPECT_GT(PictureNoise(noisy_blocks(6), 1.0).of_most(), 0.01);
}

TEST(PictureNoise, FinishesQuietBlocksAmongQuietOnes) {
  const auto noisy_at = [](uint32_t column, uint32_t row) {
    return make_film(kSamples, [=](uint32_t pixel, Rng& rng) {
      const bool is_noisy = pixel % kSide / 8 == column && pixel / kSide / 8 == row;
      return is_noisy ? rng.next_float() : 0.5f;
    });
  };
  for (const auto& [column, row, blocks] : {std::array{4u, 5u, 9u}, {0u, 5u, 6u}, {9u, 9u, 4u}}) {
    Film film = noisy_at(column, row);
    const PictureNoise noise(film, 1.0);
    EXPECT_GT(noise.of_worst(), 0.01);
    EXPECT_EQ(noise.finish_quiet_blocks(film, 0.6 * noise.of_worst()), blocks * 64u);
    for (uint32_t pixel = 0; pixel < kSide * kSide; ++pixel) {
      const auto distance = [](uint32_t a, uint32_t b) { return a > b ? a - b : b - a; };
      const bool is_near = distance(pixel % kSide / 8, column) <= 1 && distance(pixel / kSide / 8, row) <= 1;
      ASSERT_EQ(film.is_finished(pixel), !is_near) << pixel;
    }
    EXPECT_EQ(noise.finish_quiet_blocks(film, 1e-9), blocks * 64u) << "finished ones stay so";
    EXPECT_EQ(noise.finish_quiet_blocks(film, 0.8 * noise.of_worst()), 64u) << "beside it, that is little";
    EXPECT_EQ(noise.finish_quiet_blocks(film, 1.0), 0u);
  }
}

/// Of a dark thing out of focus all noise is in what it covers.
TEST(PictureNoise, IsThatOfWhatATransparentFilmLetsThrough) {
  const auto dark = [](uint32_t, Rng& rng) { return make_sample(0.0f, 1.0f - rng.next_float()); };
  const Film film = make_film_of(kSamples, dark), white = make_film(kSamples, uniform);
  EXPECT_NEAR(PictureNoise(film, 1.0).of_most(), PictureNoise(white, 1.0).of_most(), 1e-6);
  EXPECT_NEAR(PictureNoise(film, 100.0).of_most(), PictureNoise(white, 1.0).of_most(), 1e-6)
      << "exposed is the film alone";
}

TEST(PictureNoise, FarBeyondWhiteNothingShows) {
  const auto lamp = [](uint32_t, Rng& rng) { return 1000.0f * (0.5f + rng.next_float()); };
  EXPECT_LT(PictureNoise(make_film(kSamples, lamp), 1.0).of_most(), 1e-3);
}

TEST(PictureNoise, OfOneSampleNoneIsSure) {
  EXPECT_GT(PictureNoise(make_film(1, [](uint32_t, Rng&) { return 0.5f; }), 1.0).of_most(), 0.2);
}

}  // namespace
}  // namespace cistern::test
