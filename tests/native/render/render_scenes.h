#pragma once

#include "render/settings.h"
#include "transport/path_scenes.h"

namespace cistern::test {

/// A glowing quad, a glossy one and a lamp over a floor, seen by a camera from the side.
inline std::shared_ptr<const Scene> small_room() {
  PathScene scene;
  scene.floor(0.0f, 10.0f, scene.diffuse(0.6f));
  scene.quad({0, 1.5f, 1}, {2, 0, 0}, {0, 0, 2}, scene.glossy(0.3f));
  scene.quad({-1, 0, 2}, {0, 0.5f, 0}, {0.5f, 0, 0}, scene.emission({4, 3, 2}));
  scene.point_lamp({1, -1, 2}, 5.0f, 0.1f);
  Camera camera;
  camera.camera_to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {0, -3, 1}};  // looks along +Y
  camera.left = camera.bottom = -0.6f, camera.right = camera.top = 0.6f;
  camera.aperture_radius = 0.05f, camera.focus_distance = 3.0f;
  scene.builder.set_camera(camera, "camera");
  return scene.builder.snapshot();
}

inline Settings small_settings(int width = 40, int height = 24, int samples = 3) {
  Settings settings;
  settings.width = width, settings.height = height, settings.samples = samples;
  return settings;
}

}  // namespace cistern::test
