#include "scene/material_program.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/check.h"
#include "shading/lobe_microfacet.h"
#include "shading/program_builder.h"
#include "shading/thin_sheet.h"

namespace cistern {
namespace {

using test::ProgramBuilder;

std::string error_of(MaterialProgram program, int image_count = 2) {
  try {
    finish_program(program, image_count);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

void expect_error(const MaterialProgram& program, const std::vector<std::string>& parts) {
  const std::string message = error_of(program);
  for (const std::string& part : parts) EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(MaterialProgram, EveryOpIsDescribed) {
  for (int i = 0; i < static_cast<int>(Op::COUNT); ++i) {
    const Op op = static_cast<Op>(i);
    ASSERT_NE(describe(op).name, nullptr) << i;
    EXPECT_EQ(find_op(describe(op).name, "test"), op);
    EXPECT_EQ(describe(op).is_closure, describe(op).output == 0) << describe(op).name;
    EXPECT_EQ(describe(op).is_closure, op >= Op::CLOSURE_PRINCIPLED) << describe(op).name;
  }
  EXPECT_THROW(find_op("CLOSURE_FLUFF", "test"), Error);
}

TEST(MaterialProgram, ErrorsNameProgramInstructionAndValue) {
  ProgramBuilder good;
  const Operand noise = good.add(Op::MATH, {good.constant(1), good.constant(2), good.constant(3)}, {40, 1});
  good.add(Op::CLOSURE_EMISSION, {good.constant(1), good.constant(1), noise});
  EXPECT_EQ(error_of(good.program), "no error");

  MaterialProgram p = good.program;
  p.instructions[0].parameters[0] = 41;
  expect_error(p, {"Clay: instruction 0 (MATH): parameter 0 is 41", "0 to 40"});
  p = good.program;
  p.instructions[0].parameters[1] = -1;
  expect_error(p, {"parameter 1 is -1", "0 to 1"});
  p = good.program;
  p.instructions[0].input_count = 2;
  expect_error(p, {"instruction 0 (MATH): 2 inputs", "3"});
  p = good.program;
  p.instructions[0].first_input = 1000;
  expect_error(p, {"(MATH)", "1000"});
  p = good.program;
  p.instructions[0].output = 7;
  expect_error(p, {"(MATH): writes register 7", "1"});
  p = good.program;
  p.register_count = 300;
  expect_error(p, {"300 registers", "256"});
  p = good.program;
  p.inputs[0] = Operand{0x8000 | 99};
  expect_error(p, {"input 0 is constant 99"});
  p = good.program;
  p.inputs[0] = Operand{0};
  expect_error(p, {"instruction 0 (MATH): input 0 reads register 0 before it is written"});
  p = good.program;
  p.inputs[0] = Operand{5};
  expect_error(p, {"input 0 is register 5"});
  p = good.program;
  p.constants[1].y = std::numeric_limits<float>::quiet_NaN();
  expect_error(p, {"constant 1 is not finite"});
  p = good.program;
  p.images = {0, 2};
  expect_error(p, {"image 1 has handle 2", "2 images"});
  p = good.program;
  p.instructions[1].op = Op::COUNT;
  expect_error(p, {"instruction 1", "unknown operation"});
}

TEST(MaterialProgram, TypesAreChecked) {
  ProgramBuilder b;
  const Operand vector = b.add(Op::POSITION, {}, {0});
  b.add(Op::CLOSURE_DIFFUSE, {b.constant(1), vector, b.constant(0), vector});  // vectors serve as colours
  EXPECT_EQ(error_of(b.program), "no error");
  b.add(Op::MATH, {vector, vector, vector}, {0, 0});
  expect_error(b.program, {"instruction 2 (MATH): input 0 is a vector (register 0); a float is needed"});

  ProgramBuilder f;
  const Operand number = f.add(Op::BACKFACING, {});
  f.add(Op::CLOSURE_TRANSPARENT, {number, number});
  expect_error(f.program, {"(CLOSURE_TRANSPARENT): input 1 is a float (register 0); a colour is needed"});
}

TEST(MaterialProgram, TilesAreChecked) {
  MaterialProgram program;
  program.name = "Clay";
  program.images = {0, 1};
  program.tile_tables = {{0, -1, 1}};
  EXPECT_EQ(error_of(program), "no error");
  program.tile_tables = {{0, 2}};
  expect_error(program, {"a tile is image 2", "the program has 2"});
  program.tile_tables = {{-2}};
  expect_error(program, {"a tile is image -2"});
  program.tile_tables = {std::vector<int>(1001, -1)};
  expect_error(program, {"1001 tiles", "at most 1000"});
}

TEST(MaterialProgram, IndicesOfNamesTablesAndImagesAreChecked) {
  ProgramBuilder b;
  b.program.attribute_names = {"UV"};
  b.program.images = {1};
  b.program.tile_tables = {{0, -1}};
  b.program.tables = {std::vector<Vec3>(kTableSize), std::vector<Vec3>(3)};
  b.program.table_alphas = {std::vector<float>(kTableSize), {}};
  const MaterialProgram base = b.program;
  const auto message = [&](Op op, std::initializer_list<int32_t> parameters) {
    ProgramBuilder c;
    c.program = base;
    std::vector<Operand> inputs;
    for (const char* letter = describe(op).inputs; *letter != 0; ++letter) inputs.push_back(c.constant(0.5f));
    c.add(op, inputs, parameters);
    return error_of(c.program);
  };
  EXPECT_EQ(message(Op::ATTRIBUTE, {0, 2}), "no error");
  EXPECT_NE(message(Op::ATTRIBUTE, {1, 0}).find("attribute names"), std::string::npos);
  EXPECT_EQ(message(Op::ATTRIBUTE, {0, 4 * 10000 + 2}), "no error");  // a bump of the largest filter width
  EXPECT_NE(message(Op::ATTRIBUTE, {0, 4 * 10000 + 3}).find("parameter 1 is 40003"), std::string::npos);
  EXPECT_EQ(message(Op::IMAGE, {0, 2, 3, 3}), "no error");
  EXPECT_EQ(message(Op::IMAGE, {-1, 0, 0, 1 | (100 << 8)}), "no error");
  EXPECT_NE(message(Op::IMAGE, {1, 0, 0, 0}).find("images"), std::string::npos);
  EXPECT_NE(message(Op::IMAGE, {0, 0, 0, 1 | (101 << 8)}).find("blend"), std::string::npos);
  EXPECT_NE(message(Op::IMAGE, {0, 0, 0, 2 | (5 << 8)}).find("blend"), std::string::npos);
  EXPECT_EQ(message(Op::TILED_IMAGE, {0, 2, 3, 3}), "no error");
  EXPECT_NE(message(Op::TILED_IMAGE_ALPHA, {1, 0, 0, 0}).find("tables of tiles"), std::string::npos);
  EXPECT_NE(message(Op::TILED_IMAGE, {-1, 0, 0, 0}).find("tables of tiles"), std::string::npos);
  EXPECT_EQ(message(Op::RAMP_LOOKUP, {0, 1}), "no error");
  EXPECT_NE(message(Op::RAMP_LOOKUP, {2, 1}).find("tables"), std::string::npos);
  EXPECT_NE(message(Op::CURVE_LOOKUP, {1}).find("table 1 has 3 entries; 257"), std::string::npos);
  EXPECT_NE(message(Op::RAMP_LOOKUP_ALPHA, {1, 0}).find("table 1 has 0 entries"), std::string::npos);
  EXPECT_NE(message(Op::NOISE, {5, 0, 0}).find("1 to 4"), std::string::npos);
}

// --- Derived flags ---

MaterialProgram finished(ProgramBuilder& b) {
  finish_program(b.program, 0);
  return b.program;
}

/// As the exporter writes it, with the shading normal.
MaterialProgram principled(std::initializer_list<std::pair<size_t, float>> changes, bool is_thin = false) {
  constexpr size_t kNormal = 6;
  ProgramBuilder b;
  std::vector<float> values = test::kPrincipledDefaults;
  for (const auto& [index, value] : changes) values[index] = value;
  std::vector<Operand> inputs;
  for (const float v : values) inputs.push_back(b.constant(v));
  inputs[kNormal] = b.add(Op::NORMAL, {});
  b.add(Op::CLOSURE_PRINCIPLED, inputs, {1, 0, 0, is_thin});
  return finished(b);
}

TEST(MaterialProgram, TransparencyIsDerived) {
  EXPECT_FALSE(principled({}).may_be_transparent);
  EXPECT_TRUE(principled({{5, 0.5f}}).may_be_transparent);
  EXPECT_FALSE(principled({{5, 0.5f}, {0, 0.0f}}).may_be_transparent);
  for (const float weight : {0.0f, 0.5f})
    for (const float color : {0.0f, 0.5f}) {
      ProgramBuilder b;
      b.add(Op::CLOSURE_TRANSPARENT, {b.constant(weight), b.constant(color)});
      EXPECT_EQ(finished(b).may_be_transparent, weight != 0.0f && color != 0.0f);
    }
  ProgramBuilder linked;
  linked.add(Op::CLOSURE_TRANSPARENT, {linked.add(Op::BACKFACING, {}), linked.constant(1)});
  EXPECT_TRUE(finished(linked).may_be_transparent);
  ProgramBuilder holdout;
  holdout.add(Op::CLOSURE_HOLDOUT, {holdout.constant(1)});
  EXPECT_FALSE(finished(holdout).may_be_transparent);
}

TEST(MaterialProgram, SheetsOfGlassMayBeTransparentIfTheyMayBeClear) {
  constexpr size_t kRoughness = 3, kIor = 4, kSubsurface = 8, kTransmission = 14;
  EXPECT_TRUE(principled({{kTransmission, 1.0f}, {kRoughness, 0.0f}}, true).may_be_transparent);
  EXPECT_TRUE(principled({{kTransmission, 1.0f}, {kRoughness, 0.5f}, {kIor, 1.0f}}, true).may_be_transparent);
  EXPECT_FALSE(principled({{kTransmission, 1.0f}, {kRoughness, 0.1f}, {kIor, 1.01f}}, true).may_be_transparent);
  EXPECT_GT(sqr(sheet_alpha(sqr(0.1f), 1.01f)), kDeltaAlphaProduct);
  EXPECT_FALSE(principled({{kTransmission, 1.0f}, {kRoughness, 0.0f}}).may_be_transparent);
  EXPECT_FALSE(principled({{kRoughness, 0.0f}}, true).may_be_transparent);
  // Solid glass may be a pane, and what gets below a surface is walked.
  EXPECT_TRUE(principled({{kTransmission, 1.0f}, {kRoughness, 0.0f}}).may_be_pane);
  EXPECT_FALSE(principled({{kTransmission, 1.0f}, {kRoughness, 0.0f}}, true).may_be_pane);
  EXPECT_TRUE(principled({{kSubsurface, 1.0f}}).has_subsurface);
  EXPECT_FALSE(principled({{kSubsurface, 1.0f}}, true).has_subsurface);
  EXPECT_TRUE(
      principled({{kTransmission, 1.0f}, {kRoughness, 0.0f}, {23, 0.5f}, {24, 3.0f}}, true).emission_is_uniform);
}

TEST(MaterialProgram, EmissionIsDerived) {
  EXPECT_FALSE(principled({}).may_emit);
  const MaterialProgram glowing = principled({{23, 0.5f}, {24, 3.0f}});
  EXPECT_TRUE(glowing.may_emit && glowing.emission_is_constant);
  EXPECT_EQ(glowing.constant_emission, (Vec3{1.5f, 1.5f, 1.5f}));
  EXPECT_FALSE(principled({{23, 0.5f}, {24, 3.0f}, {15, 0.1f}}).emission_is_constant);  // coat
  EXPECT_FALSE(principled({{23, 0.5f}, {24, 3.0f}, {20, 0.1f}}).emission_is_constant);  // sheen
  EXPECT_FALSE(principled({{23, 0.5f}, {24, 3.0f}, {5, 0.9f}}).emission_is_constant);   // alpha
  EXPECT_FALSE(principled({{23, 0.5f}, {24, 3.0f}, {5, 0.0f}}).may_emit);
  EXPECT_TRUE(glowing.emission_is_uniform);
  EXPECT_TRUE(principled({{23, 0.5f}, {24, 3.0f}, {5, 0.9f}}).emission_is_uniform);
  EXPECT_FALSE(principled({{23, 0.5f}, {24, 3.0f}, {15, 0.1f}}).emission_is_uniform);
  EXPECT_FALSE(principled({{23, 0.5f}, {24, 3.0f}, {20, 0.1f}}).emission_is_uniform);
  for (const Op op : {Op::BACKFACING, Op::OBJECT_RANDOM, Op::INSTANCE_VALUE_ALPHA}) {
    ProgramBuilder b;
    b.program.attribute_names = {"tint"};
    const bool has_name = describe(op).parameter_count > 0;
    const Operand strength = has_name ? b.add(op, {}, {0}) : b.add(op, {});
    b.add(Op::CLOSURE_EMISSION, {b.constant(1), b.constant(2), strength});
    EXPECT_TRUE(finished(b).emission_is_uniform && !finished(b).emission_is_constant) << describe(op).name;
  }
  for (const Op op : {Op::POSITION, Op::INCOMING}) {
    ProgramBuilder b;
    b.add(Op::CLOSURE_EMISSION, {b.constant(1), b.constant(2), b.add(Op::SEPARATE_X, {b.add(op, {})})});
    EXPECT_FALSE(finished(b).emission_is_uniform) << describe(op).name;
  }
  for (const int in_pixels : {0, 1}) {
    ProgramBuilder b;
    const Operand line = b.add(Op::WIREFRAME, {b.constant(0.01f)}, {in_pixels, 0});
    b.add(Op::CLOSURE_EMISSION, {b.constant(1), b.constant(2), line});
    EXPECT_FALSE(finished(b).emission_is_uniform) << "lines of edges";
    EXPECT_EQ(finished(b).depends_on_view, in_pixels == 1);
  }

  ProgramBuilder two;
  two.add(Op::CLOSURE_EMISSION, {two.constant(0.5f), two.constant(1), two.constant(4)});
  two.add(Op::CLOSURE_EMISSION, {two.constant(1), two.constant(2), two.constant(0.25f)});
  EXPECT_EQ(finished(two).constant_emission, (Vec3{2.5f, 2.5f, 2.5f}));
  two.add(Op::CLOSURE_EMISSION, {two.constant(1), two.constant(2), two.add(Op::OBJECT_RANDOM, {})});
  EXPECT_FALSE(finished(two).emission_is_constant);
  ProgramBuilder off;
  off.add(Op::CLOSURE_EMISSION, {off.constant(1), off.constant(2), off.constant(0)});
  EXPECT_FALSE(finished(off).may_emit);
}

TEST(MaterialProgram, SlicesHoldOnlyWhatMatters) {
  ProgramBuilder b;
  b.program.attribute_names = {""};
  b.program.images = {-1};
  const Operand uv = b.add(Op::ATTRIBUTE, {}, {0, 0});
  const Operand color = b.add(Op::IMAGE, {uv, uv}, {0, 0, 0, 0});
  const Operand alpha = b.add(Op::IMAGE_ALPHA, {uv, uv}, {0, 0, 0, 0});
  std::vector<Operand> inputs;
  for (const float v : test::kPrincipledDefaults) inputs.push_back(b.constant(v));
  inputs[1] = color;
  inputs[5] = alpha;
  b.add(Op::CLOSURE_PRINCIPLED, inputs, {1});
  const MaterialProgram p = finished(b);
  EXPECT_EQ(p.instructions.size(), 4u);
  ASSERT_EQ(p.transparency_instructions.size(), 3u);  // not the colour
  EXPECT_EQ(p.transparency_instructions[0].op, Op::ATTRIBUTE);
  EXPECT_EQ(p.transparency_instructions[1].op, Op::IMAGE_ALPHA);
  EXPECT_TRUE(p.emission_instructions.empty());
}

TEST(MaterialProgram, NeedsAreDerived) {
  ProgramBuilder b;
  b.program.attribute_names = {""};
  const MaterialProgram none = finished(b);
  EXPECT_TRUE(none.tangents.empty());
  EXPECT_FALSE(none.needs_footprint || none.reads_light_path);
  const Operand n = b.add(Op::NORMAL_MAP, {b.constant(0.5f), b.constant(1), b.constant(0.5f)}, {0, 0, 0, 1});
  const Operand h = b.add(Op::LIGHT_PATH, {}, {0});
  b.add(Op::BUMP, {h, h, h, h, h, n}, {0});
  const MaterialProgram all = finished(b);
  EXPECT_EQ(all.tangents, (std::vector<TangentUse>{{0, true}}));
  EXPECT_TRUE(all.needs_footprint && all.reads_light_path);
  EXPECT_FALSE(all.counts_bounces);  // output 0: whether it is a camera ray
  b.add(Op::LIGHT_PATH, {}, {8});    // Ray Depth
  EXPECT_TRUE(finished(b).counts_bounces);
}

}  // namespace
}  // namespace cistern
