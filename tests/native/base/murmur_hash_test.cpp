#include "base/murmur_hash.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cistern::test {
namespace {

/// The first four are published test vectors, the rest stand in files that Cycles wrote.
TEST(MurmurHash, IsThatOfPublishedVectorsAndOfCycles) {
  EXPECT_EQ(murmur_hash_3(""), 0u);
  EXPECT_EQ(murmur_hash_3("test"), 0xba6bd213u);
  EXPECT_EQ(murmur_hash_3("Hello, world!"), 0xc0363e43u);
  EXPECT_EQ(murmur_hash_3("The quick brown fox jumps over the lazy dog"), 0x2e4ff723u);
  EXPECT_EQ(murmur_hash_3("Base"), 0xac95cf4eu);
  EXPECT_EQ(murmur_hash_3("Front3"), 0xc46117d5u);
  EXPECT_EQ(murmur_hash_3("NoMat"), 0x11e7eef4u);
  EXPECT_EQ(murmur_hash_3("default_surface"), 0x78d05529u);
  EXPECT_EQ(murmur_hash_3("ViewLayer.CryptoObject") >> 4, 0x542cafau);
}

TEST(MurmurHash, BytesBeyondAsciiAreUnsigned) { EXPECT_NE(murmur_hash_3("\xc3\xa4"), murmur_hash_3("\x43\x24")); }

TEST(MatteId, IsTheFloatOfTheBitsWhereThatIsANumber) {
  EXPECT_EQ(std::bit_cast<uint32_t>(matte_id(0xac95cf4eu)), 0xac95cf4eu);
  EXPECT_FLOAT_EQ(matte_id("Front3"), -900.3724f);  // in a file of Cycles
}

TEST(MatteId, IsNeverZeroInfiniteOrSubnormal) {
  for (const uint32_t hash : {0u, 1u, 0x80000000u, 0x007fffffu, 0x7f800000u, 0x7fffffffu, 0xff800001u, 0xffffffffu}) {
    const float id = matte_id(hash);
    EXPECT_TRUE(std::isnormal(id)) << hash;
    EXPECT_EQ(std::signbit(id), hash >> 31 != 0) << hash;
  }
}

}  // namespace
}  // namespace cistern::test
