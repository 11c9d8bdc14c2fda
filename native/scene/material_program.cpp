#include "scene/material_program.h"

#include <array>
#include <span>

#include "base/check.h"
#include "base/murmur_hash.h"
#include "scene/mesh.h"
#include "scene/program_checks.h"

namespace cistern {
namespace {

// Operands of CLOSURE_PRINCIPLED (op_table).
enum Principled : size_t {
  kPrincipledWeight = 0,
  kPrincipledRoughness = 3,
  kPrincipledIor = 4,
  kPrincipledAlpha = 5,
  kPrincipledNormal = 6,
  kPrincipledSubsurface = 8,
  kPrincipledTransmission = 14,
  kPrincipledCoatWeight = 15,
  kPrincipledSheenWeight = 20,
  kPrincipledEmissionColor = 23,
  kPrincipledEmissionStrength = 24,
  kPrincipledSubsurfaceRadius = 25,
  kPrincipledInverseAbbe = 31,
};

std::span<const Operand> operands_of(const MaterialProgram& program, const Instruction& instruction) {
  return {program.inputs.data() + instruction.first_input, instruction.input_count};
}

bool is_constant_zero(const MaterialProgram& p, Operand o) {
  return o.is_constant() && p.constants[static_cast<size_t>(o.index())] == Vec3{};
}

float constant_x(const MaterialProgram& p, Operand o) { return p.constants[static_cast<size_t>(o.index())].x; }

/// Floats are stored in x; what else a constant holds does not matter then.
bool is_zero_float(const MaterialProgram& p, Operand o) { return o.is_constant() && constant_x(p, o) == 0.0f; }

bool is_thin(const Instruction& closure) {
  constexpr size_t kThin = 3;  // parameter of CLOSURE_PRINCIPLED, op_table.cpp
  return closure.op == Op::CLOSURE_PRINCIPLED && closure.parameters[kThin] != 0;
}

/// Whether the closure is a sheet of glass that may be clear somewhere: what is passes straight through. One of that
/// roughness and index is far from it (sheet_alpha).
bool is_sheet(const MaterialProgram& p, const Instruction& closure) {
  constexpr float kRough = 0.1f, kDense = 1.01f;
  const std::span<const Operand> in = operands_of(p, closure);
  if (!is_thin(closure) || is_zero_float(p, in[kPrincipledTransmission])) return false;
  const auto is_at_least = [&](size_t i, float least) { return in[i].is_constant() && constant_x(p, in[i]) >= least; };
  return !(is_at_least(kPrincipledRoughness, kRough) && is_at_least(kPrincipledIor, kDense));
}

/// Whether the hair's cross-section is a circle everywhere: light passes beside others.
bool is_round(const MaterialProgram& p, const Instruction& hair) {
  constexpr size_t kAspectRatio = 9;  // input of CLOSURE_MICROFACET_HAIR, op_table.cpp
  const Operand aspect_ratio = operands_of(p, hair)[kAspectRatio];
  return aspect_ratio.is_constant() && constant_x(p, aspect_ratio) == 1.0f;
}

bool may_pass_light(const MaterialProgram& p, const Instruction& closure) {
  const std::span<const Operand> in = operands_of(p, closure);
  if (closure.op == Op::CLOSURE_TRANSPARENT) return !is_zero_float(p, in[0]) && !is_constant_zero(p, in[1]);
  if (closure.op == Op::CLOSURE_MICROFACET_HAIR) return !is_zero_float(p, in[0]) && !is_round(p, closure);
  if (closure.op != Op::CLOSURE_PRINCIPLED || is_zero_float(p, in[kPrincipledWeight])) return false;
  const Operand alpha = in[kPrincipledAlpha];
  return is_sheet(p, closure) || !(alpha.is_constant() && constant_x(p, alpha) >= 1.0f);
}

bool is_portal(const MaterialProgram&, const Instruction& closure) { return closure.op == Op::CLOSURE_RAY_PORTAL; }

/// Whether what shadow rays may pass of a surface depends on the closure.
bool matters_to_shadow(const MaterialProgram& p, const Instruction& closure) {
  return may_pass_light(p, closure) || is_portal(p, closure);
}

bool may_emit_light(const MaterialProgram& p, const Instruction& closure) {
  const std::span<const Operand> in = operands_of(p, closure);
  size_t color = 1, strength = 2;
  if (closure.op == Op::CLOSURE_PRINCIPLED) {
    color = kPrincipledEmissionColor, strength = kPrincipledEmissionStrength;
    if (is_zero_float(p, in[kPrincipledAlpha])) return false;
  } else if (closure.op != Op::CLOSURE_EMISSION) {
    return false;
  }
  return !is_zero_float(p, in[0]) && !is_constant_zero(p, in[color]) && !is_zero_float(p, in[strength]);
}

/// Whether the closure refracts light by its wavelength.
bool may_disperse(const MaterialProgram& p, const Instruction& closure) {
  if (closure.op != Op::CLOSURE_PRINCIPLED || is_thin(closure)) return false;
  const std::span<const Operand> in = operands_of(p, closure);
  return !is_zero_float(p, in[kPrincipledTransmission]) && !is_zero_float(p, in[kPrincipledInverseAbbe]);
}

/// Whether the closure refracts, and is smooth enough for a delta lobe wherever it is.
bool refracts_clearly(const MaterialProgram& p, const Instruction& closure) {
  constexpr float kRoughness = 0.0035f;  // kDeltaAlphaProduct is above its fourth power
  const std::span<const Operand> in = operands_of(p, closure);
  size_t roughness = 2;
  if (closure.op == Op::CLOSURE_PRINCIPLED) {
    roughness = kPrincipledRoughness;
    if (is_thin(closure) || is_zero_float(p, in[kPrincipledTransmission]) || may_disperse(p, closure)) return false;
  } else if (closure.op != Op::CLOSURE_GLASS && closure.op != Op::CLOSURE_REFRACTION) {
    return false;
  }
  return in[roughness].is_constant() && constant_x(p, in[roughness]) <= kRoughness;
}

/// Whether coat or sheen may lie above the closure's emission, which then depends on the direction it leaves in.
bool may_have_layers(const MaterialProgram& p, const Instruction& closure) {
  if (closure.op != Op::CLOSURE_PRINCIPLED) return false;
  const std::span<const Operand> in = operands_of(p, closure);
  return !is_zero_float(p, in[kPrincipledCoatWeight]) || !is_zero_float(p, in[kPrincipledSheenWeight]);
}

/// Adds the closure's emission to `sum` if it is the same everywhere; nothing may lie above it.
bool add_constant_emission(const MaterialProgram& p, const Instruction& closure, Vec3& sum) {
  const std::span<const Operand> in = operands_of(p, closure);
  const bool is_principled = closure.op == Op::CLOSURE_PRINCIPLED;
  const Operand color = in[is_principled ? size_t{kPrincipledEmissionColor} : 1];
  const Operand strength = in[is_principled ? size_t{kPrincipledEmissionStrength} : 2];
  if (!in[0].is_constant() || !color.is_constant() || !strength.is_constant()) return false;
  if (is_principled) {
    const Operand alpha = in[kPrincipledAlpha];
    if (!alpha.is_constant() || constant_x(p, alpha) < 1.0f || may_have_layers(p, closure)) return false;
  }
  sum += (constant_x(p, in[0]) * constant_x(p, strength)) * p.constants[static_cast<size_t>(color.index())];
  return true;
}

bool depends_on_camera(const Instruction& instruction) {
  constexpr int kCameraSpace = 2;  // of VECTOR_TRANSFORM
  const bool to_camera = instruction.op == Op::VECTOR_TRANSFORM &&
                         (instruction.parameters[1] == kCameraSpace || instruction.parameters[2] == kCameraSpace);
  return to_camera || instruction.op == Op::CAMERA_COORDINATE || instruction.op == Op::WINDOW_COORDINATE;
}

/// Whether the closure's transparency (emission) depends on operand `i`.
bool matters_to_transparency(const MaterialProgram& p, const Instruction& closure, size_t i) {
  constexpr std::array kOfHair{true,  true, true,  false, false, false, false, false,
                               false, true, false, false, true,  true,  true};
  if (closure.op == Op::CLOSURE_MICROFACET_HAIR) return kOfHair[i];  // weight, axes, aspect ratio and factors
  return closure.op != Op::CLOSURE_PRINCIPLED || i == kPrincipledWeight || i == kPrincipledAlpha ||
         is_sheet(p, closure);
}
bool matters_to_emission(const MaterialProgram& p, const Instruction& closure, size_t i) {
  if (closure.op != Op::CLOSURE_PRINCIPLED || i == kPrincipledWeight || i == kPrincipledAlpha) return true;
  if (i == kPrincipledEmissionColor || i == kPrincipledEmissionStrength) return true;
  return may_have_layers(p, closure) &&
         (i == kPrincipledNormal || (i >= kPrincipledCoatWeight && i < kPrincipledSubsurfaceRadius));
}

/// The instructions that the closures chosen by `is_wanted` depend on; a backward liveness analysis.
std::vector<Instruction> slice(MaterialProgram& p, bool (*is_wanted)(const MaterialProgram&, const Instruction&),
                               bool (*matters)(const MaterialProgram&, const Instruction&, size_t)) {
  const Operand zero{static_cast<uint16_t>(Operand::kConstantBit | p.constants.size())};
  p.constants.push_back({});
  std::array<bool, kMaxRegisters> is_live{};
  std::vector<Instruction> result;
  for (size_t k = p.instructions.size(); k-- > 0;) {
    Instruction instruction = p.instructions[k];
    const bool is_closure = describe(instruction.op).is_closure;
    if (is_closure ? !is_wanted(p, instruction) : !is_live[instruction.output]) continue;
    if (is_closure) {
      const size_t first = p.inputs.size();
      for (size_t i = 0; i < instruction.input_count; ++i) {
        const Operand operand = p.inputs[instruction.first_input + i];
        p.inputs.push_back(matters(p, instruction, i) ? operand : zero);
      }
      instruction.first_input = static_cast<uint32_t>(first);
    } else {
      is_live[instruction.output] = false;
    }
    for (const Operand operand : operands_of(p, instruction))
      if (!operand.is_constant()) is_live[static_cast<size_t>(operand.index())] = true;
    result.push_back(instruction);
  }
  return {result.rbegin(), result.rend()};
}

bool is_aov(const MaterialProgram&, const Instruction& closure) { return closure.op == Op::CLOSURE_AOV; }
bool is_volume(const MaterialProgram& p, const Instruction& closure) {
  const std::span<const Operand> in = operands_of(p, closure);
  if (closure.op == Op::CLOSURE_VOLUME) return !is_zero_float(p, in[0]) && !is_zero_float(p, in[3]);
  if (closure.op != Op::CLOSURE_VOLUME_EMISSION) return false;
  return !is_zero_float(p, in[0]) && !is_constant_zero(p, in[1]) && !is_zero_float(p, in[2]);
}
bool displaces(const MaterialProgram&, const Instruction& closure) { return closure.op == Op::CLOSURE_DISPLACEMENT; }
bool bends(const MaterialProgram&, const Instruction& closure) { return closure.op == Op::CLOSURE_DISPLACED_BUMP; }
bool shades(const MaterialProgram&, const Instruction& closure) { return closure.op < Op::CLOSURE_AOV; }
bool matters_always(const MaterialProgram&, const Instruction&, size_t) { return true; }

/// Takes what only passes of its own, the medium inside or displacement need out of what is run at every hit.
void divide_instructions(MaterialProgram& p) {
  if (std::ranges::none_of(p.instructions, [](const Instruction& i) { return i.op >= Op::CLOSURE_AOV; })) return;
  p.aov_instructions = slice(p, is_aov, matters_always);
  p.volume_instructions = slice(p, is_volume, matters_always);
  p.displacement_instructions = slice(p, displaces, matters_always);
  p.displaced_bump_instructions = slice(p, bends, matters_always);
  p.instructions = slice(p, shades, matters_always);
}

/// Fills `input_values` and the masks of registers.
void place_constants(MaterialProgram& p) {
  p.input_values.clear();
  for (const Operand operand : p.inputs)
    p.input_values.push_back(operand.is_constant() ? p.constants[static_cast<size_t>(operand.index())] : Vec3{});
  for (std::vector<Instruction>* list :
       {&p.instructions, &p.emission_instructions, &p.transparency_instructions, &p.aov_instructions,
        &p.volume_instructions, &p.displacement_instructions, &p.displaced_bump_instructions}) {
    for (Instruction& instruction : *list) {
      const std::span<const Operand> in = operands_of(p, instruction);
      instruction.register_inputs = 0;
      for (size_t i = 0; i < in.size(); ++i)
        if (!in[i].is_constant()) instruction.register_inputs |= 1u << i;
    }
  }
}

std::vector<TangentUse> tangents_of(const MaterialProgram& p) {
  std::vector<TangentUse> uses;
  const auto add = [&](TangentUse use) {
    if (std::ranges::find(uses, use) == uses.end()) uses.push_back(use);
  };
  for (const std::vector<Instruction>* list : {&p.instructions, &p.aov_instructions, &p.volume_instructions,
                                               &p.displacement_instructions, &p.displaced_bump_instructions}) {
    for (const Instruction& instruction : *list) {
      const int32_t* parameters = instruction.parameters;
      if (instruction.op == Op::TANGENT) add({parameters[0], false});
      if (instruction.op == Op::NORMAL_MAP && parameters[0] == 0) add({parameters[1], parameters[3] != 0});
    }
  }
  return uses;
}

/// Whether what it returns depends on the direction a surface is seen from. Closures: only by their lobes.
bool reads_view(const Instruction& instruction) {
  switch (instruction.op) {
    case Op::REFLECTION_COORDINATE:
    case Op::INCOMING:
    case Op::BACKFACING:
    case Op::LIGHT_PATH:
    case Op::FRESNEL:
    case Op::LAYER_WEIGHT_FRESNEL:
    case Op::LAYER_WEIGHT_FACING:
      return true;
    case Op::WIREFRAME:
      return instruction.parameters[0] != 0;  // lines as wide as pixels
    default:
      return false;
  }
}

/// Refraction and the cones of toon gloss leave in directions that depend on where from; refraction is not there where
/// reflection is total.
bool may_turn(const MaterialProgram& p, const Instruction& closure) {
  if (closure.op == Op::CLOSURE_PRINCIPLED) return !is_zero_float(p, operands_of(p, closure)[kPrincipledTransmission]);
  if (closure.op == Op::CLOSURE_TOON) return closure.parameters[0] != 0;
  return closure.op == Op::CLOSURE_GLASS || closure.op == Op::CLOSURE_REFRACTION || closure.op == Op::CLOSURE_HAIR ||
         closure.op == Op::CLOSURE_MICROFACET_HAIR || closure.op == Op::CLOSURE_SIMPLE_HAIR;
}

bool may_enter(const MaterialProgram& p, const Instruction& closure) {
  const std::span<const Operand> in = operands_of(p, closure);
  if (closure.op == Op::CLOSURE_PRINCIPLED) return !is_thin(closure) && !is_zero_float(p, in[kPrincipledSubsurface]);
  return closure.op == Op::CLOSURE_SUBSURFACE;
}

/// Whether rays of a node meet its own object alone.
bool meets_own_object_alone(const Instruction& node) {
  return node.op == Op::BEVEL || (node.op == Op::AMBIENT_OCCLUSION && node.parameters[2] != 0) ||
         (node.op == Op::RAYCAST && node.parameters[1] != 0);
}

/// Whether a node returns how often a path has bounced.
bool counts_bounces(const Instruction& node) {
  if (node.op != Op::LIGHT_PATH) return false;
  constexpr int kRayDepth = 8, kDiffuseDepth = 9, kGlossyDepth = 10, kTransmissionDepth = 12;  // outputs, op_table.cpp
  const int output = node.parameters[0];
  return output == kRayDepth || output == kDiffuseDepth || output == kGlossyDepth || output == kTransmissionDepth;
}

/// Whether a node tells rays apart that do not come from the camera.
bool tells_scattered_rays(const Instruction& node) {
  constexpr int kIsCamera = 0;  // output, op_table.cpp
  return node.op == Op::LIGHT_PATH && node.parameters[0] != kIsCamera;
}

/// Whether what `op` returns depends on the place inside of an object, along a ray.
bool varies_inside(Op op) {
  switch (op) {
    case Op::NORMAL:
    case Op::TRUE_NORMAL:
    case Op::NORMAL_COORDINATE:
    case Op::REFLECTION_COORDINATE:
    case Op::INCOMING:
    case Op::BACKFACING:
    case Op::OBJECT_RANDOM:
    case Op::OBJECT_LOCATION:
    case Op::INSTANCE_VALUE:
    case Op::INSTANCE_VALUE_ALPHA:
      return false;
    default:
      return op < Op::LIGHT_PATH;  // coordinates and geometry
  }
}

/// Whether what `op` returns depends on more of a hit than the object, the side that is seen, and its operands.
bool varies_over_object(Op op) {
  switch (op) {
    case Op::BACKFACING:
    case Op::OBJECT_RANDOM:
    case Op::OBJECT_LOCATION:
    case Op::INSTANCE_VALUE:
    case Op::INSTANCE_VALUE_ALPHA:
      return false;
    case Op::LIGHT_PATH:
    case Op::NORMAL_MAP:
    case Op::BUMP:
    case Op::FRESNEL:
    case Op::LAYER_WEIGHT_FRESNEL:
    case Op::LAYER_WEIGHT_FACING:
    case Op::AMBIENT_OCCLUSION:
    case Op::BEVEL:
    case Op::RAYCAST:
    case Op::WIREFRAME:
      return true;
    default:
      return op < Op::LIGHT_PATH;  // coordinates and geometry
  }
}

}  // namespace

void finish_program(MaterialProgram& program, int image_count) {
  constexpr size_t kMaxConstants = Operand::kConstantBit - 7;  // up to seven are added below
  if (program.constants.size() > kMaxConstants)
    throw Error(program.name, std::to_string(program.constants.size()) + " constants; at most " +
                                  std::to_string(kMaxConstants) + " are allowed");
  check_program(program, image_count);
  program.matte = matte_id(program.name);
  divide_instructions(program);
  program.has_volume = !program.volume_instructions.empty();
  program.volume_shines = std::ranges::any_of(program.volume_instructions,
                                              [](const Instruction& i) { return i.op == Op::CLOSURE_VOLUME_EMISSION; });
  program.volume_varies =
      std::ranges::any_of(program.volume_instructions, [](const Instruction& i) { return varies_inside(i.op); });

  program.may_be_transparent = program.may_emit = program.needs_footprint = false;
  program.reads_light_path = program.tells_scattered_rays = program.counts_bounces = program.reads_camera = false;
  program.may_be_pane = program.disperses = false;
  program.depends_on_view = program.lobes_depend_on_view = program.has_subsurface = program.looks_at_own_object = false;
  program.emission_is_constant = true;
  program.constant_emission = {};
  for (const Instruction& instruction : program.instructions) {
    const Op op = instruction.op;
    program.needs_footprint |= op == Op::BUMP;
    program.reads_light_path |= op == Op::LIGHT_PATH;
    program.tells_scattered_rays |= tells_scattered_rays(instruction);
    program.counts_bounces |= counts_bounces(instruction);
    program.depends_on_view |= reads_view(instruction);
    program.lobes_depend_on_view |= (reads_view(instruction) && op != Op::BACKFACING) || may_turn(program, instruction);
    program.reads_camera |= depends_on_camera(instruction);
    program.has_subsurface |= may_enter(program, instruction);
    program.looks_at_own_object |= meets_own_object_alone(instruction);
    if (!describe(op).is_closure) continue;
    program.may_be_transparent |= may_pass_light(program, instruction);
    program.may_be_pane |= refracts_clearly(program, instruction);
    program.disperses |= may_disperse(program, instruction);
    if (!may_emit_light(program, instruction)) continue;
    program.may_emit = true;
    if (!add_constant_emission(program, instruction, program.constant_emission)) program.emission_is_constant = false;
  }
  program.looks_at_own_object |= std::ranges::any_of(program.aov_instructions, meets_own_object_alone);
  for (const Instruction& instruction : program.displaced_bump_instructions) {
    program.needs_footprint = true;
    program.tells_scattered_rays |= tells_scattered_rays(instruction);
    program.depends_on_view |= reads_view(instruction);
    program.lobes_depend_on_view |= reads_view(instruction);
    program.reads_camera |= depends_on_camera(instruction);
  }
  if (!program.emission_is_constant) program.constant_emission = {};
  program.may_be_pane &= !program.tells_scattered_rays;

  program.attribute_hashes.clear();
  for (const std::string& name : program.attribute_names) program.attribute_hashes.push_back(attribute_name_hash(name));
  program.tangents = tangents_of(program);
  program.emission_instructions = slice(program, may_emit_light, matters_to_emission);
  program.transparency_instructions = slice(program, matters_to_shadow, matters_to_transparency);
  program.emission_is_uniform =
      std::ranges::none_of(program.emission_instructions, [&](const Instruction& instruction) {
        return varies_over_object(instruction.op) || may_have_layers(program, instruction);
      });
  place_constants(program);
}

}  // namespace cistern
