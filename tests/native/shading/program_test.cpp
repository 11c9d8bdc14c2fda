#include <gtest/gtest.h>

#include <cstring>

#include "base/rng.h"
#include "shading/material.h"
#include "shading/nodes_scene.h"
#include "shading/program_builder.h"
#include "shading/run_program.h"

namespace cistern {
namespace {

using test::ProgramBuilder;

const Vec3 kDown{0.2f, 0.1f, -1.0f};

Scene scene_of(ProgramBuilder& b, const Transform& object_to_world = {}) {
  finish_program(b.program, 0);
  return test::make_scene(test::make_triangle(), object_to_world, b.program);
}

/// What the program's node `value` gives at the point, by emitting it.
Vec3 value_of(const ProgramBuilder& program, Operand value, const SurfacePoint* at = nullptr,
              const PathState& path = {}) {
  ProgramBuilder b = program;
  b.add(Op::CLOSURE_EMISSION, {b.constant(1), value, b.constant(1)});
  const Scene scene = scene_of(b);
  const SurfacePoint point = at != nullptr ? *at : test::point_at(scene, {0.25f, 0.5f}, kDown);
  return to_vec(evaluate_emission(scene, point, path));
}

void expect_near(Vec3 found, Vec3 expected, float tolerance = 1e-5f) {
  EXPECT_NEAR(found.x, expected.x, tolerance);
  EXPECT_NEAR(found.y, expected.y, tolerance);
  EXPECT_NEAR(found.z, expected.z, tolerance);
}

TEST(Program, HasRoomForTheInputsOfEveryInstruction) {
  for (int op = 0; op < static_cast<int>(Op::COUNT); ++op)
    EXPECT_LE(std::strlen(describe(static_cast<Op>(op)).inputs), kMaxInputs) << op;
}

TEST(Program, CoordinatesAtAKnownPoint) {  // the point is (0.5, 0.5, 0) of a triangle with bounds 2 x 1 x 0
  const auto at = [](Op op, std::initializer_list<int32_t> parameters) {
    ProgramBuilder b;
    b.program.attribute_names = {"", "Tint", "Mirrored", "Nothing"};
    return value_of(b, b.add(op, {}, parameters));
  };
  expect_near(at(Op::ATTRIBUTE, {0, 0}), {0.25f, 0.5f, 0.0f});
  expect_near(at(Op::ATTRIBUTE, {1, 0}), {0.25f, 0.5f, 0.0f});
  expect_near(at(Op::ATTRIBUTE, {2, 0}), {-0.25f, 0.5f, 0.0f});
  expect_near(at(Op::ATTRIBUTE, {3, 0}), {});
  expect_near(at(Op::GENERATED, {0}), {0.25f, 0.5f, 0.5f});
  expect_near(at(Op::OBJECT_COORDINATE, {0}), {0.5f, 0.5f, 0.0f});
  expect_near(at(Op::POSITION, {0}), {0.5f, 0.5f, 0.0f});
  expect_near(at(Op::NORMAL, {}), {0.0f, 0.0f, 1.0f});
  expect_near(at(Op::NORMAL_COORDINATE, {0}), {0.0f, 0.0f, 1.0f});
  expect_near(at(Op::TANGENT, {2}), {-1.0f, 0.0f, 0.0f});
  const Vec3 wo = normalize(-kDown);
  expect_near(at(Op::INCOMING, {}), wo);
  expect_near(at(Op::REFLECTION_COORDINATE, {0}), {-wo.x, -wo.y, wo.z});
  expect_near(at(Op::CAMERA_COORDINATE, {0}), {0.5f, 0.5f, 0.0f});
}

TEST(Program, FactorsOfAttributesAreMeansButOfPairs) {
  ProgramBuilder b;
  b.program.attribute_names = {"UV", "Tint", "Nothing"};
  const auto factor = [&](int name) {
    return value_of(b, b.add(Op::BROADCAST, {b.add(Op::ATTRIBUTE_FACTOR, {}, {name, 0})})).x;
  };
  const auto value = [&](int name) { return value_of(b, b.add(Op::ATTRIBUTE, {}, {name, 0})); };
  EXPECT_EQ(factor(0), value(0).x);
  EXPECT_NE(value(0).y, 0.0f);
  EXPECT_FLOAT_EQ(factor(1), (value(1).x + value(1).y + value(1).z) / 3.0f);
  EXPECT_EQ(factor(2), 0.0f);
}

TEST(Program, AlphaOfAMissingAttributeIsTheParameter) {
  ProgramBuilder b;
  b.program.attribute_names = {"Tint", "Nothing"};
  const auto alpha = [&](int name, int missing) {
    return value_of(b, b.add(Op::BROADCAST, {b.add(Op::ATTRIBUTE_ALPHA, {}, {name, missing, 0})})).x;
  };
  EXPECT_EQ(alpha(0, 0), 0.5f);
  EXPECT_EQ(alpha(1, 0), 0.0f);
  EXPECT_EQ(alpha(1, 1), 1.0f);
}

TEST(Program, WindowCoordinatesCoverTheFrame) {
  ProgramBuilder b;
  b.add(Op::CLOSURE_EMISSION, {b.constant(1), b.add(Op::WINDOW_COORDINATE, {}, {0}), b.constant(1)});
  Scene scene = scene_of(b);
  scene.camera.camera_to_world.translation = {0.0f, 0.0f, 2.0f};
  const SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);
  expect_near(to_vec(evaluate_emission(scene, point, {})), {0.625f, 0.625f, 0.0f});  // 0.5 / 2 on [-1, 1]
  scene.camera.type = CameraType::ORTHOGRAPHIC;
  expect_near(to_vec(evaluate_emission(scene, point, {})), {0.75f, 0.75f, 0.0f});
}

TEST(Program, ShiftsMoveByTheirWidth) {
  ProgramBuilder empty;
  const Scene scene = scene_of(empty);
  SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);
  point.footprint = 0.125f;
  for (const int step_index : {1, 2}) {
    constexpr int kTwoAndAHalf = 2500;
    const int shift = step_index + 4 * kTwoAndAHalf;
    ProgramBuilder b;
    b.program.attribute_names = {""};
    const Vec3 step = footprint_step(point, {step_index, 2.5f});
    expect_near(value_of(b, b.add(Op::POSITION, {}, {shift}), &point), point.position + step);
    expect_near(value_of(b, b.add(Op::OBJECT_COORDINATE, {}, {shift}), &point), point.position + step);
    expect_near(value_of(b, b.add(Op::ATTRIBUTE, {}, {0, shift}), &point),
                {0.25f + 0.5f * step.x, 0.5f + step.y, 0.0f});
  }
}

