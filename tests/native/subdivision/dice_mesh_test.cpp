#include "subdivision/dice_mesh.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <limits>
#include <map>
#include <set>

#include "subdivision/cages.h"
#include "subdivision/longest_edge.h"

namespace cistern {
namespace {

using test::Cage;

DicedMesh diced(const std::shared_ptr<const Mesh>& source, const DicingView& view = test::close_view(),
                size_t most_triangles = kMostDicedTriangles) {
  DicedMesh result;
  result.dicing = {source, source, view, {}};
  dice_mesh(result, {}, most_triangles);
  return result;
}

using Edge = std::pair<uint32_t, uint32_t>;

/// How often each directed edge is without the one that runs against it.
int open_edges(const std::vector<TriangleIndices>& triangles) {
  std::map<Edge, int> balance;
  for (const TriangleIndices& t : triangles)
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = t[i], b = t[(i + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  return static_cast<int>(std::ranges::count_if(balance, [](const auto& edge) { return edge.second != 0; }));
}

int exceeding_edges(const Mesh& mesh, const DicingView& view) {
  const LongestEdge longest(view, *mesh.dicing->source->cage, {}, 1.0f);
  int count = 0;
  for (size_t t = 0; t < mesh.triangle_count(); ++t) {
    const auto p = mesh.triangle_positions(t);
    for (size_t i = 0; i < 3; ++i) count += longest.is_exceeded(p[i], p[(i + 1) % 3]) ? 1 : 0;
  }
  return count;
}

class DiceMesh : public testing::TestWithParam<SubdivisionScheme> {
 protected:
  std::shared_ptr<const Mesh> mesh(const Cage& cage) const {
    return cage.mesh([](MeshInput& input) { input.subdivision->scheme = GetParam(); });
  }
};
INSTANTIATE_TEST_SUITE_P(Schemes, DiceMesh,
                         testing::Values(SubdivisionScheme::CATMULL_CLARK, SubdivisionScheme::LINEAR));

TEST_P(DiceMesh, TheTextureSpaceOfWhatIsInsideIsThatOfTheCage) {
  auto source = std::make_shared<Mesh>(*mesh(test::cube()));
  source->texture_space = Bounds3{{-1.0f, -2.0f, -3.0f}, {3.0f, 2.0f, 1.0f}};
  const DicedMesh result = diced(source);
  ASSERT_TRUE(result.mesh->texture_space);
  EXPECT_EQ(result.mesh->texture_space->lower, source->texture_space->lower);
}

TEST_P(DiceMesh, ClosedCagesStayClosed) {
  for (const Cage& cage : {test::cube(), test::house()}) {
    const DicedMesh result = diced(mesh(cage));
    EXPECT_EQ(result.warning, "");
    EXPECT_GT(result.mesh->triangle_count(), 10000u);
    EXPECT_EQ(open_edges(result.mesh->vertices), 0);
    std::vector<TriangleIndices> with_a_hole = result.mesh->vertices;
    with_a_hole.pop_back();
    EXPECT_EQ(open_edges(with_a_hole), 3);
  }
}

TEST_P(DiceMesh, NoEdgeIsTooLongAndNoneMuchShorter) {
  for (const Cage& cage : {test::cube(), test::house(), test::square()}) {
    const DicedMesh result = diced(mesh(cage));
    EXPECT_EQ(exceeding_edges(*result.mesh, result.dicing.view), 0);
    DicingView finer = result.dicing.view;
    finer.rate = 0.9f;
    EXPECT_GT(exceeding_edges(*result.mesh, finer), 100);
    finer.rate = 0.25f;  // most edges are longer than that
    EXPECT_GT(exceeding_edges(*result.mesh, finer), static_cast<int>(2 * result.mesh->triangle_count()));
  }
}

TEST_P(DiceMesh, IsTheSameForAnyNumberOfThreads) {
  const std::shared_ptr<const Mesh> source = mesh(test::house());
  const DicedMesh alone = diced(source);
  for (const int threads : {1, 2, 7}) {
    tbb::task_arena arena(threads);
    arena.execute([&] { EXPECT_TRUE(is_same_mesh(*diced(source).mesh, *alone.mesh)) << threads; });
  }
  EXPECT_FALSE(is_same_mesh(*diced(source, test::close_view(201)).mesh, *alone.mesh));
}

TEST(DiceMeshScheme, CatmullClarkCornersLieWhereTheirLimitIs) {
  // [Halstead et al. 1993] (n^2 v + 4 sum e + sum f) / (n (n + 5)) = v / 2
  const DicedMesh smooth = diced(test::cube().mesh());
  for (size_t i = 0; i < 8; ++i)
    EXPECT_LT(length(smooth.mesh->positions[i] - 0.5f * test::cube().points[i]), 1e-5f) << i;
  const DicedMesh straight =
      diced(test::cube().mesh([](MeshInput& input) { input.subdivision->scheme = SubdivisionScheme::LINEAR; }));
  for (size_t i = 0; i < 8; ++i) EXPECT_LT(length(straight.mesh->positions[i] - test::cube().points[i]), 1e-5f) << i;
}

TEST(DiceMeshScheme, NormalsAreThoseOfTheSurface) {
  const DicedMesh result = diced(test::cube().mesh());
  const Mesh& mesh = *result.mesh;
  ASSERT_EQ(mesh.normals_domain, Domain::POINT);
  for (size_t t = 0; t < mesh.triangle_count(); ++t) {
    const auto p = mesh.triangle_positions(t);
    const Vec3 flat = normalize(cross(p[1] - p[0], p[2] - p[0]));
    for (const uint32_t v : mesh.vertices[t]) EXPECT_GT(dot(flat, decode_octahedral(mesh.normals[v])), 0.99f);
  }
}

TEST(DiceMeshScheme, CreasesThatStayPartNormals) {
  const std::vector<int32_t> edge{0, 1};
  for (const float sharpness : {2.0f, 10.0f}) {
    const std::vector<float> sharp{sharpness};
    const DicedMesh result = diced(test::cube().mesh([&](MeshInput& input) {
      input.subdivision->creases = edge;
      input.subdivision->crease_sharpness = sharp;
    }));
    const Mesh& mesh = *result.mesh;
    EXPECT_EQ(mesh.normals_domain, sharpness < 10.0f ? Domain::POINT : Domain::CORNER);
    if (mesh.normals_domain == Domain::POINT) continue;
    std::map<uint32_t, std::set<uint32_t>> by_point;
    for (size_t t = 0; t < mesh.triangle_count(); ++t)
      for (size_t j = 0; j < 3; ++j) by_point[mesh.vertices[t][j]].insert(mesh.normals[mesh.corners[t][j]]);
    const auto parted = std::ranges::count_if(by_point, [](const auto& entry) { return entry.second.size() > 1; });
    EXPECT_GT(parted, 50);
    EXPECT_LT(parted, 1000);  // along the crease alone, of tens of thousands
  }
}

MeshAttribute attribute(const char* name, Domain domain, int components, const std::vector<float>& values) {
  const std::shared_ptr<float[]> copy = std::make_shared<float[]>(values.size());
  std::ranges::copy(values, copy.get());
  return {name, domain, components, copy};
}

TEST(DiceMeshAttributes, GeneratedCoordinatesAreAsSmoothAsTheSurface) {
  std::vector<float> positions;
  for (const Vec3& p : test::house().points) positions.insert(positions.end(), {p.x, p.y, p.z});
  const DicedMesh result = diced(test::house().mesh([&](MeshInput& input) {
    input.attributes = {attribute("INFO:generated", Domain::POINT, 3, positions),
                        attribute("place", Domain::POINT, 3, positions)};
  }));
  const Mesh& mesh = *result.mesh;
  ASSERT_EQ(mesh.attributes.size(), 2u);
  float largest = 0.0f;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const float* value = &mesh.attributes[0].values[3 * i];
    EXPECT_LT(length(Vec3{value[0], value[1], value[2]} - mesh.positions[i]), 1e-5f);
    const float* straight = &mesh.attributes[1].values[3 * i];
    largest = std::max(largest, length(Vec3{straight[0], straight[1], straight[2]} - mesh.positions[i]));
  }
  EXPECT_GT(largest, 0.3f);  // other attributes of points are straight
  EXPECT_EQ(mesh.generated_bounds().upper, test::house().mesh()->bounds.upper);
  EXPECT_NE(mesh.bounds.upper, mesh.generated_bounds().upper);
}

/// Largest difference of a UV map to x and y of the surface.
float uv_error(UvSmoothing smoothing, bool is_flat) {
  Cage cage;
  for (int i = 0; i < 16; ++i)
    cage.points.push_back({static_cast<float>(i % 4) - 1.5f, static_cast<float>(i / 4) - 1.5f, 0.0f});
  for (int32_t y = 0; y < 3; ++y)
    for (int32_t x = 0; x < 3; ++x) cage.polygons.push_back({x + 4 * y, x + 1 + 4 * y, x + 5 + 4 * y, x + 4 + 4 * y});
  if (!is_flat) cage.points[5] = {-0.9f, -0.9f, 0.0f};
  std::vector<float> uv;
  for (const auto& polygon : cage.polygons)
    for (const int32_t point : polygon)
      uv.insert(uv.end(), {cage.points[static_cast<size_t>(point)].x, cage.points[static_cast<size_t>(point)].y});
  DicingView view = test::close_view(40);
  const DicedMesh result = diced(cage.mesh([&](MeshInput& input) {
    input.attributes = {attribute("UVMap", Domain::CORNER, 2, uv)};
    input.subdivision->uv_maps = 1;
    input.subdivision->uv_smoothing = smoothing;
  }),
                                 view);
  const Mesh& mesh = *result.mesh;
  float error = 0.0f;
  for (size_t t = 0; t < mesh.triangle_count(); ++t)
    for (size_t j = 0; j < 3; ++j) {
      const Vec3 p = mesh.positions[mesh.vertices[t][j]];
      const float* value = &mesh.attributes[0].values[2 * mesh.corners[t][j]];
      error = std::max({error, std::abs(value[0] - p.x), std::abs(value[1] - p.y)});
    }
  return error;
}

TEST(DiceMeshAttributes, UvMapsAreSmoothedAsAsked) {
  // With the surface's own rules a map of its points stays that; corners of the boundary are round there.
  EXPECT_LT(uv_error(UvSmoothing::ALL, false), 1e-5f);
  EXPECT_GT(uv_error(UvSmoothing::BOUNDARIES, true), 0.05f);
  EXPECT_GT(uv_error(UvSmoothing::NONE, false), 0.05f);
}

TEST(DiceMeshAttributes, FacesKeepTheirOwn) {
  std::vector<float> values{1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f, 8.0f};
  std::vector<int32_t> slots{0, 1, 2, 3, 4, 5, 6, 7};
  const DicedMesh result = diced(test::house().mesh([&](MeshInput& input) {
    input.attributes = {attribute("number", Domain::FACE, 1, values)};
    input.material_indices = slots;
  }));
  const Mesh& mesh = *result.mesh;
  std::set<uint16_t> seen;
  for (size_t t = 0; t < mesh.triangle_count(); ++t) {
    seen.insert(mesh.material_slots[t]);
    for (const uint32_t corner : mesh.corners[t])
      EXPECT_EQ(mesh.attributes[0].values[corner], static_cast<float>(mesh.material_slots[t] + 1));
  }
  EXPECT_EQ(seen.size(), 8u);
}

TEST(DiceMeshShading, FlatPolygonsAreFlatTriangleByTriangle) {
  std::vector<uint8_t> sharp(6, 0);
  sharp[1] = 1;
  const DicedMesh result = diced(test::cube().mesh([&](MeshInput& input) { input.sharp_faces = sharp; }));
  const Mesh& mesh = *result.mesh;
  EXPECT_EQ(mesh.normals_domain, Domain::POINT);
  size_t flat = 0;
  for (size_t t = 0; t < mesh.triangle_count(); ++t) {
    EXPECT_EQ(mesh.is_flat(t), mesh.polygons[t] == 1);
    flat += mesh.is_flat(t);
  }
  EXPECT_GT(flat, 100u);
}

TEST(DiceMeshLimits, LevelsEndIt) {
  DicingView view = test::close_view(10000);
  view.most_levels = 3;
  EXPECT_EQ(diced(test::square().mesh(), view).mesh->triangle_count(), 2u * 64u);
  view.most_levels = 0;
  EXPECT_EQ(diced(test::square().mesh(), view).mesh->triangle_count(), 2u);
  EXPECT_EQ(diced(test::house().mesh(), view).mesh->triangle_count(), 2u * (5 + 5 + 3 + 3) + 4u + 5u + 5u + 4u);
}

TEST(DiceMeshLimits, TooManyTrianglesMakeItCoarser) {
  const DicedMesh result = diced(test::cube().mesh(), test::close_view(), 1000);
  EXPECT_LE(result.mesh->triangle_count(), 1000u);
  EXPECT_GT(result.mesh->triangle_count(), 100u);
  EXPECT_NE(result.warning.find("'cage' would be subdivided into more than 1000 triangles"), std::string::npos)
      << result.warning;
}

TEST(DiceMeshLimits, TooManyPolygonsStayAsTheyAre) {
  const std::shared_ptr<const Mesh> source = test::cube().mesh();
  const DicedMesh result = diced(source, test::close_view(), 11);
  EXPECT_EQ(result.mesh, source);
  EXPECT_NE(result.warning.find("'cage' has too many polygons"), std::string::npos) << result.warning;
}

TEST(DiceMeshLimits, ObjectSpaceLengths) {
  const DicedMesh result = diced(test::square().mesh([](MeshInput& input) {
    input.subdivision->length = 0.25f;
    input.subdivision->scheme = SubdivisionScheme::LINEAR;
  }));
  EXPECT_EQ(result.mesh->triangle_count(), 256u);  // 8 x 8 cells, whose diagonals are halved, too
}

TEST(DiceMeshBadInput, StaysAsItIs) {
  Cage far = test::cube();
  far.points[3].y = std::numeric_limits<float>::infinity();
  const std::shared_ptr<const Mesh> source = far.mesh();
  const DicedMesh result = diced(source);
  EXPECT_EQ(result.mesh, source);
  EXPECT_NE(result.warning.find("'cage' has points that are not finite"), std::string::npos) << result.warning;
}

TEST(DiceMeshBadInput, PolygonsOfTwoCornersAreRefused) {
  Cage thin = test::cube();
  thin.polygons.push_back({0, 7});
  const DicedMesh result = diced(thin.mesh());
  EXPECT_EQ(result.mesh, result.dicing.source);
  EXPECT_NE(result.warning.find("fewer than three corners"), std::string::npos) << result.warning;
}

TEST(DiceMeshBadInput, OddPolygonsAreSurvived) {
  Cage repeated = test::cube();
  repeated.polygons[2] = {0, 1, 1, 4};
  Cage crossing = test::cube();
  crossing.polygons.push_back({0, 3, 5, 6});
  crossing.polygons.push_back(crossing.polygons[0]);
  for (const Cage& cage : {repeated, crossing}) {
    const DicedMesh result = diced(cage.mesh());
    EXPECT_EQ(result.warning, "");
    EXPECT_GT(result.mesh->triangle_count(), 1000u);
    EXPECT_EQ(exceeding_edges(*result.mesh, result.dicing.view), 0);
    for (const Vec3& p : result.mesh->positions) EXPECT_TRUE(is_finite(p));
  }
}

TEST(DiceMeshBadInput, EdgesOfThreePolygonsPartNormals) {
  Cage pages{{{0.0f, -1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}}, {}};
  for (const Vec3 away : {Vec3{1.0f, 0.0f, 0.0f}, Vec3{-0.5f, 0.0f, 0.8f}, Vec3{-0.5f, 0.0f, -0.8f}}) {
    const auto first = static_cast<int32_t>(pages.points.size());
    pages.points.push_back(pages.points[1] + away);
    pages.points.push_back(pages.points[0] + away);
    pages.polygons.push_back({0, 1, first, first + 1});
  }
  EXPECT_EQ(diced(pages.mesh()).mesh->normals_domain, Domain::CORNER);
  pages.polygons.pop_back();
  EXPECT_EQ(diced(pages.mesh()).mesh->normals_domain, Domain::POINT);
}

TEST(DiceMeshLimits, CutsOfEdgesCountToo) {
  Cage grid;
  constexpr int32_t kSide = 60;
  for (int32_t i = 0; i < kSide * kSide; ++i)
    grid.points.push_back({static_cast<float>(i % kSide), static_cast<float>(i / kSide), 0.0f});
  for (int32_t y = 0; y + 1 < kSide; ++y)
    for (int32_t x = 0; x + 1 < kSide; ++x) {
      const int32_t p = x + kSide * y;
      grid.polygons.push_back({p, p + 1, p + 1 + kSide, p + kSide});
    }
  DicingView view = test::close_view();
  view.most_levels = 20;
  // A million to each edge at first: terabytes, if they were all made.
  const DicedMesh result = diced(grid.mesh([](MeshInput& input) { input.subdivision->length = 1e-6f; }), view, 100000);
  EXPECT_LE(result.mesh->triangle_count(), 100000u);
  EXPECT_NE(result.warning, "");
}

}  // namespace
}  // namespace cistern
