#include "subdivision/limit_surface.h"

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/error.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>

#include "base/parallel.h"
#include "base/srgb.h"
#include "subdivision/safe_creases.h"

namespace cistern {
namespace {

namespace Far = OpenSubdiv::Far;
namespace Bfr = OpenSubdiv::Bfr;
namespace Sdc = OpenSubdiv::Sdc;

using Cache = Bfr::SurfaceFactoryCacheThreaded<std::shared_mutex, std::shared_lock<std::shared_mutex>,
                                               std::unique_lock<std::shared_mutex>>;
using Factory = Bfr::RefinerSurfaceFactory<Cache>;
using Surface = Bfr::Surface<float>;
using PointDescriptor = Surface::PointDescriptor;

constexpr size_t kBlockSize = 1 << 10;  // places per task

Sdc::Options scheme_options(const SubdivisionCage& cage) {
  using Linear = Sdc::Options::FVarLinearInterpolation;
  constexpr Linear kLinear[] = {Sdc::Options::FVAR_LINEAR_ALL,           Sdc::Options::FVAR_LINEAR_CORNERS_ONLY,
                                Sdc::Options::FVAR_LINEAR_CORNERS_PLUS1, Sdc::Options::FVAR_LINEAR_CORNERS_PLUS2,
                                Sdc::Options::FVAR_LINEAR_BOUNDARIES,    Sdc::Options::FVAR_LINEAR_NONE};
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(cage.keeps_corners ? Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER
                                                         : Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  options.SetFVarLinearInterpolation(kLinear[static_cast<size_t>(cage.uv_smoothing)]);
  return options;
}

bool is_smooth_uv_map(const Mesh& mesh, size_t index) {
  const SubdivisionCage& cage = *mesh.cage;
  return index < cage.uv_maps && mesh.attributes[index].domain == Domain::CORNER &&
         cage.scheme == SubdivisionScheme::CATMULL_CLARK && cage.uv_smoothing != UvSmoothing::NONE;
}

/// Values of a UV map, each once for all corners of a point that share it.
struct UvValues {
  std::vector<int> by_corner;
  std::vector<Vec2> values;

  UvValues(const Mesh& mesh, size_t index) : by_corner(mesh.cage->vertices.size()) {
    const float* corners = mesh.attributes[index].values.get();
    std::unordered_multimap<uint32_t, int> known;  // by point
    for (size_t c = 0; c < by_corner.size(); ++c) {
      const uint32_t point = mesh.cage->vertices[c];
      const Vec2 uv{corners[2 * c], corners[2 * c + 1]};
      const auto [first, last] = known.equal_range(point);
      const auto same = std::find_if(first, last, [&](const auto& pair) {
        const Vec2 other = values[static_cast<size_t>(pair.second)];
        return other.x == uv.x && other.y == uv.y;
      });
      by_corner[c] = same != last ? same->second : static_cast<int>(values.size());
      if (same != last) continue;
      known.emplace(point, by_corner[c]);
      values.push_back(uv);
    }
  }
};

void ignore_error(Far::ErrorType, const char*) {}
void ignore_warning(const char*) {}

/// The attribute with its colours, but not the alpha, coded in another way.
MeshAttribute recoded(MeshAttribute attribute, size_t elements, float code(float)) {
  const auto components = static_cast<size_t>(attribute.components);
  const auto values = std::make_shared<float[]>(elements * components);
  for (size_t i = 0; i < elements * components; ++i)
    values[i] = i % components < 3 ? code(attribute.values[i]) : attribute.values[i];
  attribute.values = values;
  return attribute;
}

/// Coordinates as OpenSubdiv has them.
Vec2 to_patch(const Bfr::Parameterization& parameterization, const CagePlace& place) {
  const float uv[2] = {place.uv.x, place.uv.y};
  if (!parameterization.HasSubFaces()) return place.uv;
  float converted[2];
  parameterization.ConvertNormalizedSubFaceToCoord(static_cast<int>(place.part), uv, converted);
  return {converted[0], converted[1]};
}

}  // namespace

struct LimitSurface::Data {
  explicit Data(const Mesh& of) : mesh(of) {}

  const Mesh& mesh;
  std::vector<int> uv_channels;  // by attribute: -1 for those that are not smooth UV maps
  std::vector<UvValues> uv_values;
  std::unique_ptr<Far::TopologyRefiner> refiner;
  std::unique_ptr<Factory> factory;

  template <class Evaluate>
  void for_each_place(std::span<const CagePlace> places, const Evaluate& evaluate) const {
    parallel_blocks(places.size(), kBlockSize, [&](size_t, size_t begin, size_t end) { evaluate(begin, end); });
  }

