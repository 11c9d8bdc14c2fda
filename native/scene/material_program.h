#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/vec.h"

namespace cistern {

/// Type of a register. All three are stored in a Vec3; a float uses x.
enum class ValueType : uint8_t { FLOAT, COLOR, VECTOR };

/// Instructions of a material program. What each reads, writes and means stands in op_table.cpp,
/// the one place that knows; the add-on finds them by name through the binding.
// clang-format off
enum class Op : uint8_t {
  // Coordinates and geometry. `shift` = step + 4 * 1000 * filter width (for Bump). Step 0, 1, 2: at the
  // point, beside it along dP/dx, along dP/dy. Filter width: distance in pixels, in steps of 1/1000.
  ATTRIBUTE, ATTRIBUTE_FACTOR, ATTRIBUTE_ALPHA, GENERATED, OBJECT_COORDINATE, NORMAL_COORDINATE,
  REFLECTION_COORDINATE, CAMERA_COORDINATE, WINDOW_COORDINATE,
  POSITION, NORMAL, TRUE_NORMAL, TANGENT, STRAND_TANGENT, INCOMING, BACKFACING, OBJECT_RANDOM, OBJECT_LOCATION,
  INSTANCE_VALUE, INSTANCE_VALUE_ALPHA, GRID_FACTOR,
  // Path state.
  LIGHT_PATH,
  // Conversions.
  BROADCAST, LUMINANCE, AVERAGE, ENCODE_COLOR,
  // Arithmetic.
  MATH, INTEGER_MATH, VECTOR_MATH, VECTOR_MATH_VALUE, MIX_FLOAT, MIX_VECTOR, MIX_COLOR, CLAMP, MAP_RANGE,
  COMBINE_XYZ, SEPARATE_X, SEPARATE_Y, SEPARATE_Z,
  // Colour.
  INVERT, GAMMA, BRIGHT_CONTRAST, HUE_SATURATION, RGB_TO_HSV, HSV_TO_RGB, RGB_TO_HSL, HSL_TO_RGB,
  BLACKBODY, WAVELENGTH, CURVE_LOOKUP, RAMP_LOOKUP, RAMP_LOOKUP_ALPHA,
  // Vectors.
  MAPPING, NORMAL_MAP, BUMP, VECTOR_TRANSFORM, VECTOR_ROTATE,
  // Shading helpers.
  FRESNEL, LAYER_WEIGHT_FRESNEL, LAYER_WEIGHT_FACING, WIREFRAME, AMBIENT_OCCLUSION, BEVEL, RAYCAST,
  // Textures.
  IMAGE, IMAGE_ALPHA, TILED_IMAGE, TILED_IMAGE_ALPHA, ENVIRONMENT_IMAGE, SUN_DISC, CHECKER, CHECKER_FACTOR, GRADIENT, NOISE,
  NOISE_COLOR, VORONOI_DISTANCE, VORONOI_COLOR, VORONOI_POSITION, WAVE, WHITE_NOISE, WHITE_NOISE_COLOR, BRICK, BRICK_FACTOR, MAGIC,
  GABOR, RADIAL_TILING, RADIAL_TILING_VALUE,
  // Closures: first input is the weight (float), no output.
  CLOSURE_PRINCIPLED, CLOSURE_DIFFUSE, CLOSURE_GLOSSY, CLOSURE_GLASS, CLOSURE_REFRACTION, CLOSURE_TRANSLUCENT,
  CLOSURE_TRANSPARENT, CLOSURE_EMISSION, CLOSURE_SHEEN, CLOSURE_METALLIC, CLOSURE_SUBSURFACE, CLOSURE_TOON, CLOSURE_HAIR,
  CLOSURE_MICROFACET_HAIR, CLOSURE_SIMPLE_HAIR, CLOSURE_HOLDOUT, CLOSURE_RAY_PORTAL,
  // No shader, but no value either: the normal that displacement bends, for the closures after it.
  CLOSURE_NORMAL,
  // Nor this one: what goes to passes of its own.
  CLOSURE_AOV,
  // Of the medium inside a surface, or of the world's.
  CLOSURE_VOLUME, CLOSURE_VOLUME_EMISSION,
  // How far the vertices of meshes are moved, and heights that bend the shading normal of the moved surface.
  CLOSURE_DISPLACEMENT, CLOSURE_DISPLACED_BUMP,
  COUNT
};
// clang-format on

/// A value an instruction reads: a register, or with the top bit set a constant.
struct Operand {
  uint16_t code = 0;
  static constexpr uint16_t kConstantBit = 0x8000;
  bool is_constant() const { return (code & kConstantBit) != 0; }
  int index() const { return code & (kConstantBit - 1); }
  friend bool operator==(Operand, Operand) = default;
};

struct Instruction {
  Op op{};
  uint8_t input_count = 0;
  uint16_t output = 0;       // register written; unused by closures
  uint32_t first_input = 0;  // into MaterialProgram::inputs
  /// Static parameters by position, as `op_table` lists them: enum values, image and table indices, flags, shift.
  int32_t parameters[4] = {0, 0, 0, 0};
  uint32_t register_inputs = 0;  // derived by `finish_program`: bit i is set where input i is a register
  friend bool operator==(const Instruction&, const Instruction&) = default;
};

/// A UV map whose tangents a program reads.
struct TangentUse {
  int32_t name = 0;             // index into MaterialProgram::attribute_names
  bool is_of_original = false;  // as before displacement
  friend bool operator==(TangentUse, TangentUse) = default;
};

/// A node tree flattened to instructions on registers. Constants are folded by the exporter, so that most
/// materials are one closure with constant operands.
struct MaterialProgram {
  std::string name;
  float pass_index = 0.0f;
  std::vector<Instruction> instructions;
  std::vector<Operand> inputs;
  std::vector<Vec3> constants;
  std::vector<std::string>
      attribute_names;  // parameter 0 of ATTRIBUTE..., INSTANCE_VALUE, GRID_FACTOR; "" = the first UV map
  std::vector<std::vector<Vec3>> tables;         // ramps and curves: 257 samples over [0, 1]
  std::vector<std::vector<float>> table_alphas;  // alpha of ramps, beside `tables`
  std::vector<int> images;                       // image handles used; IMAGE's parameter 0 indexes this
  /// TILED_IMAGE's parameter 0 indexes this: for each tile from 1001 on (UDIM, ten to a row) one of `images`, -1 where
  /// there is none.
  std::vector<std::vector<int>> tile_tables;
  bool is_boundary = false;            // there is no surface, only what is inside: crossing it is no transparent bounce
  bool has_transparent_shadow = true;  // or light samples find no light past it; what has a volume always has one
  /// Whether bent normals are corrected: specular ones bent back, as far as they reflect light below the surface, and
  /// the terminator of diffuse ones softened.
  bool corrects_bumps = true;
  uint16_t register_count = 0;

