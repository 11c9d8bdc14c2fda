#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <map>

#include "base/murmur_hash.h"
#include "base/stop_poll.h"
#include "binding/arrays.h"
#include "binding/bind.h"
#include "binding/scene_handle.h"
#include "binding/subdivision_arrays.h"
#include "scene/scene_builder.h"
#include "scene/shadow_catchers.h"
#include "shading/displaced_scene.h"

namespace cistern::binding {
namespace {

using Color = std::array<float, 3>;

/// By kind and size: equal dtypes need not be one object, as those of unpickled arrays are not.
PixelFormat to_pixel_format(const py::array& pixels, const std::string& owner) {
  const py::dtype dtype = pixels.dtype();
  if (!dtype.attr("isnative").cast<bool>()) throw Error(owner, "pixels must have the byte order of this machine");
  const char kind = dtype.kind();
  const py::ssize_t bytes = dtype.itemsize();
  if (kind == 'u' && bytes == 1) return PixelFormat::U8;
  if (kind == 'u' && bytes == 2) return PixelFormat::U16;
  if (kind == 'f' && bytes == 2) return PixelFormat::HALF;
  if (kind == 'f' && bytes == 4) return PixelFormat::FLOAT;
  throw Error(owner, "pixels must be uint8, uint16, float16 or float32");
}

/// Name, voxels (x, y, z) or (x, y, z, channels) of float16 or float32, object_to_voxel, background.
using GridArgument = std::tuple<std::string, py::array, Array<float>, float>;

VoxelGrid to_grid(const GridArgument& argument, const std::string& owner) {
  const auto& [name, voxels, object_to_voxel, background] = argument;
  const PixelFormat format = to_pixel_format(voxels, owner);
  const bool is_contiguous = (voxels.flags() & py::array::c_style) != 0;
  const bool is_float = format == PixelFormat::HALF || format == PixelFormat::FLOAT;
  if (!is_contiguous || !is_float || voxels.ndim() < 3 || voxels.ndim() > 4)
    throw Error(owner, "voxels of grid '" + name + "' must be a C-contiguous array of floats of 3 or 4 dimensions");
  VoxelGrid grid;
  grid.name = name;
  for (size_t axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<int>(voxels.shape(static_cast<int>(axis)));
  grid.channels = voxels.ndim() == 3 ? 1 : static_cast<int>(voxels.shape(3));
  grid.is_half = format == PixelFormat::HALF;
  grid.background = background;
  grid.object_to_voxel = to_transform(object_to_voxel, owner);
  grid.voxels = keep_alive<void>(voxels, voxels.data());
  return grid;
}

int add_volume(SceneBuilder& builder, const std::string& name, const Array<float>& object_to_box,
               const std::array<int, 3>& size, const std::vector<GridArgument>& grids, bool scales_with_object,
               float drift_opening, const OptionalArray<float>& texture_space, std::optional<int> replace) {
  VolumeInput input{name,          to_transform(object_to_box, name), size, {}, scales_with_object,
                    drift_opening, to_box(texture_space, name)};
  for (const GridArgument& grid : grids) input.grids.push_back(to_grid(grid, name));
  const py::gil_scoped_release nogil;
  return builder.add_volume(std::move(input), replace);
}

AlphaMode to_alpha_mode(const std::string& name, const std::string& owner) {
  if (name == "STRAIGHT") return AlphaMode::STRAIGHT;
  if (name == "PREMULTIPLIED") return AlphaMode::PREMULTIPLIED;
  if (name == "INDEPENDENT") return AlphaMode::INDEPENDENT;
  if (name == "IGNORED") return AlphaMode::IGNORED;
  throw Error(owner, "alpha '" + name + "' is not STRAIGHT, PREMULTIPLIED, INDEPENDENT or IGNORED");
}

int add_image(SceneBuilder& builder, const std::string& name, const py::array& pixels, const std::string& transfer,
              const std::optional<std::array<float, 9>>& to_working_space, const std::string& alpha,
              std::optional<int> replace) {
  const bool is_contiguous = (pixels.flags() & py::array::c_style) != 0;
  if (pixels.ndim() != 3 || !is_contiguous || pixels.shape(2) < 1 || pixels.shape(2) > 4)
    throw Error(name, "pixels must be a C-contiguous array of shape (height, width, 1 to 4)");
  if (transfer != "LINEAR" && transfer != "SRGB")
    throw Error(name, "transfer '" + transfer + "' is not LINEAR or SRGB");
  Image image;
  image.name = name;
  image.height = static_cast<int>(pixels.shape(0));
  image.width = static_cast<int>(pixels.shape(1));
  image.channels = static_cast<int>(pixels.shape(2));
  image.format = to_pixel_format(pixels, name);
  image.transfer = transfer == "SRGB" ? TransferCurve::SRGB : TransferCurve::LINEAR;
  image.has_colour_matrix = to_working_space.has_value();
  if (to_working_space) image.to_working_space = *to_working_space;
  image.alpha = to_alpha_mode(alpha, name);
  image.pixels = keep_alive<void>(pixels, pixels.data());
  return builder.add_image(std::move(image), replace);
}

int add_instances(SceneBuilder& builder, const Array<int32_t>& mesh, const Array<int32_t>& material_set,
                  const Array<int32_t>& object, const Array<float>& object_to_world, const Array<uint8_t>& visibility,
                  const OptionalArray<uint8_t>& holdout, const OptionalArray<float>& random,
                  const OptionalArray<uint64_t>& keys, const OptionalArray<int32_t>& values,
                  const OptionalArray<uint8_t>& link_sets, const OptionalArray<uint64_t>& links,
                  const OptionalArray<uint8_t>& shadow_catcher, const OptionalArray<LightGroup>& light_group) {
  const std::string owner = "instances";
  const auto count = static_cast<py::ssize_t>(checked_rows(mesh, 1, owner, "mesh"));
  const auto require_count = [&](const py::array& array, const char* what) {
    if (array.ndim() != 1 || array.shape(0) != count)
      throw Error(owner, std::string("array '") + what + "' must have one entry per instance");
  };
  require_count(material_set, "material_set");
  require_count(object, "object");
  require_count(visibility, "visibility");
  if (holdout) require_count(*holdout, "holdout");
  if (shadow_catcher) require_count(*shadow_catcher, "shadow_catcher");
  if (light_group) require_count(*light_group, "light_group");
  if (random) require_count(*random, "random");
  if (keys) require_count(*keys, "keys");
  if (values) require_count(*values, "values");
  const auto require_pairs = [&](const py::array& array, const char* what) {
    if (array.ndim() != 2 || array.shape(0) != count || array.shape(1) != 2)
      throw Error(owner, std::string("array '") + what + "' must have shape (n, 2)");
  };
  if (link_sets) require_pairs(*link_sets, "link_sets");
  if (links) require_pairs(*links, "links");
  if (object_to_world.ndim() != 3 || object_to_world.shape(0) != count || object_to_world.shape(1) < 3 ||
      object_to_world.shape(1) > 4 || object_to_world.shape(2) != 4)
    throw Error(owner, "object_to_world must have shape (n, 4, 4) or (n, 3, 4)");
  const py::ssize_t stride = object_to_world.shape(1) * 4;
  int first = -1;
  for (py::ssize_t i = 0; i < count; ++i) {
    Instance instance;
    instance.mesh = mesh.at(i);
    instance.material_set = material_set.at(i);
    instance.object = object.at(i);
    instance.visibility = visibility.at(i);
    instance.is_holdout = holdout && holdout->at(i) != 0;
    instance.is_shadow_catcher = shadow_catcher && shadow_catcher->at(i) != 0;
    if (light_group) instance.light_group = light_group->at(i);
    instance.random = random ? random->at(i) : 0.0f;
    instance.key = keys ? keys->at(i) : 0;
    instance.values = values ? values->at(i) : -1;
    if (link_sets) instance.light_set = link_sets->at(i, 0), instance.shadow_set = link_sets->at(i, 1);
    if (links) instance.links = {links->at(i, 0), links->at(i, 1)};
    instance.object_to_world = transform_from_rows(object_to_world.data() + i * stride);
    const int handle = builder.add_instance(instance);
    if (i == 0) first = handle;
  }
  return first;
}

void set_motion_step(SceneBuilder& builder, int step, const Array<float>& object_to_world,
                     const std::map<int, Array<float>>& positions) {
  if (object_to_world.ndim() != 3 || object_to_world.shape(1) != 4 || object_to_world.shape(2) != 4)
    throw Error("motion", "object_to_world must have shape (n, 4, 4)");
  std::vector<Transform> matrices;
  for (py::ssize_t i = 0; i < object_to_world.shape(0); ++i)
    matrices.push_back(transform_from_rows(object_to_world.data() + 16 * i));
  std::unordered_map<int, std::vector<Vec3>> shapes;
  for (const auto& [mesh, points] : positions) {
    if (points.ndim() != 2 || points.shape(1) != 3) throw Error("motion", "positions must have shape (n, 3)");
    std::vector<Vec3>& shape = shapes[mesh];
    for (py::ssize_t i = 0; i < points.shape(0); ++i)
      shape.push_back({*points.data(i, 0), *points.data(i, 1), *points.data(i, 2)});
  }
  builder.set_motion_step(step, std::move(matrices), std::move(shapes));
}

void set_instance_values(SceneBuilder& builder, const std::vector<std::string>& names, const Array<float>& rows) {
  if (rows.ndim() != 3 || rows.shape(1) != static_cast<py::ssize_t>(names.size()) || rows.shape(2) != 4)
    throw Error("instances", "values must have shape (n, " + std::to_string(names.size()) + ", 4)");
  builder.set_instance_values(names, std::vector<float>(rows.data(), rows.data() + rows.size()));
}

/// Keyword arguments that every kind of light takes.
struct LightCommon {
  Light light;
  std::optional<int> replace;
};

LightCommon light_common(const std::string& name, const py::kwargs& common) {
  LightCommon result;
  result.light.name = name;
  for (const auto& [key, value] : common) {
    const auto member = key.cast<std::string>();
    if (member == "visibility") {
      result.light.visibility = value.cast<uint8_t>();
    } else if (member == "casts_shadow") {
      result.light.casts_shadow = value.cast<bool>();
    } else if (member == "use_mis") {
      result.light.use_mis = value.cast<bool>();
    } else if (member == "max_bounces") {
      result.light.max_bounces = value.cast<int>();
    } else if (member == "material") {
      result.light.material = value.cast<int>();
    } else if (member == "object_to_world") {
      result.light.object_to_world = to_transform(value.cast<Array<float>>(), name);
    } else if (member == "key") {
      result.light.key = value.cast<uint64_t>();
    } else if (member == "lit_sets") {
      result.light.links.lit = value.cast<uint64_t>();
    } else if (member == "blocker_sets") {
      result.light.links.blockers = value.cast<uint64_t>();
    } else if (member == "light_group") {
      result.light.light_group = value.cast<LightGroup>();
    } else if (member == "replace") {
      result.replace = value.cast<std::optional<int>>();
    } else {
      throw Error(name, "a light has no member '" + member + "'");
    }
  }
  return result;
}

int add_light(SceneBuilder& builder, LightCommon arguments, decltype(Light::shape) shape) {
  arguments.light.shape = std::move(shape);
  return builder.add_light(std::move(arguments.light), arguments.replace);
}

/// Of a lamp: balls whose square no float holds are points.
float lamp_radius(float radius) {
  constexpr float kLeast = 1e-15f;  // metres
  return radius > 0.0f && radius < kLeast ? 0.0f : radius;
}

int add_point_light(SceneBuilder& builder, const std::string& name, const Color& position, float radius,
                    const Color& intensity, bool soft, const py::kwargs& common) {
  return add_light(builder, light_common(name, common),
                   PointLight{to_vec3(position), lamp_radius(radius), to_rgb(intensity), soft});
}

int add_spot_light(SceneBuilder& builder, const std::string& name, const Array<float>& object_to_world, float radius,
                   const Color& intensity, float spot_size, float blend, bool soft, const py::kwargs& common) {
  const Transform placed = to_transform(object_to_world, name);
  if (placed.determinant() == 0.0f || !std::isfinite(placed.determinant()))
    throw Error(name, "the spot light's matrix cannot be inverted");
  SpotLight spot{{placed.translation, lamp_radius(radius), to_rgb(intensity), soft},
                 inverse(placed),
                 std::cos(0.5f * spot_size),
                 blend};
  LightCommon arguments = light_common(name, common);
  arguments.light.object_to_world = placed;
  return add_light(builder, std::move(arguments), spot);
}

int add_sun_light(SceneBuilder& builder, const std::string& name, const Color& direction, float angle,
                  const Color& irradiance, const py::kwargs& common) {
  return add_light(builder, light_common(name, common), SunLight{to_vec3(direction), angle, to_rgb(irradiance)});
}

int add_area_light(SceneBuilder& builder, const std::string& name, const Color& center, const Color& edge_u,
                   const Color& edge_v, const Color& normal, const Color& radiance, bool ellipse, float spread,
                   bool portal, const py::kwargs& common) {
  AreaLight area{to_vec3(center), to_vec3(edge_u),  to_vec3(edge_v), to_vec3(normal),
                 ellipse,         to_rgb(radiance), spread,          portal};
  return add_light(builder, light_common(name, common), area);
}

void bind_lights(py::class_<SceneBuilder>& builder) {
  builder
      .def("add_point_light", &add_point_light, py::arg("name"), py::arg("position"), py::arg("radius"),
           py::arg("intensity"), py::arg("soft") = true)
      .def("add_spot_light", &add_spot_light, py::arg("name"), py::arg("object_to_world").noconvert(),
           py::arg("radius"), py::arg("intensity"), py::arg("spot_size"), py::arg("blend"), py::arg("soft") = true)
      .def("add_sun_light", &add_sun_light, py::arg("name"), py::arg("direction"), py::arg("angle"),
           py::arg("irradiance"))
      .def("add_area_light", &add_area_light, py::arg("name"), py::arg("center"), py::arg("edge_u"), py::arg("edge_v"),
           py::arg("normal"), py::arg("radiance"), py::arg("ellipse") = false, py::arg("spread") = kPi,
           py::arg("portal") = false)
      .def("remove_light", &SceneBuilder::remove_light, py::arg("handle"))
      .def("clear_lights", &SceneBuilder::clear_lights);
}

void bind_geometry(py::class_<SceneBuilder>& builder) {
  const auto none = py::none();
  builder
      .def("add_volume", &add_volume, py::arg("name"), py::arg("object_to_box").noconvert(), py::arg("size"),
           py::arg("grids"), py::arg("scales_with_object") = false, py::arg("drift_opening") = 0.0f,
           py::arg("texture_space").noconvert() = none, py::arg("replace") = none)
      .def("add_instances", &add_instances, py::arg("mesh").noconvert(), py::arg("material_set").noconvert(),
           py::arg("object").noconvert(), py::arg("object_to_world").noconvert(), py::arg("visibility").noconvert(),
           py::arg("holdout").noconvert() = none, py::arg("random").noconvert() = none,
           py::arg("keys").noconvert() = none, py::arg("values").noconvert() = none,
           py::arg("link_sets").noconvert() = none, py::arg("links").noconvert() = none,
           py::arg("shadow_catcher").noconvert() = none, py::arg("light_group").noconvert() = none)
      .def("set_motion_step", &set_motion_step, py::arg("step"), py::arg("object_to_world").noconvert(),
           py::arg("positions") = std::map<int, Array<float>>())
      .def("set_instance_values", &set_instance_values, py::arg("names"), py::arg("rows").noconvert())
      .def("blend_normals_in_world", &SceneBuilder::blend_normals_in_world)
      .def("remove_mesh", &SceneBuilder::remove_mesh, py::arg("handle"))
      .def("remove_instance", &SceneBuilder::remove_instance, py::arg("handle"))
      .def("clear_instances", &SceneBuilder::clear_instances)
      .def(
          "add_object_name",
          [](SceneBuilder& b, const std::string& name, float pass_index, const std::optional<std::string>& asset) {
            return b.add_object_name(name, {pass_index, matte_id(name), matte_id(asset.value_or(name))});
          },
          py::arg("name"), py::arg("pass_index") = 0.0f, py::arg("asset") = py::none())
      .def_property_readonly("singular_instances", &SceneBuilder::singular_instances);
}

void bind_surroundings(py::class_<SceneBuilder>& builder) {
  builder.def(
      "set_environment",
      [](SceneBuilder& b, int material, uint8_t visibility, int width, bool importance_sampling, LightGroup group) {
        b.set_environment({material, width, visibility, importance_sampling, group});
      },
      py::arg("material"), py::arg("visibility") = uint8_t{kVisibleToAll}, py::arg("importance_width") = 0,
      py::arg("importance_sampling") = true, py::arg("light_group") = kNoLightGroup);
}

}  // namespace

void bind_scene_builder(py::module_& m) {
  using NoGil = py::call_guard<py::gil_scoped_release>;
  m.def(
      "matte_hash", [](const std::string& name) { return murmur_hash_3(name); }, py::arg("name"));
  py::class_<SceneHandle>(m, "Scene")
      .def_property_readonly("triangle_count", &SceneHandle::triangle_count)
      .def_property_readonly("instance_count", &SceneHandle::instance_count)
      .def_property_readonly("volume_name", &SceneHandle::volume_name)
      .def_property_readonly("dispersive_name", &SceneHandle::dispersive_name)
      .def_property_readonly("has_shadow_catchers",
                             [](const SceneHandle& handle) { return has_shadow_catchers(*handle.scene); })
      .def(
          "shadow_catchers_alone", [](const SceneHandle& handle) { return handle.with(shadow_catchers_alone); },
          NoGil())
      .def(
          "backdrop", [](const SceneHandle& handle) { return handle.with(backdrop); }, NoGil())
      .def_readonly("warnings", &SceneHandle::warnings);
  py::class_<SceneBuilder> builder(m, "SceneBuilder");
  builder
      .def(
          py::init([](const SceneHandle* earlier) { return earlier ? SceneBuilder(*earlier->scene) : SceneBuilder(); }),
          py::arg("earlier") = py::none())
      .def("add_image", &add_image, py::arg("name"), py::arg("pixels").noconvert(), py::arg("transfer") = "LINEAR",
           py::arg("to_working_space") = py::none(), py::arg("alpha") = "STRAIGHT", py::arg("replace") = py::none())
      .def("add_material", &SceneBuilder::add_material, py::arg("program"), py::arg("replace") = py::none())
      .def("add_material_set", &SceneBuilder::add_material_set, py::arg("materials"), py::arg("owner_name"))
      .def(
          "snapshot",
          [](SceneBuilder& b, const SceneHandle* middle, std::function<bool()> is_stopped) {
            StopPoll poll(std::move(is_stopped));
            DisplacedScene displaced =
                displaced_snapshot(b, middle ? middle->scene.get() : nullptr, [&] { return poll(); });
            if (!displaced.scene) return std::optional<SceneHandle>();
            return std::optional(SceneHandle{std::move(displaced.scene), std::move(displaced.warnings)});
          },
          py::arg("middle") = py::none(), py::arg("is_stopped") = py::none(), NoGil());
  bind_geometry(builder);
  bind_lights(builder);
  bind_surroundings(builder);
  bind_meshes(builder);
  bind_camera(builder);
}

}  // namespace cistern::binding
