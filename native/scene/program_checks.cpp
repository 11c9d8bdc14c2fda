#include "scene/program_checks.h"

#include <array>

#include "base/check.h"

namespace cistern {
namespace {

enum class ParameterKind : uint8_t { RANGE, ATTRIBUTE_NAME, IMAGE, TILES, TABLE, ALPHA_TABLE, PROJECTION };

struct ParameterRule {
  ParameterKind kind = ParameterKind::RANGE;
  int lowest = 0, highest = 0;
};

using ParameterRules = std::array<ParameterRule, 4>;

constexpr ParameterRule up_to(int highest) { return {ParameterKind::RANGE, 0, highest}; }
constexpr ParameterRule range(int lowest, int highest) { return {ParameterKind::RANGE, lowest, highest}; }
constexpr ParameterRule kFlag = up_to(1);
constexpr int kMaxFilterWidth = 10000;  // of bumps, in thousandths of a pixel; Blender's limit
constexpr ParameterRule kShift = up_to(4 * kMaxFilterWidth + 2);
constexpr ParameterRule kName{ParameterKind::ATTRIBUTE_NAME, 0, 0};
constexpr ParameterRule kImage{ParameterKind::IMAGE, -1, 0};
constexpr ParameterRule kDimensions = range(1, 4);
constexpr ParameterRule kDistribution = up_to(3);
constexpr ParameterRule kSubsurface = up_to(3);
constexpr ParameterRule kPhase = up_to(4);
constexpr ParameterRule kRays = range(1, 128);  // Blender's limit
constexpr int kMaxFrequency = 99;               // of brick rows; Blender's limit
constexpr int kMaxThousandths = 1000000;        // of brick offset and squash
constexpr int kBoxProjection = 1;
constexpr int kMaxBlendPercent = 100;
constexpr int kMaxProjectionBits = (1 << 17) - 1;

/// What the static parameters of an op may be, in op_table's order.
ParameterRules parameter_rules(Op op) {
  switch (op) {
    case Op::ATTRIBUTE:
    case Op::ATTRIBUTE_FACTOR:
      return {kName, kShift};
    case Op::ATTRIBUTE_ALPHA:
      return {kName, kFlag, kShift};
    case Op::GENERATED:
    case Op::OBJECT_COORDINATE:
    case Op::NORMAL_COORDINATE:
    case Op::REFLECTION_COORDINATE:
    case Op::CAMERA_COORDINATE:
    case Op::WINDOW_COORDINATE:
    case Op::POSITION:
    case Op::CLOSURE_DISPLACED_BUMP:
      return {kShift};
    case Op::TANGENT:
    case Op::INSTANCE_VALUE:
    case Op::INSTANCE_VALUE_ALPHA:
    case Op::GRID_FACTOR:
    case Op::CLOSURE_AOV:
      return {kName};
    case Op::LIGHT_PATH:
      return {up_to(14)};
    case Op::MATH:
      return {up_to(40), kFlag};
    case Op::INTEGER_MATH:
      return {up_to(17)};
    case Op::VECTOR_MATH:
      return {up_to(25)};
    case Op::VECTOR_MATH_VALUE:
    case Op::CLOSURE_HAIR:
    case Op::CLOSURE_MICROFACET_HAIR:
      return {up_to(2)};
    case Op::MIX_FLOAT:
    case Op::MIX_VECTOR:
    case Op::CLAMP:
    case Op::CLOSURE_DIFFUSE:
    case Op::CLOSURE_DISPLACEMENT:
    case Op::CLOSURE_SHEEN:
    case Op::CLOSURE_TOON:
    case Op::CLOSURE_SIMPLE_HAIR:
    case Op::STRAND_TANGENT:
      return {kFlag};
    case Op::CLOSURE_PRINCIPLED:
      return {kFlag, kSubsurface, up_to(15), up_to(2)};
    case Op::CLOSURE_SUBSURFACE:
      return {kSubsurface};
    case Op::CLOSURE_VOLUME:
      return {kPhase};
    case Op::BUMP:
    case Op::WIREFRAME:
      return {kFlag, kShift};
    case Op::AMBIENT_OCCLUSION:
      return {kRays, kFlag, kFlag};
    case Op::BEVEL:
      return {kRays};
    case Op::RAYCAST:
      return {kFlag, kFlag, kShift};
    case Op::MIX_COLOR:
      return {up_to(18), kFlag, kFlag};
    case Op::MAP_RANGE:
      return {up_to(3), kFlag};
    case Op::CURVE_LOOKUP:
      return {ParameterRule{ParameterKind::TABLE}};
    case Op::RAMP_LOOKUP:
      return {ParameterRule{ParameterKind::TABLE}, kFlag};
    case Op::RAMP_LOOKUP_ALPHA:
      return {ParameterRule{ParameterKind::ALPHA_TABLE}, kFlag};
    case Op::MAPPING:
      return {up_to(3)};
    case Op::NORMAL_MAP:
      return {up_to(2), kName, kFlag, kFlag};
    case Op::VECTOR_TRANSFORM:
      return {up_to(2), up_to(2), up_to(2)};
    case Op::VECTOR_ROTATE:
      return {up_to(4), kFlag};
    case Op::IMAGE:
    case Op::IMAGE_ALPHA:
      return {kImage, up_to(2), up_to(3), ParameterRule{ParameterKind::PROJECTION}};
    case Op::TILED_IMAGE:
    case Op::TILED_IMAGE_ALPHA:
      return {ParameterRule{ParameterKind::TILES}, up_to(2), up_to(3), ParameterRule{ParameterKind::PROJECTION}};
    case Op::ENVIRONMENT_IMAGE:
      return {kImage, up_to(2), up_to(2)};
    case Op::SUN_DISC:
      return {kFlag};
    case Op::GRADIENT:
      return {up_to(6)};
    case Op::NOISE:
    case Op::NOISE_COLOR:
      return {kDimensions, kFlag, up_to(4)};
    case Op::VORONOI_DISTANCE:
    case Op::VORONOI_COLOR:
    case Op::VORONOI_POSITION:
      return {kDimensions, up_to(3), up_to(4), up_to(3)};
    case Op::WAVE:
      return {kFlag, up_to(3), up_to(2)};
    case Op::WHITE_NOISE:
    case Op::WHITE_NOISE_COLOR:
      return {kDimensions};
    case Op::BRICK:
    case Op::BRICK_FACTOR:
      return {range(-kMaxThousandths, kMaxThousandths), up_to(kMaxFrequency), range(-kMaxThousandths, kMaxThousandths),
              up_to(kMaxFrequency)};
    case Op::MAGIC:
      return {up_to(10), kFlag};
    case Op::GABOR:
      return {kFlag, up_to(2)};
    case Op::RADIAL_TILING:
      return {kFlag};
    case Op::RADIAL_TILING_VALUE:
      return {up_to(2)};
    case Op::CLOSURE_GLOSSY:
    case Op::CLOSURE_GLASS:
    case Op::CLOSURE_REFRACTION:
      return {kDistribution};
    case Op::CLOSURE_METALLIC:
      return {kDistribution, kFlag};
    default:
      return {};
  }
}

const char* type_name(char letter) { return letter == 'f' ? "float" : (letter == 'c' ? "colour" : "vector"); }

class Validator {
 public:
  Validator(const MaterialProgram& program, int image_count) : program_(program), image_count_(image_count) {}