TEST(Program, WireframeIsHalfAWidthOnEachSideOfAnEdge) {
  ProgramBuilder empty;
  const Scene scene = scene_of(empty);
  SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);  // at (0.5, 0.5), 0.2236 from the long edge
  point.footprint = 0.125f;
  point.wo = {0.0f, 0.0f, 1.0f};
  const auto line = [&](float width, bool is_in_pixels) {
    ProgramBuilder b;
    return value_of(b, b.add(Op::BROADCAST, {b.add(Op::WIREFRAME, {b.constant(width)}, {is_in_pixels, 0})}), &point).x;
  };
  EXPECT_EQ(line(0.44f, false), 0.0f);
  EXPECT_EQ(line(0.45f, false), 1.0f);
  EXPECT_EQ(line(3.5f, true), 0.0f);
  EXPECT_EQ(line(3.6f, true), 1.0f);
  point.wo = normalize(Vec3{0.0f, 1.0f, 1.0f});  // pixels look shorter along y
  EXPECT_EQ(line(3.6f, true), 0.0f);
}

TEST(Program, LightPathReadsThePath) {
  PathState path;
  path.ray_kind = kVisibleToGlossy;
  path.is_singular = true;
  path.ray_length = 7.0f;
  path.depth = 5, path.diffuse_depth = 1, path.glossy_depth = 2, path.transparent_depth = 3,
  path.transmission_depth = 4;
  const float expected[] = {0, 0, 0, 1, 1, 1, 0, 7, 5, 1, 2, 3, 4};
  for (int output = 0; output <= 12; ++output) {
    ProgramBuilder b;
    const Operand color = b.add(Op::BROADCAST, {b.add(Op::LIGHT_PATH, {}, {output})});
    EXPECT_EQ(value_of(b, color, nullptr, path).x, expected[output]) << output;
  }
}

