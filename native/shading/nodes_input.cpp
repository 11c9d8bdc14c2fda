#include "shading/nodes_input.h"

#include "scene/panorama.h"
#include "scene/strand_curve.h"
#include "shading/mesh_interpolation.h"
#include "shading/splat_point.h"

namespace cistern {
namespace {

constexpr Vec3 kForwardZ{1.0f, 1.0f, -1.0f};  // cameras look along -z, Blender's coordinates along +z

/// Inside of a volume object; null for a name that it lacks, and for whatever is none.
const VoxelGrid* find_grid(const NodeContext& c, int name_index) {
  if (!c.is_inside || !c.mesh().volume) return nullptr;
  return c.mesh().volume->find(c.program.attribute_hashes[static_cast<size_t>(name_index)]);
}

std::array<float, 4> stored_value(const NodeContext& c, const VoxelGrid& grid) {
  return sample_grid(grid, inverse(c.instance().object_to_world).point(c.point.position)).channel;
}

/// One channel fills all three. Colours with alpha are stored multiplied by it, as in Cycles.
AttributeValue grid_value(const NodeContext& c, const VoxelGrid& grid) {
  const std::array<float, 4> v = stored_value(c, grid);
  if (grid.channels == 1) return {{v[0], v[0], v[0]}, 1.0f};
  const float scale = grid.channels == 4 && v[3] > 1e-6f && v[3] != 1.0f ? 1.0f / v[3] : 1.0f;
  return {scale * Vec3{v[0], v[1], v[2]}, v[3]};
}

/// Of a lamp there is the UV map without a name.
AttributeValue attribute_node(const NodeContext& c, int name_index, AttributeValue missing, BumpShift shift) {
  const bool is_unnamed = c.program.attribute_names[static_cast<size_t>(name_index)].empty();
  if (c.lamp != nullptr && is_unnamed) return {{c.point.barycentric.x, c.point.barycentric.y, 0.0f}, 1.0f};
  if (const VoxelGrid* const grid = find_grid(c, name_index)) return grid_value(c, *grid);
  const int index = resolve_attribute(c, name_index);
  if (index < 0) return reads_splat_radiance(c, name_index) ? AttributeValue{splat_radiance(c), 1.0f} : missing;
  return interpolate_attribute(c.mesh(), c.point.triangle, shifted_barycentric(c.scene, c.point, shift), index);
}

/// Of two numbers the first, of a grid the mean of its colour as it is stored, else the mean of three: those of one are
/// the same.
float attribute_factor(const NodeContext& c, int name_index, BumpShift shift) {
  if (const VoxelGrid* const grid = find_grid(c, name_index)) {
    const std::array<float, 4> v = stored_value(c, *grid);
    return grid->channels == 1 ? v[0] : (v[0] + v[1] + v[2]) * (1.0f / 3.0f);
  }
  const Vec3 value = attribute_node(c, name_index, {}, shift).value;
  const int index = resolve_attribute(c, name_index);
  const bool is_pair = index >= 0 && c.mesh().attributes[static_cast<size_t>(index)].components == 2;
  return is_pair ? value.x : (value.x + value.y + value.z) * (1.0f / 3.0f);
}

/// Balls and splats, which have no place on a curve.
bool is_point(const NodeContext& c) {
  return c.has_mesh() && (c.mesh().strand_shape == StrandShape::BALLS || c.mesh().splats);
}

Vec3 object_position(const NodeContext& c, BumpShift shift) {
  if (is_point(c))
    return inverse(c.instance().object_to_world).point(c.point.position + footprint_step(c.point, shift));
  if (!c.has_mesh()) return inverse(c.instance().object_to_world).point(c.point.position);
  return interpolate_position(c.shape(), c.point.triangle, shifted_barycentric(c.scene, c.point, shift));
}

/// Moves with the position, unlike attributes, which `shifted_barycentric` reverses on back faces.
Vec3 object_coordinate_node(const NodeContext& c, BumpShift shift) {
  const Vec3 p = object_position(c, {});
  return shift.step == 0 ? p : p + inverse(c.instance().object_to_world).vector(footprint_step(c.point, shift));
}

/// Before displacement, in object space; inside of a mesh there is no such place.
Vec3 original_position(const NodeContext& c, BumpShift shift) {
  if (c.is_inside) return object_position(c, shift);
  return interpolate_position(c.mesh().original(), c.point.triangle, shifted_barycentric(c.scene, c.point, shift));
}

/// Those of the mesh, or its bounds to [0, 1]; an axis without extent is 1/2, as with Blender's texture space. Of a
/// lamp and a point, as in Cycles, object coordinates.
Vec3 generated_node(const NodeContext& c, BumpShift shift) {
  if (c.is_environment) return c.point.position;
  if ((!c.has_mesh() && !c.is_inside) || is_point(c)) return object_position(c, shift);
  if (const int own = c.mesh().generated_attribute; own >= 0 && !c.is_inside)
    return interpolate_attribute(c.mesh(), c.point.triangle, shifted_barycentric(c.scene, c.point, shift), own).value;
  const std::optional<Bounds3>& inside = c.mesh().texture_space;
  const Bounds3& bounds = c.is_inside && inside ? *inside : c.mesh().generated_bounds();
  const Vec3 p = original_position(c, shift) - bounds.lower;
  const Vec3 size = bounds.diagonal();
  const auto map = [](float x, float extent) { return extent > 0.0f ? x / extent : 0.5f; };
  return {map(p.x, size.x), map(p.y, size.y), map(p.z, size.z)};
}

Vec3 normal_coordinate_node(const NodeContext& c, BumpShift shift) {
  if (c.is_environment) return c.point.ns;
  if (shift.step == 0 || !c.has_mesh())
    return normalize_or(c.instance().object_to_world.transposed_vector(c.point.ns), c.point.ns);
  const Vec3 n = interpolate_normal(c.mesh(), c.point.triangle, shifted_barycentric(c.scene, c.point, shift));
  return c.point.is_backface ? -n : n;
}

Vec3 shifted_position(const NodeContext& c, BumpShift shift) {
  return c.point.position + footprint_step(c.point, shift);
}

Vec3 camera_node(const NodeContext& c, BumpShift shift) {
  if (!c.is_environment) return to_camera_space(c.scene.material_camera(), shifted_position(c, shift));
  return kForwardZ * inverse(c.scene.material_camera().camera_to_world).vector(c.point.position);
}

/// [Cycles] Of panoramas the place in their frame, wherever a viewport has that.
Vec3 window_node(const NodeContext& c, BumpShift shift) {
  const Camera& camera = c.scene.material_camera();
  const Vec3 p = camera_node(c, shift);
  const CameraType type = camera.type == CameraType::SHEET ? camera.eye_type : camera.type;
  if (type == CameraType::PANORAMIC) {
    const Vec2 place = panorama_position(camera.panorama, normalize(p * kForwardZ)).value_or(Vec2{});
    return {place.x, place.y, 0.0f};
  }
  const float depth = type == CameraType::PERSPECTIVE ? p.z : 1.0f;
  if (depth == 0.0f) return {};
  return {(p.x / depth - camera.left) / (camera.right - camera.left),
          (p.y / depth - camera.bottom) / (camera.top - camera.bottom), 0.0f};
}

/// Unit, in world space; orthogonal to the shading normal but under uneven scale.
Vec3 tangent_node(const NodeContext& c, int name_index) {
  if (!c.has_mesh()) return {};
  const std::optional<TangentFrame> frame =
      tangent_frame(c.scene, c.point, find_tangent_map(c.mesh(), c.program, name_index));
  return frame ? normalize_or(transform_normal(c.instance().object_to_world, frame->tangent), {}) : Vec3{};
}

/// Unit, in world space.
Vec3 strand_tangent_node(const NodeContext& c, bool to_last_corner) {
  if (!c.has_mesh()) return {};
  const Mesh& mesh = c.mesh();
  Vec3 along;
  if (mesh.is_strands()) {
    along = strand_segment(mesh, c.point.triangle).direction(c.point.barycentric.x);
  } else {
    const std::array<Vec3, 3> corners = mesh.triangle_positions(c.point.triangle);
    along = corners[to_last_corner ? 2 : 1] - corners[0];
  }
  return normalize_or(c.instance().object_to_world.vector(along), Frame(c.point.ng).s);
}

/// Lamps and the sky have none.
const float* instance_value(const NodeContext& c, int name_index) {
  if ((!c.has_mesh() && !c.is_inside) || !c.scene.instance_values) return nullptr;
  return c.scene.instance_values->find(c.instance().values,
                                       c.program.attribute_hashes[static_cast<size_t>(name_index)]);
}

Vec3 instance_value_node(const NodeContext& c, int name_index) {
  const float* value = instance_value(c, name_index);
  return value != nullptr ? Vec3{value[0], value[1], value[2]} : Vec3{};
}

float instance_value_alpha_node(const NodeContext& c, int name_index) {
  const float* value = instance_value(c, name_index);
  return value != nullptr ? value[3] : 0.0f;
}

/// Width of a pixel at the point, seen from where the ray came: the mean of two directions of the surface.
float seen_footprint(const SurfacePoint& point) {
  const Frame axes = bump_axes(point);
  const auto seen = [&](Vec3 axis) { return length(axis - dot(axis, point.wo) * point.wo); };
  return 0.5f * point.footprint * (seen(axes.s) + seen(axes.t));
}

Vec3 as_register(float value) { return {value, value, value}; }

}  // namespace

float wireframe_node(const NodeContext& c, float width, bool is_in_pixels, BumpShift shift) {
  if (!c.has_mesh() || c.mesh().is_strands()) return 0.0f;
  const float half_width = 0.5f * width * (is_in_pixels ? seen_footprint(c.point) : 1.0f);
  const std::array<Vec3, 3> corners = c.mesh().triangle_positions(c.point.triangle);
  const Transform& to_world = c.instance().object_to_world;
  const Vec3 p = shifted_position(c, shift);
  for (size_t i = 0; i < 3; ++i) {
    const Vec3 corner = to_world.point(corners[i]);
    const Vec3 edge = normalize_or(to_world.vector(corners[(i + 1) % 3] - corners[i]), {});
    const Vec3 off = cross(edge, p - corner);
    if (dot(off, off) < half_width * half_width) return 1.0f;
  }
  return 0.0f;
}

int resolve_attribute(const NodeContext& c, int name_index) {
  return c.has_mesh() ? find_attribute(c.mesh(), c.program, name_index) : -1;
}

Vec3 to_camera_space(const Camera& camera, Vec3 world_point) {
  return kForwardZ * inverse(camera.camera_to_world).point(world_point);
}

Vec3 input_node(const Instruction& instruction, const NodeContext& c) {
  const int32_t* parameters = instruction.parameters;
  switch (instruction.op) {
    case Op::ATTRIBUTE:
      return attribute_node(c, parameters[0], {}, unpack_bump_shift(parameters[1])).value;
    case Op::ATTRIBUTE_FACTOR:
      return as_register(attribute_factor(c, parameters[0], unpack_bump_shift(parameters[1])));
    case Op::ATTRIBUTE_ALPHA:
      return as_register(
          attribute_node(c, parameters[0], {{}, static_cast<float>(parameters[1])}, unpack_bump_shift(parameters[2]))
              .alpha);
    case Op::GENERATED:
      return generated_node(c, unpack_bump_shift(parameters[0]));
    case Op::OBJECT_COORDINATE:
      return c.is_environment ? c.point.position : object_coordinate_node(c, unpack_bump_shift(parameters[0]));
    case Op::NORMAL_COORDINATE:
      return normal_coordinate_node(c, unpack_bump_shift(parameters[0]));
    case Op::REFLECTION_COORDINATE:
      return c.is_environment ? c.point.wo : reflect(c.point.wo, c.point.ns);
    case Op::CAMERA_COORDINATE:
      return camera_node(c, unpack_bump_shift(parameters[0]));
    case Op::WINDOW_COORDINATE:
      return window_node(c, unpack_bump_shift(parameters[0]));
    case Op::POSITION:
      return shifted_position(c, unpack_bump_shift(parameters[0]));
    case Op::NORMAL:
      return c.point.ns;
    case Op::TRUE_NORMAL:
      return c.point.ng;
    case Op::TANGENT:
      return tangent_node(c, parameters[0]);
    case Op::STRAND_TANGENT:
      return strand_tangent_node(c, parameters[0] != 0);
    case Op::INCOMING:
      return c.point.wo;
    case Op::BACKFACING:
      return as_register(c.point.is_backface ? 1.0f : 0.0f);
    case Op::OBJECT_RANDOM:
      return as_register(c.is_environment ? 0.0f : c.instance().random);
    case Op::OBJECT_LOCATION:
      return c.is_environment ? Vec3{} : c.instance().object_to_world.translation;
    case Op::INSTANCE_VALUE:
      return instance_value_node(c, parameters[0]);
    case Op::GRID_FACTOR: {
      const VoxelGrid* const grid = find_grid(c, parameters[0]);
      return grid ? grid_value(c, *grid).value : as_register(1.0f);
    }
    default:  // Op::INSTANCE_VALUE_ALPHA
      return as_register(instance_value_alpha_node(c, parameters[0]));
  }
}

float light_path_node(int output, const PathState& path) {
  const auto is_kind = [&path](int bits) { return (path.ray_kind & bits) != 0 ? 1.0f : 0.0f; };
  switch (output) {
    case 0:
      return is_kind(kVisibleToCamera);
    case 1:
      return is_kind(kVisibleToShadow);
    case 2:
      return is_kind(kVisibleToDiffuse | kVisibleToTranslucent);
    case 3:
      return is_kind(kVisibleToGlossy | kVisibleToTransmission);
    case 4:
      return path.is_singular ? 1.0f : 0.0f;
    case 5:
      return is_kind(kVisibleToReflected);
    case 6:
      return is_kind(kVisibleToTransmitted);
    case 7:
      return path.ray_length;
    case 8:
      return static_cast<float>(path.depth);
    case 9:
      return static_cast<float>(path.diffuse_depth);
    case 10:
      return static_cast<float>(path.glossy_depth);
    case 11:
      return static_cast<float>(path.transparent_depth);
    case 12:
      return static_cast<float>(path.transmission_depth);
    case 13:
      return is_kind(kVisibleToVolume);
    default:
      return static_cast<float>(path.portal_depth);
  }
}

}  // namespace cistern
