#pragma once

#include "transport/path_scenes.h"

namespace cistern::test {

inline constexpr float kIor = 1.5f, kWide = 40.0f, kThickness = 0.02f, kAlbedo = 0.6f;

/// A floor that looks up at a pane 1 m above it.
struct Court : PathScene {
  int glass = clear_glass(kIor);

  Court() { floor(0.0f, kWide, diffuse(kAlbedo)); }

  void face(float z, float facing, int material, float size = kWide) {
    quad({0, 0, z}, {size, 0, 0}, {0, facing * size, 0}, material);
  }
  void pane(float z = 1.0f, float size = kWide, float thickness = kThickness) {
    face(z, -1.0f, glass, size);
    face(z + thickness, 1.0f, glass, size);
  }
  void area(float z) { builder.add_light(area_lamp({0.1f, 0, z}, 0.6f, -1.0f, 3.0f)); }
  void soft_lamp(Vec3 position, float radius) {
    Light light;
    light.name = "soft";
    light.shape = PointLight{position, radius, Rgb(1.0f), true};
    builder.add_light(light);
  }
  /// A disc of the sky of this radius in radians.
  void sun(float radius, Vec3 towards = {0.3f, 0.1f, 1.0f}) {
    Light light;
    light.name = "sun";
    light.shape = SunLight{normalize(towards), radius, Rgb(3.0f)};
    builder.add_light(light);
  }
};

}  // namespace cistern::test
