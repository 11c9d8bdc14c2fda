#include "shading/nodes_vector.h"

#include "base/frame.h"
#include "shading/fresnel.h"
#include "shading/mesh_interpolation.h"
#include "shading/nodes_input.h"
#include "shading/nodes_math.h"

namespace cistern {
namespace {

constexpr float kLeastIor = 1e-5f;  // of the Fresnel nodes, as in Blender
constexpr float kMostFacingBlend = 1.0f - 1e-5f;

/// Rows of Rz Ry Rx: Blender's XYZ Euler angles.
Transform euler_rotation(Vec3 angles) {
  const float sx = std::sin(angles.x), cx = std::cos(angles.x);
  const float sy = std::sin(angles.y), cy = std::cos(angles.y);
  const float sz = std::sin(angles.z), cz = std::cos(angles.z);
  return {{cy * cz, sy * sx * cz - cx * sz, sy * cx * cz + sx * sz},
          {cy * sz, sy * sx * sz + cx * cz, sy * cx * sz - sx * cz},
          {-sy, cy * sx, cy * cx},
          {}};
}

/// [Rodrigues' rotation formula], axis unit.
Vec3 rotate_around(Vec3 v, Vec3 axis, float angle) {
  const float c = std::cos(angle), s = std::sin(angle);
  return c * v + s * cross(axis, v) + (1.0f - c) * dot(axis, v) * axis;
}

Vec3 rotation_axis(int type, Vec3 axis) {
  switch (type) {
    case 1:
      return {1.0f, 0.0f, 0.0f};
    case 2:
      return {0.0f, 1.0f, 0.0f};
    case 3:
      return {0.0f, 0.0f, 1.0f};
    default:
      return normalize_or(axis, {});
  }
}

enum Space : int { kWorldSpace, kObjectSpace, kCameraSpace };
enum VectorKind : int { kPoint, kVector, kNormal };

/// Blender's camera space has +z forward: the mirror image of the camera's own along z.
Transform camera_space_to_world(const Camera& camera) {
  Transform m = camera.camera_to_world;
  m.row_x.z = -m.row_x.z;
  m.row_y.z = -m.row_y.z;
  m.row_z.z = -m.row_z.z;
  return m;
}

Vec3 map_vector(const Transform& m, int kind, Vec3 v) {
  if (kind == kPoint) return m.point(v);
  return kind == kVector ? m.vector(v) : normalize_or(transform_normal(m, v), v);
}

/// Linearly between both: frames of what was there before displacement are not around `ns`.
Vec3 towards(Vec3 ns, Vec3 n, float strength) {
  return normalize_or(strength == 1.0f ? n : ns + (n - ns) * std::max(strength, 0.0f), ns);
}

/// Before displacement or after it. Flat surfaces have the normal that they have now in both.
Vec3 tangent_space_normal(const NodeContext& c, int uv_name, bool is_original, Vec3 color, float strength, Vec3 ns) {
  const std::optional<TangentFrame> frame =
      tangent_frame(c.scene, c.point, find_tangent_map(c.mesh(), c.program, uv_name), is_original);
  if (!frame) return ns;
  const bool is_linear = is_original && c.mesh().undisplaced && !c.mesh().undisplaced->is_flat(c.point.triangle);
  if (!is_linear) color = {color.x * strength, color.y * strength, lerp(1.0f, color.z, clamp01(strength))};
  const Vec3 in_object = color.x * frame->tangent + color.y * frame->bitangent + color.z * frame->normal;
  const Vec3 outside = transform_normal(c.instance().object_to_world, in_object);
  const Vec3 n = normalize_or(c.point.is_backface ? -outside : outside, ns);
  return is_linear ? towards(ns, n, strength) : n;
}

}  // namespace

Vec3 mapping_node(int type, Vec3 vector, Vec3 location, Vec3 rotation, Vec3 scale) {
  const Transform r = euler_rotation(rotation);
  switch (type) {
    case 0:
      return r.vector(vector * scale) + location;
    case 1:
      return safe_divide(r.transposed_vector(vector - location), scale);
    case 2:
      return r.vector(vector * scale);
    default:
      return normalize_or(r.vector(safe_divide(vector, scale)), {});
  }
}

Vec3 vector_rotate_node(int type, bool inverts, Vec3 vector, Vec3 center, Vec3 axis, float angle, Vec3 euler) {
  const Vec3 v = vector - center;
  if (type == 4) {
    const Transform r = euler_rotation(euler);
    return (inverts ? r.transposed_vector(v) : r.vector(v)) + center;
  }
  const Vec3 unit = rotation_axis(type, axis);
  if (unit == Vec3{}) return vector;
  return rotate_around(v, unit, inverts ? -angle : angle) + center;
}

Vec3 vector_transform_node(const NodeContext& c, int kind, int from, int to, Vec3 v) {
  if (from == to) return v;
  if (from == kObjectSpace && !c.is_environment) v = map_vector(c.instance().object_to_world, kind, v);
  if (from == kCameraSpace) v = map_vector(camera_space_to_world(c.scene.material_camera()), kind, v);
  if (to == kObjectSpace && !c.is_environment) v = map_vector(inverse(c.instance().object_to_world), kind, v);
  if (to == kCameraSpace) v = map_vector(inverse(camera_space_to_world(c.scene.material_camera())), kind, v);
  return v;
}

Vec3 normal_map_node(const NodeContext& c, const int32_t* parameters, Vec3 color, float strength, Vec3 ns) {
  Vec3 n = 2.0f * color - Vec3{1.0f, 1.0f, 1.0f};
  if (parameters[2] != 0) n.y = -n.y;
  if (c.is_environment) return ns;
  if (parameters[0] == 0) return tangent_space_normal(c, parameters[1], parameters[3] != 0, n, strength, ns);
  if (parameters[0] == 1) n = transform_normal(c.instance().object_to_world, n);
  n = normalize_or(n, {});
  if (c.point.is_backface) n = -n;
  return towards(ns, n, strength);
}

Vec3 bump_node(const SurfacePoint& point, const BumpInput& in, bool inverts) {
  const float step = in.width * point.footprint;
  if (step == 0.0f) return in.normal;
  const Frame frame = bump_axes(point);
  // Surface gradient: heights differ by (dx, dy) over one step along s and t.
  const Vec3 across_s = cross(frame.t, in.normal);
  const Vec3 across_t = cross(in.normal, frame.s);
  const float determinant = dot(frame.s, across_s);
  const float dx = (in.height_dx - in.height) / step;
  const float dy = (in.height_dy - in.height) / step;
  const float scale = (inverts ? -in.distance : in.distance) * (determinant < 0.0f ? -1.0f : 1.0f);
  const Vec3 bumped =
      normalize_or(std::abs(determinant) * in.normal - scale * (dx * across_s + dy * across_t), in.normal);
  const float strength = std::max(in.strength, 0.0f);
  return normalize_or(strength * bumped + (1.0f - strength) * in.normal, in.normal);
}

float fresnel_node(const SurfacePoint& point, float ior, Vec3 normal) {
  const float n = std::max(ior, kLeastIor);
  return fresnel_dielectric(std::abs(dot(point.wo, normal)), point.is_backface ? 1.0f / n : n);
}

float layer_weight_fresnel_node(const SurfacePoint& point, float blend, Vec3 normal) {
  const float n = std::max(1.0f - blend, kLeastIor);
  return fresnel_dielectric(std::abs(dot(point.wo, normal)), point.is_backface ? n : 1.0f / n);
}

float layer_weight_facing_node(const SurfacePoint& point, float blend, Vec3 normal) {
  const float facing = std::abs(dot(point.wo, normal));
  if (blend == 0.5f) return 1.0f - facing;
  const float b = std::clamp(blend, 0.0f, kMostFacingBlend);
  return 1.0f - std::pow(facing, b < 0.5f ? 2.0f * b : 0.5f / (1.0f - b));
}

}  // namespace cistern
