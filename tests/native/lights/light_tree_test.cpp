#include "lights/light_tree.h"

#include <gtest/gtest.h>

#include "base/frame.h"
#include "lights/lamp_shapes.h"
#include "lights/light_scenes.h"
#include "support/statistics.h"

namespace cistern::test {
namespace {

Vec3 random_point(Rng& rng, float scale) {
  const Vec2 xy = rng.next_vec2();
  return scale * Vec3{2.0f * xy.x - 1.0f, 2.0f * xy.y - 1.0f, 2.0f * rng.next_float() - 1.0f};
}

/// Emitters of all kinds: two-sided, one-sided, cones, all directions; some together in clumps, some in one place.
std::vector<LightBounds> random_emitters(uint64_t seed, uint32_t count) {
  Rng rng(seed, 0, 0, 0);
  std::vector<LightBounds> emitters(count);
  Vec3 clump;
  for (LightBounds& e : emitters) {
    if (rng.next_float() < 0.1f) clump = random_point(rng, 5.0f);
    const Vec3 center = clump + random_point(rng, rng.next_float() < 0.1f ? 0.0f : 0.5f);
    const Vec3 half = rng.next_float() < 0.3f ? Vec3{} : Vec3{rng.next_float(), rng.next_float(), 0.0f} * 0.2f;
    e.box = {center - half, center + half};
    e.axis = square_to_sphere(rng.next_vec2());
    const float kind = rng.next_float();
    e.is_two_sided = kind < 0.5f;
    e.cos_normals = kind < 0.7f ? 1.0f : (kind < 0.85f ? 0.8f : -1.0f);
    e.cos_emission = kind >= 0.7f && kind < 0.85f ? 1.0f : 0.0f;
    e.intensity = std::exp(4.0f * rng.next_float());
  }
  return emitters;
}

struct Receiver {
  Vec3 position, n;
};

Receiver random_receiver(Rng& rng) {
  const Vec3 position = random_point(rng, 7.0f);
  return {position, rng.next_float() < 0.2f ? Vec3{} : square_to_sphere(rng.next_vec2())};
}

TEST(LightTree, ProbabilitiesSumToOne) {
  Rng rng(1, 0, 0, 0);
  for (const uint32_t count : {1u, 2u, 8u, 9u, 100u, 3000u}) {
    const LightTree tree(random_emitters(count, count));
    for (int i = 0; i < 20; ++i) {
      const Receiver r = random_receiver(rng);
      double sum = 0.0;
      for (uint32_t e = 0; e < count; ++e) sum += tree.pmf(e, r.position, r.n);
      const double expected = tree.choose(r.position, r.n, 0.5f) ? 1.0 : 0.0;
      EXPECT_NEAR(sum, expected, 1e-4);
    }
  }
}

TEST(LightTree, ChoosesAlikeInScenesOfMicrometres) {
  constexpr uint32_t kCount = 200;
  constexpr float kScale = 0x1p-24f;
  std::vector<LightBounds> emitters = random_emitters(7, kCount);
  const LightTree large(emitters);
  for (LightBounds& e : emitters) e.box = {e.box.lower * kScale, e.box.upper * kScale};
  const LightTree small(emitters);
  Rng rng(8, 0, 0, 0);
  for (int i = 0; i < 20; ++i) {
    const Receiver r = random_receiver(rng);
    for (uint32_t e = 0; e < kCount; ++e)
      EXPECT_NEAR(small.pmf(e, r.position * kScale, r.n), large.pmf(e, r.position, r.n), 1e-5f) << i << " " << e;
  }
}

double choice_p_value(const LightTree& tree, uint32_t count, Receiver chosen_for, Receiver density_for) {
  constexpr int kDraws = 100000;
  std::vector<double> observed(count), expected(count);
  Rng rng(2, 0, 0, 0);
  for (int i = 0; i < kDraws; ++i) {
    const auto choice = tree.choose(chosen_for.position, chosen_for.n, rng.next_float());
    ++observed[choice->emitter];
  }
  for (uint32_t e = 0; e < count; ++e) expected[e] = kDraws * double{tree.pmf(e, density_for.position, density_for.n)};
  return chi_square_p_value(observed, expected);
}

TEST(LightTree, DrawsWithItsProbabilities) {
  constexpr uint32_t kCount = 700;
  const LightTree tree(random_emitters(5, kCount));
  const double rate = shared_rate(6);
  Rng rng(3, 0, 0, 0);
  for (int i = 0; i < 5; ++i) {
    const Receiver r = random_receiver(rng);
    EXPECT_GT(choice_p_value(tree, kCount, r, r), rate);
  }
  const Receiver here{{1.0f, 2.0f, 3.0f}, {}}, near_by{{1.1f, 2.0f, 3.0f}, {}};
  EXPECT_LT(choice_p_value(tree, kCount, here, near_by), rate) << "planted: probabilities of another receiver";
}

TEST(LightTree, ChoiceReportsItsProbabilityAndAUniformRest) {
  const LightTree tree(random_emitters(6, 1000));
  Rng rng(4, 0, 0, 0);
  std::vector<double> rest(16), expected(16);
  int drawn = 0;
  for (int i = 0; i < 50000; ++i) {
    const Receiver r = random_receiver(rng);
    const auto choice = tree.choose(r.position, r.n, rng.next_float());
    if (!choice) continue;  // everything behind the receiver
    ++drawn;
    EXPECT_NEAR(choice->pmf, tree.pmf(choice->emitter, r.position, r.n), 1e-5f * choice->pmf);
    ++rest[static_cast<size_t>(choice->u_rest * 16.0f)];
  }
  std::fill(expected.begin(), expected.end(), drawn / 16.0);
  EXPECT_GT(drawn, 40000);
  EXPECT_GT(chi_square_p_value(rest, expected), kFalseAlarmRate);
}

/// Largest relative difference between what emitters' probabilities say and how much of [0, 1) chooses them, which
/// bisection measures; numbers go through `rounded`.
template <class Rounded>
double largest_error(const LightTree& tree, const Receiver& r, const Rounded& rounded) {
  const auto choose = [&](double u) { return *tree.choose(r.position, r.n, rounded(u)); };
  double largest = 0.0;
  for (double begin = 0.0; begin < 1.0;) {
    const LightTree::Choice choice = choose(begin);
    double same = begin, end = 1.0;
    for (double middle; middle = 0.5 * (same + end), middle > same && middle < end;)
      (choose(std::min(middle, kDoubleOneMinusEpsilon)).emitter == choice.emitter ? same : end) = middle;
    largest = std::max(largest, std::abs((end - begin) / choice.pmf - 1.0));
    begin = end;
  }
  return largest;
}

TEST(LightTree, EmittersAreChosenAsOftenAsTheySayHoweverSmallTheirShare) {
  std::vector<LightBounds> emitters = random_emitters(8, 300);
  Rng rng(9, 0, 0, 0);
  for (LightBounds& e : emitters) {
    e.intensity = std::exp(25.0f * (rng.next_float() - 1.0f));  // candles beside a lamp
    e.cos_normals = -1.0f;
  }
  const LightTree tree(emitters);
  for (int i = 0; i < 3; ++i) {
    const Receiver r = random_receiver(rng);
    EXPECT_LT(largest_error(tree, r, [](double u) { return u; }), 1e-3);
    EXPECT_GT(largest_error(tree, r, [](double u) { return static_cast<float>(u); }), 0.1) << "planted: few bits";
  }
}

/// A receiver and a point of an emitter between which light can pass, by the definition of LightBounds.
bool can_light(const LightBounds& e, Vec3 point, Vec3 normal, const Receiver& r) {
  const Vec3 to_receiver = normalize(r.position - point);
  const float cos_out = e.is_two_sided ? std::abs(dot(normal, to_receiver)) : dot(normal, to_receiver);
  return cos_out > e.cos_emission && (r.n == Vec3{} || dot(r.n, to_receiver) < 0.0f);
}

TEST(LightTree, NeverExcludesAnEmitterThatCanLightTheReceiver) {
  std::vector<LightBounds> emitters = random_emitters(8, 2000);
  for (LightBounds& e : emitters) e.cos_emission = std::min(e.cos_emission, 0.9f);  // cones need room to sample in
  const LightTree tree(emitters);
  Rng rng(9, 0, 0, 0);
  int lit = 0;
  for (int i = 0; i < 200000; ++i) {
    const auto index = static_cast<uint32_t>(rng.next_float() * 2000.0f);
    const LightBounds& e = emitters[index];
    const Receiver r = random_receiver(rng);
    const Vec3 d = e.box.diagonal();
    const Vec3 point = e.box.lower + Vec3{d.x * rng.next_float(), d.y * rng.next_float(), d.z * rng.next_float()};
    const Vec3 normal = Frame(e.axis).to_world(square_to_cone(rng.next_vec2(), (1.0f - e.cos_normals) * 0.999f));
    if (!can_light(e, point, normal, r)) continue;
    ++lit;
    EXPECT_GT(tree.pmf(index, r.position, r.n), 0.0f);
  }
  EXPECT_GT(lit, 20000);
}

TEST(LightTree, PrefersWhatIsCloseBrightAndFacing) {
  std::vector<LightBounds> emitters(3);
  for (LightBounds& e : emitters) e.axis = {0, 0, -1}, e.cos_normals = 1.0f, e.intensity = 1.0f;
  emitters[0].box = {{0, 0, 1}, {0, 0, 1}};
  emitters[1].box = {{0, 0, 10}, {0, 0, 10}};
  emitters[2].box = {{1, 0, 1}, {1, 0, 1}};
  emitters[2].axis = {0, 0, 1};
  const LightTree tree(emitters);
  const Vec3 origin, up{0, 0, 1};
  EXPECT_NEAR(tree.pmf(0, origin, up), 100.0f / 101.0f, 1e-5f);
  EXPECT_NEAR(tree.pmf(1, origin, up), 1.0f / 101.0f, 1e-5f);
  EXPECT_EQ(tree.pmf(2, origin, up), 0.0f);
  EXPECT_FALSE(tree.choose({0, 0, 20}, up, 0.5f)) << "all lights behind the receiver";
}

/// Irradiance that a lamp causes at the origin of a plane that faces up.
double irradiance_below(const Lamp& lamp) {
  constexpr int kSide = 64;
  double sum = 0.0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec2 uv{(static_cast<float>(i % kSide) + 0.5f) / kSide, (static_cast<float>(i / kSide) + 0.5f) / kSide};
    const std::optional<LampSample> sample = sample_lamp(lamp, uv, {});
    if (sample) sum += magnitude(sample->radiance) * sample->wi.z / sample->pdf;
  }
  return sum / (kSide * kSide);
}

TEST(LightTree, BeamsAreAsStrongAsTheirLightFromNearAndFar) {
  // Of a lamp of a square metre with a spread of a degree, intensity over squared distance is 10,000 times the light
  // that arrives a metre before it: lamps beside it would hardly ever be chosen there.
  for (const float spread : {kPi, 1.0f, 0.2f, 0.02f, 1e-3f, 0.0f}) {
    for (const float distance : {0.2f, 1.0f, 5.0f, 50.0f}) {
      const Lamp lamp =
          make_lamp({.shape = AreaLight{{0, 0, distance}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, false, Rgb(2.0f), spread}});
      const LightBounds bounds = lamp_bounds(lamp);
      const double truth = irradiance_below(lamp);
      const auto ratio = [&](const LightTree& tree) { return tree.irradiance_estimate({}, {0, 0, 1}) / truth; };
      EXPECT_LT(ratio(LightTree(std::vector{bounds})), 2.5) << spread << " rad, from " << distance << " m";
      EXPECT_GT(ratio(LightTree(std::vector{bounds})), 0.4) << spread << " rad, from " << distance << " m";
      const LightTree clusters(std::vector(20, bounds));
      EXPECT_LT(ratio(clusters), 2.5 * 20) << spread << " rad, from " << distance << " m";
      EXPECT_GT(ratio(clusters), 0.4 * 20) << spread << " rad, from " << distance << " m";
    }
  }
}

TEST(LightTree, ClustersWithBeamsAreAsStrongAsTheirParts) {
  LightBounds beam = lamp_bounds(
      make_lamp({.shape = AreaLight{{0, 0, 3}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, false, Rgb(2.0f), 0.01f}}));
  LightBounds other = lamp_bounds(make_lamp({.shape = PointLight{{0, 0, 3}, 0.0f, Rgb(20.0f)}}));
  other.axis = beam.axis, other.cos_normals = beam.cos_normals, other.cos_emission = beam.cos_emission;
  const std::array parts{beam, other};
  const auto estimate = [](const LightBounds& bounds) {
    return LightTree(std::vector{bounds}).irradiance_estimate({0, 0, 2}, {0, 0, 1});
  };
  const LightBounds both = merge(parts);
  const float parts_together = estimate(beam) + estimate(other);
  EXPECT_GT(estimate(both), 0.5f * parts_together);
  EXPECT_LT(estimate(both), 2.0f * parts_together);
  EXPECT_EQ(merge(std::vector(3, other)).near_distance2, 0.0f);
}

TEST(LightTree, MemoryIsStated) {
  constexpr uint32_t kCount = 20000;
  const LightTree tree(random_emitters(10, kCount));
  EXPECT_LT(tree.memory_bytes(), kCount * size_t{120});
}

TEST(LightTree, EmptyTreeChoosesNothing) {
  EXPECT_FALSE(LightTree().choose({}, {}, 0.5f));
  EXPECT_FALSE(LightTree(std::vector<LightBounds>{}).choose({}, {}, 0.5f));
}

}  // namespace
}  // namespace cistern::test
