#include "film/surface_passes.h"

namespace cistern {

namespace {

constexpr SurfaceLayer kMist{SurfaceLayer::Kind::MIST, 1}, kUv{SurfaceLayer::Kind::UV, 3};

}  // namespace

std::optional<SurfaceLayer> find_surface_layer(const std::string& name) {
  if (name == "Mist") return kMist;
  if (name == "UV") return kUv;
  return std::nullopt;
}

std::string name_of(const SurfaceLayer& layer) { return layer == kMist ? "Mist" : "UV"; }

std::vector<SurfaceLayer> layers_of(const SurfacePasses& passes) {
  std::vector<SurfaceLayer> layers;
  if (passes.mist) layers.push_back(kMist);
  if (passes.uv) layers.push_back(kUv);
  return layers;
}

void keep(const SurfaceLayer& layer, SurfacePasses& passes) {
  switch (layer.kind) {
    case SurfaceLayer::Kind::MIST:
      passes.mist = true;
      break;
    case SurfaceLayer::Kind::UV:
      passes.uv = true;
      break;
  }
}

}  // namespace cistern
