#include "shading/dispersion.h"

#include <gtest/gtest.h>

#include "shading/closure_inputs.h"
#include "shading/program_builder.h"

namespace cistern::test {
namespace {

TEST(Dispersion, AbbeNumberIsWhatItIsDefinedToBe) {
  const auto ior = [](float micrometres) { return dispersed_ior(1.62f, 1.0f / 36.0f, micrometres); };
  EXPECT_FLOAT_EQ(ior(0.5876f), 1.62f);
  EXPECT_NEAR((ior(0.5876f) - 1.0f) / (ior(0.4861f) - ior(0.6563f)), 36.0f, 0.01f);
  EXPECT_EQ(dispersed_ior(1.62f, 0.0f, 0.4f), 1.62f);
}

TEST(Dispersion, WavelengthsAreWhiteInTheMean) {
  constexpr int kCount = 20000;
  double r = 0.0, g = 0.0, b = 0.0, largest = 0.0;
  float last = 0.0f;
  for (int i = 0; i < kCount; ++i) {
    const WavelengthSample sample = sample_wavelength((static_cast<float>(i) + 0.5f) / kCount);
    EXPECT_GE(sample.micrometres, last);
    last = sample.micrometres;
    r += double{sample.weight.r} / kCount, g += double{sample.weight.g} / kCount, b += double{sample.weight.b} / kCount;
    largest = std::max(largest, double{max_component(sample.weight)});
  }
  EXPECT_NEAR(r, 1.0, 1e-3);
  EXPECT_NEAR(g, 1.0, 1e-3);
  EXPECT_NEAR(b, 1.0, 1e-3);
  EXPECT_LT(largest, 6.0);  // no wavelength adds much more than others
  EXPECT_NEAR(sample_wavelength(0.0f).micrometres, 0.38f, 1e-5f);
  EXPECT_NEAR(sample_wavelength(1.0f).micrometres, 0.78f, 1e-5f);
}

TEST(Dispersion, ColorsAreThoseOfTheirWavelengths) {
  for (int i = 1; i < 100; ++i) {
    const WavelengthSample sample = sample_wavelength(0.01f * static_cast<float>(i));
    const Rgb w = sample.weight;
    if (sample.micrometres < 0.46f) EXPECT_EQ(max_component(w), w.b) << sample.micrometres;
    if (sample.micrometres > 0.51f && sample.micrometres < 0.56f) EXPECT_EQ(max_component(w), w.g);
    if (sample.micrometres > 0.6f) EXPECT_EQ(max_component(w), w.r) << sample.micrometres;
  }
}

TEST(Dispersion, ClosuresBendTheWavelengthOfThePath) {
  Inputs in = principled();
  in[TRANSMISSION] = grey(1.0f);
  in[INVERSE_ABBE] = grey(0.05f);
  const int32_t parameters[4] = {1, 1, 1, 0};
  const SurfacePoint point = make_point(0.6f);
  const auto at = [&](float micrometres, bool is_inside) {
    Bsdf bsdf;
    bsdf.ng = point.ng, bsdf.wo = point.wo, bsdf.wavelength = micrometres;
    SurfacePoint seen = point;
    seen.is_backface = is_inside;
    add_closure(bsdf, Op::CLOSURE_PRINCIPLED, in, parameters, seen);
    EXPECT_EQ(bsdf.disperses, micrometres > 0.0f && in[INVERSE_ABBE].x > 0.0f);
    return std::get<MicrofacetLobe>(bsdf.lobes[0].model).ior;
  };
  EXPECT_FLOAT_EQ(at(0.0f, false), 1.5f);
  EXPECT_FLOAT_EQ(at(0.45f, false), dispersed_ior(1.5f, 0.05f, 0.45f));
  EXPECT_FLOAT_EQ(at(0.45f, true), 1.0f / dispersed_ior(1.5f, 0.05f, 0.45f));
  EXPECT_GT(at(0.45f, false), at(0.65f, false));
  in[INVERSE_ABBE] = grey(0.0f);
  EXPECT_FLOAT_EQ(at(0.45f, false), 1.5f);
}

TEST(Dispersion, ProgramsTellOfIt) {
  const auto disperses = [](float transmission, float inverse_abbe, bool is_thin) {
    ProgramBuilder b;
    std::vector<Operand> inputs;
    for (const float value : kPrincipledDefaults) inputs.push_back(b.constant(value));
    inputs[TRANSMISSION] = b.constant(transmission), inputs[INVERSE_ABBE] = b.constant(inverse_abbe);
    inputs[ROUGHNESS] = b.constant(0.0f);
    b.add(Op::CLOSURE_PRINCIPLED, inputs, {1, 1, 1, is_thin ? 1 : 0});
    finish_program(b.program, 0);
    EXPECT_EQ(b.program.may_be_pane, transmission > 0.0f && !is_thin && !b.program.disperses);
    return b.program.disperses;
  };
  EXPECT_TRUE(disperses(1.0f, 0.05f, false));
  EXPECT_FALSE(disperses(0.0f, 0.05f, false));
  EXPECT_FALSE(disperses(1.0f, 0.0f, false));
  EXPECT_FALSE(disperses(1.0f, 0.05f, true));
}

}  // namespace
}  // namespace cistern::test