  /// Values of `width` floats, at places in blocks; `prepare` makes the surface of a polygon.
  template <class Prepare>
  void evaluate_surfaces(std::span<const CagePlace> places, const float* control, int width, float* out,
                         const Prepare& prepare) const {
    for_each_place(places, [&](size_t begin, size_t end) {
      Surface surface;
      std::vector<float> points;
      const PointDescriptor layout(width);
      uint32_t polygon = 0;
      bool is_prepared = false;
      for (size_t i = begin; i < end; ++i) {
        const CagePlace& place = places[i];
        if (!is_prepared || polygon != place.polygon) {
          polygon = place.polygon;
          is_prepared = prepare(static_cast<int>(polygon), surface);
          if (!is_prepared) continue;
          points.resize(static_cast<size_t>(surface.GetNumPatchPoints()) * static_cast<size_t>(width));
          surface.PreparePatchPoints(control, layout, points.data(), layout);
        }
        const Vec2 uv = to_patch(surface.GetParameterization(), place);
        surface.Evaluate(&uv.x, points.data(), layout, out + i * static_cast<size_t>(width));
      }
    });
  }

  /// Straight between the corners of a polygon.
  void interpolate_straight(const MeshAttribute& attribute, std::span<const CagePlace> places, float* out) const {
    const SubdivisionCage& cage = *mesh.cage;
    const auto width = static_cast<size_t>(attribute.components);
    for_each_place(places, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const CagePlace& place = places[i];
        const size_t first = cage.offsets[place.polygon], size = cage.size(place.polygon);
        const float u = place.uv.x, v = place.uv.y;
        for (size_t k = 0; k < width; ++k) {
          const auto value = [&](size_t corner) {
            const size_t number =
                first + corner % size;  // NOLINT(clang-analyzer-core.DivideZero): never 0, see dice_mesh
            return attribute.values[(attribute.domain == Domain::POINT ? cage.vertices[number] : number) * width + k];
          };
          float at[4];
          if (size == 4) {
            for (size_t corner = 0; corner < 4; ++corner) at[corner] = value(corner);
          } else {
            float mean = 0.0f;
            for (size_t corner = 0; corner < size; ++corner) mean += value(corner) / static_cast<float>(size);
            at[0] = value(place.part);
            at[1] = 0.5f * (at[0] + value(place.part + 1));
            at[2] = mean;
            at[3] = 0.5f * (at[0] + value(place.part + size - 1));
          }
          out[i * width + k] = (1.0f - v) * ((1.0f - u) * at[0] + u * at[1]) + v * ((1.0f - u) * at[3] + u * at[2]);
        }
      }
    });
  }
};

LimitSurface::LimitSurface(const Mesh& mesh) : data_(std::make_unique<Data>(mesh)) {
  const SubdivisionCage& cage = *mesh.cage;
  std::vector<int> sizes(cage.polygon_count());
  for (size_t i = 0; i < sizes.size(); ++i) sizes[i] = static_cast<int>(cage.size(i));
  const std::vector<int> vertices(cage.vertices.begin(), cage.vertices.end());
  std::vector<int> creases;
  std::vector<float> sharpness;
  for (const size_t i : safe_creases(cage)) {
    for (const uint32_t point : cage.creases[i]) creases.push_back(static_cast<int>(point));
    sharpness.push_back(cage.crease_sharpness[i]);
  }
  const std::vector<int> sharp_vertices(cage.sharp_vertices.begin(), cage.sharp_vertices.end());

  Far::TopologyDescriptor topology;
  topology.numVertices = static_cast<int>(mesh.positions.size());
  topology.numFaces = static_cast<int>(sizes.size());
  topology.numVertsPerFace = sizes.data();
  topology.vertIndicesPerFace = vertices.data();
  topology.numCreases = static_cast<int>(sharpness.size());
  topology.creaseVertexIndexPairs = creases.data();
  topology.creaseWeights = sharpness.data();
  topology.numCorners = static_cast<int>(sharp_vertices.size());
  topology.cornerVertexIndices = sharp_vertices.data();
  topology.cornerWeights = cage.vertex_sharpness.data();
  data_->uv_channels.assign(mesh.attributes.size(), -1);
  for (size_t i = 0; i < mesh.attributes.size(); ++i) {
    if (!is_smooth_uv_map(mesh, i)) continue;
    data_->uv_channels[i] = static_cast<int>(data_->uv_values.size());
    data_->uv_values.emplace_back(mesh, i);
  }
  std::vector<Far::TopologyDescriptor::FVarChannel> channels(data_->uv_values.size());
  for (size_t i = 0; i < channels.size(); ++i) {
    channels[i].numValues = static_cast<int>(data_->uv_values[i].values.size());
    channels[i].valueIndices = data_->uv_values[i].by_corner.data();
  }
  topology.numFVarChannels = static_cast<int>(channels.size());
  topology.fvarChannels = channels.data();

  using RefinerFactory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  const auto scheme = cage.scheme == SubdivisionScheme::LINEAR ? Sdc::SCHEME_BILINEAR : Sdc::SCHEME_CATMARK;
  static std::once_flag silenced;
  std::call_once(silenced, [] {
    Far::SetErrorCallback(ignore_error);
    Far::SetWarningCallback(ignore_warning);
  });
  data_->refiner.reset(RefinerFactory::Create(topology, RefinerFactory::Options(scheme, scheme_options(cage))));
  if (data_->refiner) data_->factory = std::make_unique<Factory>(*data_->refiner);
}