  void check() {
    check_resources();
    for (index_ = 0; index_ < program_.instructions.size(); ++index_) check_instruction(program_.instructions[index_]);
  }

 private:
  const MaterialProgram& program_;
  int image_count_;
  size_t index_ = 0;
  std::array<char, kMaxRegisters> written_{};  // type letter of what a register holds, 0 = nothing yet

  [[noreturn]] void fail(const std::string& what) const { throw Error(program_.name, what); }

  [[noreturn]] void fail_here(const std::string& what) const {
    const Op op = program_.instructions[index_].op;
    const std::string name = op < Op::COUNT ? describe(op).name : "op " + std::to_string(static_cast<int>(op));
    fail("instruction " + std::to_string(index_) + " (" + name + "): " + what);
  }

  void check_resources() const {
    if (program_.register_count > kMaxRegisters)
      fail(std::to_string(program_.register_count) + " registers; at most " + std::to_string(kMaxRegisters) +
           " are allowed");
    for (size_t i = 0; i < program_.constants.size(); ++i)
      if (!is_finite(program_.constants[i])) fail("constant " + std::to_string(i) + " is not finite");
    for (size_t i = 0; i < program_.images.size(); ++i)
      if (program_.images[i] < -1 || program_.images[i] >= image_count_)
        fail("image " + std::to_string(i) + " has handle " + std::to_string(program_.images[i]) + "; there are " +
             std::to_string(image_count_) + " images (-1 = missing)");
    for (const std::vector<int>& tiles : program_.tile_tables) check_tiles(tiles);
    for (const std::vector<Vec3>& table : program_.tables)
      for (const Vec3 v : table)
        if (!is_finite(v)) fail("a table has an entry that is not finite");
    for (const std::vector<float>& table : program_.table_alphas)
      for (const float v : table)
        if (!std::isfinite(v)) fail("a table has an alpha that is not finite");
  }

