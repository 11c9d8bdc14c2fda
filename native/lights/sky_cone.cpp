#include "lights/sky_cone.h"

#include <array>
#include <optional>

#include "base/angle.h"
#include "base/frame.h"
#include "base/warp.h"
#include "shading/material.h"

namespace cistern {

namespace {

constexpr size_t kDirectionInput = 0, kSunInput = 2, kAnglesInput = 3;  // of SUN_DISC, as op_table lists them
constexpr float kRotationTolerance = 1e-4f;

/// Rows of a rotation or reflection.
using Turn = std::array<Vec3, 3>;

/// How the nodes before an input turn the directions that they are given; nullopt where they do something else.
/// Found by trying, so that no kind of node needs to be known.
std::optional<Turn> find_turn(const Scene& scene, size_t instruction, size_t input) {
  const auto at = [&](Vec3 direction) { return evaluate_environment_input(scene, instruction, input, direction); };
  const Vec3 x = at({1, 0, 0}), y = at({0, 1, 0}), z = at({0, 0, 1});
  for (const Vec3 d : {Vec3{-1, 0, 0}, Vec3{0.6f, 0.0f, -0.8f}, Vec3{0.48f, -0.64f, 0.6f}, Vec3{-0.48f, 0.6f, 0.64f}}) {
    if (!(length(at(d) - (x * d.x + y * d.y + z * d.z)) < kRotationTolerance)) return std::nullopt;
  }
  for (const float overlap : {dot(x, y), dot(y, z), dot(z, x), dot(x, x) - 1.0f, dot(y, y) - 1.0f, dot(z, z) - 1.0f}) {
    if (!(std::abs(overlap) < kRotationTolerance)) return std::nullopt;
  }
  return Turn{x, y, z};
}

}  // namespace

bool contains(const SkyCone& cone, Vec3 direction) {
  return length_squared(direction - cone.axis) <= 2.0f * cone.one_minus_cos;
}

Vec3 sample_cone(const SkyCone& cone, Vec2 u) {
  return Frame(cone.axis).to_world(square_to_cone(u, cone.one_minus_cos));
}

Vec3 outside(const SkyCone& cone, Vec3 direction) {
  if (!contains(cone, direction)) return direction;
  constexpr float kBeyond = 1.01f;
  const Frame frame(cone.axis);
  const Vec3 d = frame.to_local(direction);
  const Vec2 rim{1.0f, azimuth_turns(d.y, d.x)};
  return frame.to_world(square_to_cone(rim, std::min(cone.one_minus_cos * kBeyond, 2.0f)));
}

SkySuns find_sky_suns(const Scene& scene) {
  const MaterialProgram& program = *scene.materials[static_cast<size_t>(scene.environment.material)];
  SkySuns suns;
  for (size_t i = 0; i < program.emission_instructions.size(); ++i) {
    if (program.emission_instructions[i].op != Op::SUN_DISC) continue;
    const std::optional<Turn> turn = find_turn(scene, i, kDirectionInput);
    if (!turn) {
      suns.are_all_found = false;
      continue;
    }
    const Vec3 sun = evaluate_environment_input(scene, i, kSunInput, {0, 0, 1});
    const float half_angle = evaluate_environment_input(scene, i, kAnglesInput, {0, 0, 1}).x;
    const Vec3 axis = normalize_or({dot((*turn)[0], sun), dot((*turn)[1], sun), dot((*turn)[2], sun)}, {0, 0, 1});
    const SkyCone cone{axis, 2.0f * sqr(std::sin(0.5f * half_angle))};
    if (cone.one_minus_cos > 0.0f) suns.cones.push_back(cone);
  }
  return suns;
}

}  // namespace cistern