  // Derived by `finish_program`.
  /// Beside `inputs`: the constants where they are read, so that closures need not gather them at every hit.
  std::vector<Vec3> input_values;
  std::vector<uint32_t> attribute_hashes;  // attribute_name_hash of attribute_names
  std::vector<TangentUse> tangents;        // of all instructions, without repetition
  /// The instructions that emission (transparency) depends on, in order; operands without influence are constant 0.
  std::vector<Instruction> emission_instructions, transparency_instructions;  // the second with those of ray portals
  std::vector<Instruction> aov_instructions;  // that passes of its own depend on; `instructions` is then without them
  std::vector<Instruction> volume_instructions;          // the same of media
  std::vector<Instruction> displacement_instructions;    // the same of moved vertices; its closure is the last
  std::vector<Instruction> displaced_bump_instructions;  // the same of that normal
  float matte = 0.0f;                                    // matte_id of the name
  bool volume_shines = false;
  bool volume_varies = false;        // from place to place inside
  bool has_subsurface = false;       // light may wander below the surface
  bool looks_at_own_object = false;  // nodes trace rays that meet nothing else
  bool has_volume = false;           // light is absorbed, scattered or emitted inside
  bool may_be_transparent = false;   // a shadow ray may pass: has transparent / alpha closures
  /// Has lobes that refract without any roughness, the same whatever the path: see transport/clear_panes.h.
  bool may_be_pane = false;
  bool disperses = false;  // refracts light by its wavelength
  bool may_emit = false;
  bool emission_is_constant = false;  // no emission operand depends on the hit: `constant_emission` is exact
  Vec3 constant_emission;
  bool emission_is_uniform = false;  // the same all over a side of an object, in all directions
  bool needs_footprint = false;      // has BUMP
  bool reads_light_path = false;
  bool tells_scattered_rays = false;  // reads more from it than whether the ray comes from the camera
  bool counts_bounces = false;        // reads from it how often the path has bounced
  bool depends_on_view = false;       // weights of lobes may depend on where the surface is seen from
  /// Which lobes there are, or which directions they scatter to, may depend on it too; on more than the side that is
  /// seen.
  bool lobes_depend_on_view = false;
  bool reads_camera = false;  // shades by the camera's place, not just by where light goes

  /// Whether vertices of meshes are moved.
  bool displaces() const { return !displacement_instructions.empty(); }
  /// Whether they are and normals stay what they were, because displacement bends them too.
  bool keeps_normals() const { return displaces() && displacement_instructions.back().parameters[0] != 0; }

  friend bool operator==(const MaterialProgram&, const MaterialProgram&) = default;
};

struct OpDescription {
  const char* name;
  const char* inputs;  // one letter per input: f float, c colour, v vector
  char output;         // f, c, v, or 0 for closures
  int parameter_count;
  bool is_closure;
};

/// What `op` reads and writes. Total: every Op has an entry.
const OpDescription& describe(Op op);
/// The op called `name`; throws Error naming `program_name` if there is none.
Op find_op(const std::string& name, const std::string& program_name);

/// Checks registers, types, operand counts, images and tables and fills the derived members.
/// Throws Error naming the program, the instruction and the value. `image_count` bounds the image handles.
void finish_program(MaterialProgram& program, int image_count);

inline constexpr int kMaxRegisters = 256;
inline constexpr int kTableSize = 257;
inline constexpr int kTilesInRow = 10;  // of a UDIM grid
inline constexpr int kMaxTiles = 1000;  // numbers 1001 to 2000

}  // namespace cistern