TEST(Program, ValuesOfInstancesAreFoundByNameAndRow) {
  for (const int row : {-1, 0, 1, 2}) {
    ProgramBuilder b;
    b.program.attribute_names = {"INFO:color", "unknown", "OBJECT:tint"};
    const Operand tint = b.add(Op::INSTANCE_VALUE, {}, {2}), unknown = b.add(Op::INSTANCE_VALUE, {}, {1});
    const Operand alpha = b.add(Op::BROADCAST, {b.add(Op::INSTANCE_VALUE_ALPHA, {}, {0})});
    b.add(Op::CLOSURE_EMISSION, {b.constant(1), tint, b.constant(1)});
    b.add(Op::CLOSURE_EMISSION, {b.constant(1), unknown, b.constant(1)});
    b.add(Op::CLOSURE_EMISSION, {b.constant(1), alpha, b.constant(1)});
    Scene scene = scene_of(b);
    InstanceValues values;
    values.name_hashes = {attribute_name_hash("OBJECT:tint"), attribute_name_hash("INFO:color")};
    for (int i = 0; i < 16; ++i) values.rows.push_back(static_cast<float>(i));
    scene.instance_values = std::make_shared<const InstanceValues>(values);
    scene.instances[0].values = row;
    const SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);
    const float first = 8.0f * static_cast<float>(row);  // of the row; the alpha of the second name is 7 on
    const bool is_there = row == 0 || row == 1;
    const Vec3 expected = is_there ? Vec3{2 * first + 7, 2 * first + 8, 2 * first + 9} : Vec3{};
    expect_near(to_vec(evaluate_emission(scene, point, {})), expected);
  }
}

TEST(Program, ConversionsAndMixes) {
  ProgramBuilder b;
  const Operand color = b.add(Op::COMBINE_XYZ, {b.constant(0.1f), b.constant(0.5f), b.constant(0.9f)});
  const auto grey = [&](Op op) { return value_of(b, b.add(Op::BROADCAST, {b.add(op, {color})})).x; };
  EXPECT_NEAR(grey(Op::LUMINANCE), 0.1f * 0.2126391f + 0.5f * 0.7151691f + 0.9f * 0.0721928f, 1e-6f);
  EXPECT_NEAR(grey(Op::AVERAGE), 0.5f, 1e-6f);
  EXPECT_NEAR(grey(Op::SEPARATE_Z), 0.9f, 1e-6f);
  const Operand two = b.constant(2);
  expect_near(value_of(b, b.add(Op::MIX_VECTOR, {two, color, b.constant(1)}, {1})), {1.0f, 1.0f, 1.0f});
  expect_near(value_of(b, b.add(Op::MIX_VECTOR, {two, color, b.constant(1)}, {0})), {1.9f, 1.5f, 1.1f});
  expect_near(value_of(b, b.add(Op::MIX_COLOR, {two, color, b.constant(1)}, {7, 0, 1})), {1.0f, 1.0f, 1.0f});
  expect_near(value_of(b, b.add(Op::ENCODE_COLOR, {color})), {0.1f, 0.5f, 0.9f});
}

TEST(Program, MissingImagesAreMagenta) {
  ProgramBuilder b;
  b.program.images = {-1};
  expect_near(value_of(b, b.add(Op::IMAGE, {b.constant(0.5f), b.constant(0.5f)}, {0, 0, 0, 0})), {1.0f, 0.0f, 1.0f});
  expect_near(value_of(b, b.add(Op::IMAGE, {b.constant(0.5f), b.constant(0.5f)}, {-1, 0, 0, 0})), {1.0f, 0.0f, 1.0f});
}

TEST(Program, NonFiniteResultsBecomeZeroAtTheClosure) {
  ProgramBuilder b;
  const Operand infinite = b.add(Op::MATH, {b.constant(1000), b.constant(0), b.constant(0)}, {10, 0});
  expect_near(value_of(b, b.add(Op::BROADCAST, {infinite})), {});
  const Operand bounded = b.add(Op::MATH, {infinite, b.constant(3), b.constant(0)}, {11, 0});
  expect_near(value_of(b, b.add(Op::BROADCAST, {bounded})), {3.0f, 3.0f, 3.0f});  // not replaced on the way
}

