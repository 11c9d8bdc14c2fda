#include "scene/surface_sheet.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "scene/scene_builder.h"

namespace cistern {
namespace {

/// A quad and a triangle beside it; the quad's triangles are 0 and 1.
struct Sheets : testing::Test {
  std::vector<Vec3> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}};
  std::vector<int32_t> corners{0, 1, 2, 3, 1, 4, 2}, offsets{0, 4, 7};
  SceneBuilder builder;
  std::vector<int32_t> polygons{0};
  std::vector<Vec3> points{{0.25f, 0.5f, 0}}, steps_x{{0.1f, 0, 0}}, steps_y{{0, 0.2f, 0}};
  SheetInput input{1, 1, 0, {}, {}, {}, {}};

  Sheets() {
    MeshInput mesh;
    mesh.name = "Mesh";
    mesh.positions = positions, mesh.corner_vertices = corners, mesh.polygon_offsets = offsets;
    Instance instance;
    instance.mesh = builder.add_mesh(mesh);
    instance.object = builder.add_object_name("Object");
    instance.material_set = builder.add_material_set({}, "Object");
    instance.object_to_world = {{
                                    2,
                                    0,
                                    0,
                                },
                                {0, 2, 0},
                                {0, 0, 2},
                                {5, 0, 0}};
    builder.add_instance(instance);
  }
  SurfaceSheet make() {
    input.polygons = polygons, input.points = points, input.steps_x = steps_x, input.steps_y = steps_y;
    return make_surface_sheet(builder.scene(), input, "Object");
  }
  Vec3 place(const SurfaceSheet& sheet, Vec2 weights) const {
    const auto [p0, p1, p2] =
        builder.scene().meshes[0]->triangle_positions(static_cast<size_t>(sheet.pixels[0].triangle));
    return p0 + weights.x * (p1 - p0) + weights.y * (p2 - p0);
  }
};

TEST_F(Sheets, PointsAndStepsAreFoundOnTheTriangleTheyLieOn) {
  for (const Vec3 point : {Vec3{0.25f, 0.5f, 0}, Vec3{0.5f, 0.25f, 0}, Vec3{1.25f, 0.25f, 0}}) {
    points[0] = point;
    polygons[0] = point.x > 1.0f ? 1 : 0;
    const SurfaceSheet sheet = make();
    const SheetPixel& pixel = sheet.pixels[0];
    EXPECT_LT(length(place(sheet, pixel.weights) - point), 1e-6f);
    EXPECT_LT(length(place(sheet, pixel.weights + pixel.along_x) - point - steps_x[0]), 1e-6f);
    EXPECT_LT(length(place(sheet, pixel.weights + pixel.along_y) - point - steps_y[0]), 1e-6f);
    EXPECT_GE(std::min({pixel.weights.x, pixel.weights.y, 1.0f - pixel.weights.x - pixel.weights.y}), 0.0f);
  }
  EXPECT_NEAR(make().pixel_size, 2.0f * std::sqrt(0.1f * 0.2f), 1e-6f);
}

TEST_F(Sheets, PointsBesideThePolygonAreBroughtToItsEdge) {
  points[0] = {-0.1f, 0.5f, 0};
  const SurfaceSheet sheet = make();
  const Vec3 found = place(sheet, sheet.pixels[0].weights);
  EXPECT_NEAR(found.x, 0.0f, 1e-6f);
  EXPECT_GT(found.y, 0.3f);
}

TEST_F(Sheets, PixelsWithoutTriangleShowNothing) {
  for (const int32_t polygon : {-1, 2, 1'000'000}) {
    polygons[0] = polygon;
    EXPECT_EQ(make().pixels[0].triangle, -1);
  }
}

TEST_F(Sheets, BadInputIsNamed) {
  points[0].y = NAN;
  EXPECT_THROW(make(), Error);
  points[0].y = 0.5f;
  input.width = 2;
  EXPECT_THROW(make(), Error);
  input.width = 0;
  EXPECT_THROW(make(), Error);
  input.width = 1;
  input.instance = 1;
  EXPECT_THROW(make(), Error);
}

}  // namespace
}  // namespace cistern
