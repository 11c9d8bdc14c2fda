#include <pybind11/stl.h>

#include "binding/arrays.h"
#include "binding/bind.h"
#include "binding/choice.h"
#include "scene/scene_builder.h"

namespace cistern::binding {
namespace {

Panorama to_panorama(const py::dict& values, const std::string& name) {
  const auto pair = [](const py::handle& value) {
    const auto [first, second] = value.cast<std::pair<float, float>>();
    return Vec2{first, second};
  };
  Panorama panorama;
  for (const auto& [key, value] : values) {
    const auto member = key.cast<std::string>();
    if (member == "type") {
      panorama.type = choice_of<PanoramaType>(name, "panorama", value.cast<std::string>(),
                                              {{"EQUIRECTANGULAR", PanoramaType::EQUIRECTANGULAR},
                                               {"CUBEMAP_FACE", PanoramaType::CUBEMAP_FACE},
                                               {"MIRROR_BALL", PanoramaType::MIRROR_BALL},
                                               {"FISHEYE_EQUIDISTANT", PanoramaType::FISHEYE_EQUIDISTANT},
                                               {"FISHEYE_EQUISOLID", PanoramaType::FISHEYE_EQUISOLID},
                                               {"FISHEYE_POLYNOMIAL", PanoramaType::FISHEYE_POLYNOMIAL},
                                               {"CENTRAL_CYLINDRICAL", PanoramaType::CENTRAL_CYLINDRICAL}});
    } else if (member == "longitude") {
      panorama.longitude = pair(value);
    } else if (member == "latitude") {
      panorama.latitude = pair(value);
    } else if (member == "cylinder") {
      panorama.cylinder = pair(value);
    } else if (member == "sensor") {
      panorama.sensor = pair(value);
    } else if (member == "fov") {
      panorama.fov = value.cast<float>();
    } else if (member == "lens") {
      panorama.lens = value.cast<float>();
    } else if (member == "polynomial") {
      panorama.polynomial = value.cast<std::array<float, 5>>();
    } else {
      throw Error(name, "panorama has no '" + member + "'");
    }
  }
  return panorama;
}

void set_camera(SceneBuilder& builder, const std::string& name, const std::string& type, const Array<float>& matrix,
                float left, float right, float bottom, float top, float clip_start, float clip_end,
                float aperture_radius, float focus_distance, int blades, float blade_rotation, float aperture_ratio,
                const py::dict& panorama) {
  Camera camera;
  camera.type = choice_of<CameraType>(name, "camera type", type,
                                      {{"PERSPECTIVE", CameraType::PERSPECTIVE},
                                       {"ORTHOGRAPHIC", CameraType::ORTHOGRAPHIC},
                                       {"PANORAMIC", CameraType::PANORAMIC}});
  if (camera.type == CameraType::PANORAMIC) camera.panorama = to_panorama(panorama, name);
  camera.camera_to_world = to_transform(matrix, name);
  camera.left = left, camera.right = right, camera.bottom = bottom, camera.top = top;
  camera.clip_start = clip_start, camera.clip_end = clip_end;
  camera.aperture_radius = aperture_radius, camera.focus_distance = focus_distance;
  camera.blades = blades, camera.blade_rotation = blade_rotation, camera.aperture_ratio = aperture_ratio;
  builder.set_camera(camera, name);
}

void set_sheet(SceneBuilder& builder, const std::string& name, int width, int height, int instance,
               const Array<int32_t>& polygons, const Array<float>& points, const Array<float>& steps_x,
               const Array<float>& steps_y, bool sees_from_eye) {
  const SheetInput input{width,
                         height,
                         instance,
                         flat_span(polygons, name, "polygons"),
                         vec3_span(points, name, "points"),
                         vec3_span(steps_x, name, "steps_x"),
                         vec3_span(steps_y, name, "steps_y")};
  builder.set_sheet(input, sees_from_eye, name);
}

}  // namespace

void bind_camera(py::class_<SceneBuilder>& builder) {
  builder.def("set_camera", &set_camera, py::arg("name"), py::arg("type"), py::arg("camera_to_world").noconvert(),
              py::arg("left"), py::arg("right"), py::arg("bottom"), py::arg("top"), py::arg("clip_start"),
              py::arg("clip_end"), py::arg("aperture_radius") = 0.0f, py::arg("focus_distance") = 1.0f,
              py::arg("blades") = 0, py::arg("blade_rotation") = 0.0f, py::arg("aperture_ratio") = 1.0f,
              py::arg("panorama") = py::dict());
  builder.def(
      "set_dicing",
      [](SceneBuilder& b, const std::string& owner, int width, int height, float rate, float offscreen_scale,
         int most_levels, bool stays_diced) {
        b.set_dicing(DicingView{{}, width, height, rate, offscreen_scale, most_levels, stays_diced}, owner);
      },
      py::arg("owner"), py::arg("width"), py::arg("height"), py::arg("rate") = 1.0f, py::arg("offscreen_scale") = 4.0f,
      py::arg("most_levels") = 12, py::arg("stays_diced") = false);
  builder.def("set_sheet", &set_sheet, py::arg("name"), py::arg("width"), py::arg("height"), py::arg("instance"),
              py::arg("polygons").noconvert(), py::arg("points").noconvert(), py::arg("steps_x").noconvert(),
              py::arg("steps_y").noconvert(), py::arg("sees_from_eye") = false);
}

}  // namespace cistern::binding