TEST(Program, MissingMaterialIsBlack) {
  ProgramBuilder b;
  const Scene scene = scene_of(b);
  SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);
  point.material = -1;
  const Bsdf bsdf = evaluate_material(scene, point, {});
  EXPECT_EQ(bsdf.count, 0);
  EXPECT_TRUE(is_black(bsdf.emission) && is_black(bsdf.transparency));
  EXPECT_EQ(bsdf.ng, point.ng);
  EXPECT_EQ(bsdf.wo, point.wo);
  EXPECT_TRUE(is_black(evaluate_emission(scene, point, {})));
  EXPECT_TRUE(is_black(evaluate_environment(scene, {0.0f, 0.0f, 1.0f}, {})));
}

TEST(Program, EnvironmentSeesItsDirection) {
  const Vec3 direction = normalize(Vec3{0.3f, -0.5f, 0.8f});
  const std::pair<Op, Vec3> cases[] = {{Op::GENERATED, direction},
                                       {Op::OBJECT_COORDINATE, direction},
                                       {Op::POSITION, direction},
                                       {Op::NORMAL, -direction},
                                       {Op::INCOMING, -direction}};
  for (const auto& [op, expected] : cases) {
    ProgramBuilder b;
    b.add(Op::CLOSURE_EMISSION, {b.constant(1), b.add(op, {}, {0}), b.constant(2)});
    Scene scene = scene_of(b);
    scene.environment.material = 0;
    expect_near(to_vec(evaluate_environment(scene, direction, {})), 2.0f * expected);
  }
}

/// A program of a few closures whose operands are constants or textures of the position.
ProgramBuilder random_program(Rng& rng) {
  ProgramBuilder b;
  const Operand position = b.add(Op::POSITION, {}, {0});
  const auto number = [&](float scale) {
    if (rng.next_float() < 0.5f) return b.constant(scale * rng.next_float());
    const Operand noise = b.add(Op::WHITE_NOISE, {position, b.constant(rng.next_float())}, {4});
    return b.add(Op::MATH, {noise, b.constant(scale), b.constant(0)}, {2, 0});
  };
  const auto color = [&]() -> Operand {
    if (rng.next_float() < 0.5f) return b.constant(Vec3{rng.next_float(), rng.next_float(), rng.next_float()});
    return b.add(Op::WHITE_NOISE_COLOR, {position, b.constant(rng.next_float())}, {4});
  };
  const Operand normal = b.add(Op::NORMAL, {});
  const int count = 1 + static_cast<int>(3.0f * rng.next_float());
  for (int i = 0; i < count; ++i) {
    switch (rng.next_uint32() % 3) {
      case 0:
        b.add(Op::CLOSURE_EMISSION, {number(1.0f), color(), number(5.0f)});
        break;
      case 1:
        b.add(Op::CLOSURE_TRANSPARENT, {number(1.0f), color()});
        break;
      default: {
        std::vector<Operand> in;
        for (const char* letter = describe(Op::CLOSURE_PRINCIPLED).inputs; *letter != 0; ++letter)
          in.push_back(*letter == 'f' ? number(1.0f) : (*letter == 'c' ? color() : normal));
        b.add(Op::CLOSURE_PRINCIPLED, in, {1});
      }
    }
  }
  return b;
}

