#include "transport/path_context.h"

#include <gtest/gtest.h>

namespace cistern::test {
namespace {

constexpr float kDiffusePdf = kInvPi;

TEST(GlossLimits, NoneUnlessAskedFor) {
  EXPECT_FALSE(PathLimits{}.limits_gloss());
  EXPECT_EQ(gloss_limits({}, kVisibleToDiffuse, 0.0f), GlossLimits{});
}

TEST(GlossLimits, CausticsAreWhatDiffuseScatteringSendsTheirWay) {
  const PathLimits limits{.caustics_refractive = false};
  EXPECT_TRUE(limits.limits_gloss());
  const GlossLimits diffuse = gloss_limits(limits, kVisibleToDiffuse, kDiffusePdf);
  EXPECT_TRUE(diffuse.has_reflection && !diffuse.has_refraction);
  for (const uint8_t kind : {kVisibleToCamera, kVisibleToGlossy, kVisibleToTransmission, kVisibleToVolume})
    EXPECT_EQ(gloss_limits(limits, kind, kDiffusePdf), GlossLimits{});
}

TEST(GlossLimits, UnlikelyScatteringSoftens) {
  const PathLimits limits{.filter_glossy = 1.0f};
  const auto alpha = [&](float pdf) { return gloss_limits(limits, kVisibleToGlossy, pdf).least_alpha; };
  EXPECT_EQ(alpha(1.0f), 0.0f);
  EXPECT_EQ(alpha(INFINITY), 0.0f) << "delta lobes";
  EXPECT_FLOAT_EQ(alpha(0.75f), 0.25f);
  EXPECT_FLOAT_EQ(alpha(0.0f), 0.5f);
  EXPECT_FLOAT_EQ(gloss_limits({.filter_glossy = 4.0f}, kVisibleToGlossy, 3.0f).least_alpha, 0.25f);
}

}  // namespace
}  // namespace cistern::test
