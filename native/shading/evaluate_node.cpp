#include "shading/evaluate_node.h"

#include "shading/nodes_color.h"
#include "shading/nodes_gabor.h"
#include "shading/nodes_image.h"
#include "shading/nodes_input.h"
#include "shading/nodes_math.h"
#include "shading/nodes_noise.h"
#include "shading/nodes_pattern.h"
#include "shading/nodes_radial_tiling.h"
#include "shading/nodes_rays.h"
#include "shading/nodes_sky.h"
#include "shading/nodes_vector.h"
#include "shading/nodes_voronoi.h"

// One function per family takes the operands apart; the mathematics is in nodes_*.cpp.

namespace cistern {
namespace {

Vec3 broadcast(float v) { return {v, v, v}; }

Vec3 clamped_factor(Vec3 factor, bool clamps) {
  return clamps ? Vec3{clamp01(factor.x), clamp01(factor.y), clamp01(factor.z)} : factor;
}

Vec3 mix(Vec3 factor, Vec3 a, Vec3 b) { return a * (Vec3{1.0f, 1.0f, 1.0f} - factor) + b * factor; }

Vec3 evaluate_mix_color(const int32_t* parameters, const Vec3* in) {
  const float factor = parameters[1] != 0 ? clamp01(in[0].x) : in[0].x;
  return clamped_factor(mix_color_node(parameters[0], factor, in[1], in[2]), parameters[2] != 0);
}

Vec3 evaluate_arithmetic(const Instruction& instruction, const Vec3* in) {
  const int32_t* p = instruction.parameters;
  switch (instruction.op) {
    case Op::BROADCAST:
      return broadcast(in[0].x);
    case Op::LUMINANCE:
      return broadcast(luminance(to_rgb(in[0])));
    case Op::AVERAGE:
      return broadcast(average(to_rgb(in[0])));
    case Op::MATH: {
      const float v = math_node(p[0], in[0].x, in[1].x, in[2].x);
      return broadcast(p[1] != 0 ? clamp01(v) : v);
    }
    case Op::INTEGER_MATH:
      return broadcast(integer_math_node(p[0], in[0].x, in[1].x, in[2].x));
    case Op::VECTOR_MATH:
      return vector_math_node(p[0], in[0], in[1], in[2], in[3].x);
    case Op::VECTOR_MATH_VALUE:
      return broadcast(vector_math_value_node(p[0], in[0], in[1]));
    case Op::MIX_FLOAT:
      return mix(clamped_factor(broadcast(in[0].x), p[0] != 0), broadcast(in[1].x), broadcast(in[2].x));
    case Op::MIX_VECTOR:
      return mix(clamped_factor(in[0], p[0] != 0), in[1], in[2]);
    case Op::MIX_COLOR:
      return evaluate_mix_color(p, in);
    case Op::CLAMP:
      return broadcast(clamp_node(in[0].x, in[1].x, in[2].x, p[0]));
    case Op::MAP_RANGE:
      return broadcast(map_range_node({in[0].x, in[1].x, in[2].x, in[3].x, in[4].x, in[5].x}, p[0], p[1] != 0));
    case Op::COMBINE_XYZ:
      return {in[0].x, in[1].x, in[2].x};
    case Op::SEPARATE_X:
      return broadcast(in[0].x);
    case Op::SEPARATE_Y:
      return broadcast(in[0].y);
    case Op::SEPARATE_Z:
      return broadcast(in[0].z);
    default:  // ENCODE_COLOR
      return in[0];
  }
}

Vec3 evaluate_color(const Instruction& instruction, const Vec3* in, const MaterialProgram& program) {
  const int32_t* p = instruction.parameters;
  switch (instruction.op) {
    case Op::INVERT:
      return invert_node(in[0].x, in[1]);
    case Op::GAMMA:
      return gamma_node(in[0], in[1].x);
    case Op::BRIGHT_CONTRAST:
      return bright_contrast_node(in[0], in[1].x, in[2].x);
    case Op::HUE_SATURATION:
      return hue_saturation_node(in[0], in[1].x, in[2].x, in[3].x, in[4].x);
    case Op::RGB_TO_HSV:
      return rgb_to_hsv(in[0]);
    case Op::HSV_TO_RGB:
      return hsv_to_rgb(in[0]);
    case Op::RGB_TO_HSL:
      return rgb_to_hsl(in[0]);
    case Op::HSL_TO_RGB:
      return hsl_to_rgb(in[0]);
    case Op::BLACKBODY:
      return blackbody_node(in[0].x);
    case Op::WAVELENGTH:
      return wavelength_node(in[0].x);
    case Op::CURVE_LOOKUP:
      return curve_lookup_node(program.tables[static_cast<size_t>(p[0])], in[0].x, in[1], in[2].x, in[3].x);
    case Op::RAMP_LOOKUP:
      return ramp_lookup(std::span<const Vec3>(program.tables[static_cast<size_t>(p[0])]), in[0].x, p[1] != 0);
    default:  // RAMP_LOOKUP_ALPHA
      return broadcast(
          ramp_lookup(std::span<const float>(program.table_alphas[static_cast<size_t>(p[0])]), in[0].x, p[1] != 0));
  }
}

Vec3 evaluate_vector(const Instruction& instruction, const Vec3* in, const NodeContext& c) {
  const int32_t* p = instruction.parameters;
  switch (instruction.op) {
    case Op::MAPPING:
      return mapping_node(p[0], in[0], in[1], in[2], in[3]);
    case Op::NORMAL_MAP:
      return normal_map_node(c, p, in[0], in[1].x, in[2]);
    case Op::BUMP:
      return bump_node(c.point, {in[0].x, in[1].x, in[2].x, in[3].x, in[4].x, in[5], unpack_bump_shift(p[1]).width},
                       p[0] != 0);
    case Op::VECTOR_TRANSFORM:
      return vector_transform_node(c, p[0], p[1], p[2], in[0]);
    case Op::VECTOR_ROTATE:
      return vector_rotate_node(p[0], p[1] != 0, in[0], in[1], in[2], in[3].x, in[4]);
    case Op::FRESNEL:
      return broadcast(fresnel_node(c.point, in[0].x, in[1]));
    case Op::LAYER_WEIGHT_FRESNEL:
      return broadcast(layer_weight_fresnel_node(c.point, in[0].x, in[1]));
    case Op::LAYER_WEIGHT_FACING:
      return broadcast(layer_weight_facing_node(c.point, in[0].x, in[1]));
    case Op::WIREFRAME:
      return broadcast(wireframe_node(c, in[0].x, p[0] != 0, unpack_bump_shift(p[1])));
    case Op::AMBIENT_OCCLUSION:
      return broadcast(ambient_occlusion_node(c, {p[0], p[1] != 0, p[2] != 0}, in[0].x, in[1]));
    case Op::BEVEL:
      return bevel_node(c, p[0], in[0].x, in[1]);
    default:  // RAYCAST
      return raycast_node(c, p[0] != 0, {in[0], in[1], in[2].x, p[1] != 0, unpack_bump_shift(p[2])});
  }
}

NoiseSettings noise_settings(const int32_t* p, const Vec3* in) {
  return {in[3].x, in[4].x, in[5].x, in[6].x, in[7].x, in[8].x, static_cast<NoiseType>(p[2]), p[1] != 0};
}

Vec3 evaluate_voronoi(const Instruction& instruction, const Vec3* in) {
  const int32_t* p = instruction.parameters;
  const float scale = in[2].x;
  const VoronoiSettings settings{static_cast<VoronoiFeature>(p[2]),
                                 static_cast<VoronoiMetric>(p[1]),
                                 in[3].x,
                                 in[4].x,
                                 in[5].x,
                                 in[6].x,
                                 in[7].x,
                                 in[8].x,
                                 (p[3] & 1) != 0,
                                 (p[3] & 2) != 0};
  const VoronoiResult r = voronoi_node(in[0] * scale, in[1].x * scale, p[0], settings);
  if (instruction.op == Op::VORONOI_DISTANCE) return broadcast(r.distance);
  if (instruction.op == Op::VORONOI_COLOR) return r.color;
  return safe_divide(r.position, broadcast(scale));
}

float evaluate_gabor(const int32_t* p, const Vec3* in) {
  const GaborResult r = gabor_node(in[0] * in[1].x, p[0] == 0 ? 2 : 3, {in[2].x, in[3].x, in[4].x, in[5]});
  return p[1] == 0 ? r.value : (p[1] == 1 ? r.phase : r.intensity);
}

Vec3 evaluate_radial_tiling(const Instruction& instruction, const Vec3* in) {
  const bool is_value = instruction.op == Op::RADIAL_TILING_VALUE;
  const int32_t setting = instruction.parameters[0];
  const RadialTilingResult r = radial_tiling_node(in[0].x, in[0].y, {in[1].x, in[2].x, !is_value && setting != 0});
  if (!is_value) return {r.along, r.across, 0.0f};
  return broadcast(setting == 0 ? r.segment : (setting == 1 ? r.width : r.rotation));
}

Vec3 evaluate_brick(const Instruction& instruction, const Vec3* in) {
  const int32_t* p = instruction.parameters;
  BrickSettings s;
  s.mortar_size = in[5].x;
  s.mortar_smooth = in[6].x;
  s.bias = in[7].x;
  s.brick_width = in[8].x;
  s.row_height = in[9].x;
  s.offset = 0.001f * static_cast<float>(p[0]);
  s.offset_frequency = p[1];
  s.squash = 0.001f * static_cast<float>(p[2]);
  s.squash_frequency = p[3];
  const BrickResult r = brick_node(in[0] * in[4].x, s);
  if (instruction.op == Op::BRICK_FACTOR) return broadcast(r.mortar);
  return lerp(lerp(in[1], in[2], r.tint), in[3], r.mortar);
}

Vec3 evaluate_texture(const Instruction& instruction, const Vec3* in, const NodeContext& c) {
  const int32_t* p = instruction.parameters;
  switch (instruction.op) {
    case Op::IMAGE:
      return to_vec(image_node(c, p, in[0], in[1]).color);
    case Op::IMAGE_ALPHA:
      return broadcast(image_node(c, p, in[0], in[1]).alpha);
    case Op::TILED_IMAGE:
      return to_vec(tiled_image_node(c, p, in[0], in[1]).color);
    case Op::TILED_IMAGE_ALPHA:
      return broadcast(tiled_image_node(c, p, in[0], in[1]).alpha);
    case Op::ENVIRONMENT_IMAGE:
      return to_vec(environment_image_node(c, p, in[0]).color);
    case Op::SUN_DISC:
      return sun_disc_node({.direction = in[2],
                            .half_angle = in[3].x,
                            .bottom = in[4],
                            .top = in[5],
                            .bottom_elevation = in[3].y,
                            .top_elevation = in[3].z,
                            .horizon = in[6].x},
                           in[0], in[1], p[0] != 0);
    case Op::CHECKER:
      return checker_node(in[0] * in[3].x) ? in[1] : in[2];
    case Op::CHECKER_FACTOR:
      return broadcast(checker_node(in[0] * in[1].x) ? 1.0f : 0.0f);
    case Op::GRADIENT:
      return broadcast(gradient_node(in[0], p[0]));
    case Op::NOISE:
      return broadcast(noise_node(in[0] * in[2].x, in[1].x * in[2].x, p[0], noise_settings(p, in)));
    case Op::NOISE_COLOR:
      return noise_color_node(in[0] * in[2].x, in[1].x * in[2].x, p[0], noise_settings(p, in));
    case Op::VORONOI_DISTANCE:
    case Op::VORONOI_COLOR:
    case Op::VORONOI_POSITION:
      return evaluate_voronoi(instruction, in);
    case Op::WAVE:
      return broadcast(wave_node(in[0] * in[1].x, {p[0], p[1], p[2], in[2].x, in[3].x, in[4].x, in[5].x, in[6].x}));
    case Op::WHITE_NOISE:
      return broadcast(white_noise_node(in[0], in[1].x, p[0]));
    case Op::WHITE_NOISE_COLOR:
      return white_noise_color_node(in[0], in[1].x, p[0]);
    case Op::BRICK:
    case Op::BRICK_FACTOR:
      return evaluate_brick(instruction, in);
    case Op::MAGIC:
      return magic_node(in[0], in[1].x, in[2].x, p[0], p[1] != 0);
    case Op::GABOR:
      return broadcast(evaluate_gabor(p, in));
    default:  // RADIAL_TILING and RADIAL_TILING_VALUE
      return evaluate_radial_tiling(instruction, in);
  }
}

}  // namespace

Vec3 evaluate_node(const Instruction& instruction, const Vec3* in, const NodeContext& context) {
  const Op op = instruction.op;
  if (op < Op::LIGHT_PATH) return input_node(instruction, context);
  if (op == Op::LIGHT_PATH) return broadcast(light_path_node(instruction.parameters[0], context.path));
  if (op < Op::INVERT) return evaluate_arithmetic(instruction, in);
  if (op < Op::MAPPING) return evaluate_color(instruction, in, context.program);
  if (op < Op::IMAGE) return evaluate_vector(instruction, in, context);
  return evaluate_texture(instruction, in, context);
}

}  // namespace cistern