TEST(Program, ShortCutsEqualTheFullEvaluation) {
  Rng rng(2024, 0, 0, 0);
  int emitting = 0, transparent = 0;
  for (int i = 0; i < 400; ++i) {
    ProgramBuilder b = random_program(rng);
    const Scene scene = scene_of(b);
    const MaterialProgram& program = *scene.materials[0];
    const Vec2 u{0.5f * rng.next_float(), 0.5f * rng.next_float()};
    const SurfacePoint point = test::point_at(scene, u, rng.next_float() < 0.5f ? kDown : -kDown);
    const Bsdf full = evaluate_material(scene, point, {});
    EXPECT_EQ(evaluate_emission(scene, point, {}), full.emission) << i;
    EXPECT_EQ(evaluate_transparency(scene, point, {}), full.transparency) << i;
    if (program.emission_is_constant) {
      EXPECT_LE(length(program.constant_emission - to_vec(full.emission)), 1e-6f * length(program.constant_emission))
          << i;
    }
    emitting += is_black(full.emission) ? 0 : 1;
    transparent += is_black(full.transparency) ? 0 : 1;
  }
  EXPECT_GT(emitting, 100);  // the comparison has something to compare
  EXPECT_GT(transparent, 100);
}

TEST(Program, WhatOnlyItsOwnPassesNeedIsNotRunWithTheRest) {
  ProgramBuilder b;
  b.program.attribute_names = {"", "Tint"};
  const Operand uv = b.add(Op::ATTRIBUTE, {}, {0, 0});
  const Operand u = b.add(Op::SEPARATE_X, {uv});
  const Operand v = b.add(Op::SEPARATE_Y, {uv});
  b.add(Op::CLOSURE_AOV, {b.constant(1), uv, u}, {1});
  b.add(Op::CLOSURE_EMISSION, {b.constant(1), uv, v});
  const Scene scene = scene_of(b);
  const MaterialProgram& program = *scene.materials[0];
  EXPECT_EQ(program.instructions.size(), 3u);
  EXPECT_EQ(program.aov_instructions.size(), 3u);
  const SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);
  EXPECT_EQ(evaluate_material(scene, point, {}).emission, Rgb(0.125f, 0.25f, 0.0f));
  int count = 0;
  evaluate_aovs(scene, point, {}, [&](const AovValues& values) {
    ++count;
    EXPECT_EQ(values.name_hash, attribute_name_hash("Tint"));
    EXPECT_EQ(values.color, Rgb(0.25f, 0.5f, 0.0f));
    EXPECT_EQ(values.value, 0.25f);
  });
  EXPECT_EQ(count, 1);
}

TEST(Program, WithoutTransparentShadowOnlyRaysOfLightSamplesStop) {
  const auto passed = [](bool has_transparent_shadow, bool has_volume, uint8_t ray_kind) {
    ProgramBuilder b;
    b.add(Op::CLOSURE_TRANSPARENT, {b.constant(0.5f), b.constant(1)});
    if (has_volume)
      b.add(Op::CLOSURE_VOLUME,
            {b.constant(1), b.constant(1), b.constant(1), b.constant(1), b.constant(0), b.constant(0)}, {0});
    b.program.has_transparent_shadow = has_transparent_shadow;
    const Scene scene = scene_of(b);
    PathState path;
    path.ray_kind = ray_kind;
    return evaluate_transparency(scene, test::point_at(scene, {0.25f, 0.5f}, kDown), path);
  };
  EXPECT_EQ(passed(true, false, kVisibleToShadow), Rgb(0.5f));
  EXPECT_EQ(passed(false, false, kVisibleToShadow), Rgb(0.0f));
  EXPECT_EQ(passed(false, true, kVisibleToShadow), Rgb(0.5f));
  for (const uint8_t ray_kind : {kVisibleToCamera, kVisibleToDiffuse, kVisibleToGlossy})
    EXPECT_EQ(passed(false, false, ray_kind), Rgb(0.5f));
}

TEST(Program, AMissingInstructionInAShortCutIsSeen) {  // planted bug: an alpha instruction lost from the slice
  ProgramBuilder b;
  b.add(Op::CLOSURE_TRANSPARENT, {b.constant(0.25f), b.constant(1)});
  b.add(Op::CLOSURE_TRANSPARENT, {b.constant(0.5f), b.constant(1)});
  finish_program(b.program, 0);
  b.program.transparency_instructions.pop_back();
  const Scene scene = test::make_scene(test::make_triangle(), {}, b.program);
  const SurfacePoint point = test::point_at(scene, {0.25f, 0.5f}, kDown);
  EXPECT_NE(evaluate_transparency(scene, point, {}), evaluate_material(scene, point, {}).transparency);
}

}  // namespace
}  // namespace cistern