  void check_tiles(const std::vector<int>& tiles) const {
    if (tiles.size() > static_cast<size_t>(kMaxTiles))
      fail(std::to_string(tiles.size()) + " tiles of an image; at most " + std::to_string(kMaxTiles) + " are allowed");
    for (const int image : tiles)
      if (image < -1 || image >= static_cast<int>(program_.images.size()))
        fail("a tile is image " + std::to_string(image) + "; the program has " +
             std::to_string(program_.images.size()) + " (-1 = missing)");
  }

  void check_instruction(const Instruction& instruction) {
    if (instruction.op >= Op::COUNT) fail_here("unknown operation");
    const OpDescription& description = describe(instruction.op);
    const std::string letters = description.inputs;
    if (instruction.input_count != letters.size())
      fail_here(std::to_string(instruction.input_count) + " inputs; it takes " + std::to_string(letters.size()));
    if (size_t{instruction.first_input} + instruction.input_count > program_.inputs.size())
      fail_here("inputs " + std::to_string(instruction.first_input) + " and up lie outside of the program's " +
                std::to_string(program_.inputs.size()));
    for (size_t i = 0; i < letters.size(); ++i) check_operand(i, letters[i]);
    check_parameters(instruction, description.parameter_count);
    if (description.is_closure) return;
    if (instruction.output >= program_.register_count)
      fail_here("writes register " + std::to_string(instruction.output) + "; the program has " +
                std::to_string(program_.register_count));
    written_[instruction.output] = description.output;
  }

  void check_operand(size_t i, char wanted) const {
    const Operand operand = program_.inputs[program_.instructions[index_].first_input + i];
    const size_t index = static_cast<size_t>(operand.index());
    const std::string where = "input " + std::to_string(i);
    if (operand.is_constant()) {
      if (index >= program_.constants.size())
        fail_here(where + " is constant " + std::to_string(index) + "; the program has " +
                  std::to_string(program_.constants.size()));
      return;
    }
    if (index >= program_.register_count)
      fail_here(where + " is register " + std::to_string(index) + "; the program has " +
                std::to_string(program_.register_count));
    const char found = written_[index];
    if (found == 0) fail_here(where + " reads register " + std::to_string(index) + " before it is written");
    if ((found == 'f') != (wanted == 'f'))
      fail_here(where + " is a " + type_name(found) + " (register " + std::to_string(index) + "); a " +
                type_name(wanted) + " is needed");
  }

  void check_parameters(const Instruction& instruction, int count) const {
    const ParameterRules rules = parameter_rules(instruction.op);
    for (int i = 0; i < count; ++i) check_parameter(i, instruction.parameters[i], rules[static_cast<size_t>(i)]);
  }

  void check_parameter(int i, int32_t value, const ParameterRule& rule) const {
    switch (rule.kind) {
      case ParameterKind::RANGE:
        return check_range(i, value, rule.lowest, rule.highest, "");
      case ParameterKind::ATTRIBUTE_NAME:
        return check_range(i, value, 0, static_cast<int>(program_.attribute_names.size()) - 1, " (attribute names)");
      case ParameterKind::IMAGE:
        return check_range(i, value, -1, static_cast<int>(program_.images.size()) - 1, " (images, -1 = missing)");
      case ParameterKind::TILES:
        return check_range(i, value, 0, static_cast<int>(program_.tile_tables.size()) - 1, " (tables of tiles)");
      case ParameterKind::TABLE:
        check_range(i, value, 0, static_cast<int>(program_.tables.size()) - 1, " (tables)");
        return check_table_size(value, program_.tables[static_cast<size_t>(value)].size());
      case ParameterKind::ALPHA_TABLE:
        check_range(i, value, 0, static_cast<int>(program_.table_alphas.size()) - 1, " (tables with alpha)");
        return check_table_size(value, program_.table_alphas[static_cast<size_t>(value)].size());
      case ParameterKind::PROJECTION: {
        check_range(i, value, 0, kMaxProjectionBits, " (projection, blend and alpha bits)");
        const int blend = (value >> 8) & 0xff;
        check_range(i, value & 0xff, 0, 3, " (projection)");
        const bool is_box = (value & 0xff) == kBoxProjection;
        return check_range(i, blend, 0, is_box ? kMaxBlendPercent : 0, " (blend of a box projection, percent)");
      }
    }
  }

  void check_range(int i, int value, int lowest, int highest, const char* what) const {
    if (value >= lowest && value <= highest) return;
    fail_here("parameter " + std::to_string(i) + " is " + std::to_string(value) + "; allowed are " +
              std::to_string(lowest) + " to " + std::to_string(highest) + what);
  }

  void check_table_size(int table, size_t size) const {
    if (size != static_cast<size_t>(kTableSize))
      fail_here("table " + std::to_string(table) + " has " + std::to_string(size) + " entries; " +
                std::to_string(kTableSize) + " are needed");
  }
};

}  // namespace

void check_program(const MaterialProgram& program, int image_count) { Validator(program, image_count).check(); }

}  // namespace cistern
