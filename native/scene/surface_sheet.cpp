#include "scene/surface_sheet.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ranges>

#include "base/check.h"
#include "scene/scene.h"
#include "scene/triangle_weights.h"

namespace cistern {
namespace {

struct Edges {
  Vec3 corner, edge_1, edge_2;
};

Edges edges_of(const Mesh& mesh, size_t triangle) {
  const auto [p0, p1, p2] = mesh.triangle_positions(triangle);
  return {p0, p1 - p0, p2 - p0};
}

/// How far inside of a triangle the point is that has these weights; negative outside.
float depth_inside(Vec2 weights) { return std::min({weights.x, weights.y, 1.0f - weights.x - weights.y}); }

/// The triangles that a polygon became, [first, end).
std::pair<size_t, size_t> triangles_of(const Mesh& mesh, int32_t polygon) {
  const auto wanted = static_cast<uint32_t>(polygon);
  if (mesh.polygons.empty()) {
    const size_t first = std::min<size_t>(wanted, mesh.triangle_count());
    return {first, std::min(first + 1, mesh.triangle_count())};
  }
  const auto begin = mesh.polygons.begin();
  const auto [first, end] = std::equal_range(begin, mesh.polygons.end(), wanted);
  return {static_cast<size_t>(first - begin), static_cast<size_t>(end - begin)};
}

SheetPixel make_pixel(const Mesh& mesh, int32_t polygon, Vec3 point, Vec3 step_x, Vec3 step_y) {
  SheetPixel pixel;
  const auto [first, end] = triangles_of(mesh, polygon);
  float deepest = -INFINITY;
  for (size_t triangle = first; triangle < end; ++triangle) {
    const Edges t = edges_of(mesh, triangle);
    const Vec2 weights = weight_step(t.edge_1, t.edge_2, point - t.corner);
    if (!(depth_inside(weights) > deepest)) continue;
    deepest = depth_inside(weights);
    pixel = {static_cast<int32_t>(triangle), inside_triangle(weights), weight_step(t.edge_1, t.edge_2, step_x),
             weight_step(t.edge_1, t.edge_2, step_y)};
  }
  return pixel;
}

void check_input(const Scene& scene, const SheetInput& input, const std::string& name) {
  if (input.width < 1 || input.height < 1) {
    throw Error(name, "sheet is " + std::to_string(input.width) + " x " + std::to_string(input.height) +
                          " pixels: must be at least 1 x 1");
  }
  const size_t pixels = static_cast<size_t>(input.width) * static_cast<size_t>(input.height);
  for (const size_t size : {input.polygons.size(), input.points.size(), input.steps_x.size(), input.steps_y.size()}) {
    if (size == pixels) continue;
    throw Error(name, "an array of the sheet has " + std::to_string(size) + " entries: must be " +
                          std::to_string(pixels) + ", one for each pixel");
  }
  if (input.instance < 0 || static_cast<size_t>(input.instance) >= scene.instances.size() ||
      scene.instances[static_cast<size_t>(input.instance)].mesh < 0)
    throw Error(name, "instance " + std::to_string(input.instance) + " of the sheet is not in the scene");
}

bool is_finite_all(std::initializer_list<Vec3> values) {
  return std::ranges::all_of(values, [](Vec3 v) { return is_finite(v); });
}

}  // namespace

Vec2 inside_triangle(Vec2 weights) {
  const Vec2 w{std::max(weights.x, 0.0f), std::max(weights.y, 0.0f)};
  const float sum = w.x + w.y;
  return sum > 1.0f ? Vec2{w.x / sum, w.y / sum} : w;
}

SurfaceSheet make_surface_sheet(const Scene& scene, const SheetInput& input, const std::string& name) {
  check_input(scene, input, name);
  const Instance& instance = scene.instances[static_cast<size_t>(input.instance)];
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(instance.mesh)];
  if (mesh.is_strands()) throw Error(name, "strands of hair cannot be laid out as a sheet");
  SurfaceSheet sheet{input.width, input.height, static_cast<uint32_t>(input.instance), 0.0f, {}};
  sheet.pixels.resize(input.polygons.size());
  double sizes = 0.0;
  size_t shown = 0;
  for (size_t i = 0; i < sheet.pixels.size(); ++i) {
    if (input.polygons[i] < 0) continue;
    const Vec3 step_x = input.steps_x[i], step_y = input.steps_y[i];
    if (!is_finite_all({input.points[i], step_x, step_y}))
      throw Error(name, "pixel " + std::to_string(i) + " of the sheet is not finite");
    sheet.pixels[i] = make_pixel(mesh, input.polygons[i], input.points[i], step_x, step_y);
    if (sheet.pixels[i].triangle < 0) continue;
    const Transform& m = instance.object_to_world;
    sizes += std::sqrt(length(cross(m.vector(step_x), m.vector(step_y))));
    ++shown;
  }
  if (shown > 0) sheet.pixel_size = static_cast<float>(sizes / static_cast<double>(shown));
  return sheet;
}

}  // namespace cistern
