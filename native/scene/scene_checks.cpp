#include "scene/scene_checks.h"

#include <cfloat>
#include <cmath>
#include <sstream>

#include "base/check.h"

namespace cistern {
namespace {

/// Volume of the unit cube's image relative to the product of its edges below which edges count as coplanar: rounding
/// of single-precision matrices leaves about 1e-7.
constexpr double kCoplanar = 1e-6;

/// Names the object once and checks its members.
struct Checker {
  const std::string& name;

  [[noreturn]] void fail(const std::string& what, float value, const char* allowed) const {
    std::ostringstream text;
    text << what << " is " << value << ": must be " << allowed;
    throw Error(name, text.str());
  }
  void finite(const char* what, float value) const {
    if (!std::isfinite(value)) fail(what, value, "finite");
  }
  void finite(const char* what, Vec3 value) const {
    for (int axis = 0; axis < 3; ++axis) finite(what, value[axis]);
  }
  void not_negative(const char* what, float value) const {
    if (!std::isfinite(value) || value < 0.0f) fail(what, value, "finite and not negative");
  }
  void positive(const char* what, float value) const {
    if (!std::isfinite(value) || value <= 0.0f) fail(what, value, "finite and greater than 0");
  }
  void direction(const char* what, Vec3 value) const {
    finite(what, value);
    if (length_squared(value) == 0.0f) fail(std::string("length of ") + what, 0.0f, "greater than 0");
  }
  void range(const char* what, float low, float high) const {
    finite(what, low);
    finite(what, high);
    if (!(low < high)) fail(std::string("size of ") + what, high - low, "greater than 0");
  }
};

void check_shape(const Checker& check, const PointLight& light) {
  check.finite("energy", to_vec(light.intensity));
  check.finite("position", light.position);
  check.not_negative("radius", light.radius);
}

void check_shape(const Checker& check, const SpotLight& light) {
  check_shape(check, light.emitter);
  check_transform(check.name, "matrix", light.world_to_local);
  check.finite("spot size", light.cos_half_angle);
  check.not_negative("spot blend", light.blend);
}

void check_shape(const Checker& check, const SunLight& light) {
  check.finite("energy", to_vec(light.irradiance));
  check.direction("direction", light.direction);
  check.not_negative("angle", light.angle);
}

void check_shape(const Checker& check, const AreaLight& light) {
  check.finite("energy", to_vec(light.radiance));
  check.finite("position", light.center);
  check.finite("size", light.edge_u);
  check.finite("size", light.edge_v);
  check.direction("normal", light.normal);
  check.not_negative("spread", light.spread);
}

}  // namespace

void check_transform(const std::string& name, const char* what, const Transform& transform) {
  const Vec3 rows[] = {transform.row_x, transform.row_y, transform.row_z};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      const float entry = j < 3 ? rows[i][j] : transform.translation[i];
      if (std::isfinite(entry)) continue;
      Checker{name}.fail(std::string(what) + " row " + std::to_string(i + 1) + " column " + std::to_string(j + 1),
                         entry, "finite");
    }
  }
}

void check_light(const Light& light) {
  const Checker check{light.name};
  std::visit([&](const auto& shape) { check_shape(check, shape); }, light.shape);
}

namespace {

void check_panorama(const Panorama& panorama, const Checker& check) {
  for (const Vec2 range : {panorama.longitude, panorama.latitude, panorama.cylinder}) {
    check.finite("start of a range of the panorama", range.x);
    check.finite("end of a range of the panorama", range.y);
  }
  check.positive("field of view", panorama.fov);
  check.positive("lens of the fisheye", panorama.lens);
  check.positive("width of the sensor", panorama.sensor.x);
  check.positive("height of the sensor", panorama.sensor.y);
  for (const float coefficient : panorama.polynomial) check.finite("polynomial of the fisheye", coefficient);
}

}  // namespace

void check_camera(const Camera& camera, const std::string& name) {
  const Checker check{name};
  check_transform(name, "matrix", camera.camera_to_world);
  if (is_singular(camera.camera_to_world)) {
    constexpr float kFarthest = 1e18f;  // metres; farther away, single precision may overflow
    const float distance = length(camera.camera_to_world.translation);
    if (!(distance < kFarthest)) check.fail("distance from the origin", distance, "less than 1e18");
    check.fail("determinant of its matrix", camera.camera_to_world.determinant(), "different from 0");
  }
  check.range("window width", camera.left, camera.right);
  check.range("window height", camera.bottom, camera.top);
  check.not_negative("clip start", camera.clip_start);
  if (!(camera.clip_end > camera.clip_start)) check.fail("clip end", camera.clip_end, "greater than clip start");
  check.not_negative("aperture radius", camera.aperture_radius);
  if (camera.aperture_radius > 0.0f) check.positive("focus distance", camera.focus_distance);
  check.finite("blade rotation", camera.blade_rotation);
  check.positive("aperture ratio", camera.aperture_ratio);
  if (camera.type == CameraType::PANORAMIC) check_panorama(camera.panorama, check);
}

bool is_singular(const Transform& transform) {
  const auto squared = [](Vec3 v) { return double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z; };
  const Vec3 x = transform.row_x, y = transform.row_y, z = transform.row_z;
  const double determinant = double{x.x} * (double{y.y} * z.z - double{y.z} * z.y) -
                             double{x.y} * (double{y.x} * z.z - double{y.z} * z.x) +
                             double{x.z} * (double{y.x} * z.y - double{y.y} * z.x);
  const double edges =
      std::sqrt(squared(transform.column(0)) * squared(transform.column(1)) * squared(transform.column(2)));
  if (!(std::abs(determinant) > kCoplanar * edges)) return true;
  // Beyond the range of single precision `inverse` would overflow.
  if (!(std::abs(transform.determinant()) >= FLT_MIN)) return true;
  const Transform back = inverse(transform);
  return !is_finite(back.row_x) || !is_finite(back.row_y) || !is_finite(back.row_z) || !is_finite(back.translation);
}

}  // namespace cistern