LimitSurface::~LimitSurface() = default;

bool LimitSurface::exists() const { return data_->factory != nullptr; }

struct LimitSurface::Patch::Data {
  const LimitSurface::Data& surface;
  Surface vertex_surface;
  std::vector<float> points;
  Vec3 polygon_normal;
  uint32_t polygon = 0;
  bool is_prepared = false;

  void go_to(uint32_t to) {
    if (is_prepared && polygon == to) return;
    polygon = to;
    is_prepared = surface.factory->InitVertexSurface(static_cast<int>(to), &vertex_surface);
    if (!is_prepared) return;
    const PointDescriptor layout(3);
    points.resize(3 * static_cast<size_t>(vertex_surface.GetNumPatchPoints()));
    vertex_surface.PreparePatchPoints(&surface.mesh.positions.front().x, layout, points.data(), layout);
    const SubdivisionCage& cage = *surface.mesh.cage;
    const auto corner = [&](uint32_t i) { return surface.mesh.positions[cage.vertices[cage.offsets[to] + i]]; };
    polygon_normal = {};
    for (uint32_t i = 1; i + 1 < cage.size(to); ++i)
      polygon_normal += cross(corner(i) - corner(0), corner(i + 1) - corner(0));
    polygon_normal = normalize_or(polygon_normal, {0.0f, 0.0f, 1.0f});
  }
};

LimitSurface::Patch::Patch(const LimitSurface& surface) : data_(new Data{*surface.data_, {}, {}, {}}) {}
LimitSurface::Patch::~Patch() = default;

LimitSurface::Point LimitSurface::Patch::at(const CagePlace& place) {
  data_->go_to(place.polygon);
  if (!data_->is_prepared) return {};
  const Vec2 uv = to_patch(data_->vertex_surface.GetParameterization(), place);
  Vec3 position, along_u, along_v;
  data_->vertex_surface.Evaluate(&uv.x, data_->points.data(), PointDescriptor(3), &position.x, &along_u.x, &along_v.x);
  return {position, normalize_or(cross(along_u, along_v), data_->polygon_normal)};
}

std::vector<LimitSurface::Point> LimitSurface::points(std::span<const CagePlace> places) const {
  std::vector<Point> found(places.size());
  data_->for_each_place(places, [&](size_t begin, size_t end) {
    Patch patch(*this);
    for (size_t i = begin; i < end; ++i) found[i] = patch.at(places[i]);
  });
  return found;
}

MeshAttribute LimitSurface::attribute(size_t index, std::span<const CagePlace> places) const {
  const MeshAttribute& attribute = data_->mesh.attributes[index];
  const int channel = data_->uv_channels[index];
  const bool is_generated = static_cast<int>(index) == data_->mesh.generated_attribute;
  const SubdivisionCage& cage = *data_->mesh.cage;
  if (std::ranges::find(cage.encoded_colors, index) != cage.encoded_colors.end()) {
    const MeshAttribute encoded = recoded(attribute, cage.vertices.size(), linear_to_srgb_exact);
    return recoded(interpolate(encoded, places), places.size(), srgb_to_linear_exact);
  }
  if (channel < 0 && !is_generated) return interpolate(attribute, places);
  const std::shared_ptr<float[]> values =
      std::make_shared<float[]>(places.size() * static_cast<size_t>(attribute.components));
  if (is_generated) {
    data_->evaluate_surfaces(
        places, attribute.values.get(), attribute.components, values.get(),
        [&](int polygon, Surface& surface) { return data_->factory->InitVertexSurface(polygon, &surface); });
  } else {
    const UvValues& uv = data_->uv_values[static_cast<size_t>(channel)];
    data_->evaluate_surfaces(places, &uv.values.front().x, 2, values.get(), [&](int polygon, Surface& surface) {
      return data_->factory->InitFaceVaryingSurface(polygon, &surface, Bfr::SurfaceFactory::FVarID{channel});
    });
  }
  return {attribute.name, attribute.domain, attribute.components, values, attribute.name_hash};
}

MeshAttribute LimitSurface::interpolate(const MeshAttribute& attribute, std::span<const CagePlace> places) const {
  const std::shared_ptr<float[]> values =
      std::make_shared<float[]>(places.size() * static_cast<size_t>(attribute.components));
  data_->interpolate_straight(attribute, places, values.get());
  return {attribute.name, attribute.domain, attribute.components, values, attribute.name_hash};
}

}  // namespace cistern
