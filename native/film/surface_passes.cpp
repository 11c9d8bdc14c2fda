#include "film/surface_passes.h"

#include <algorithm>

namespace cistern {
namespace {

using Kind = SurfaceLayer::Kind;

// Made on demand, not as the module is loaded: nothing may run before the processor is checked.
SurfaceLayer mist_layer() { return {Kind::MIST, 1}; }
SurfaceLayer uv_layer() { return {Kind::UV, 3}; }
SurfaceLayer vector_layer() { return {Kind::VECTOR, 4}; }
SurfaceLayer occlusion_layer() { return {Kind::OCCLUSION, 3}; }
SurfaceLayer roughness_layer() { return {Kind::ROUGHNESS, 1}; }

constexpr int kMatteChannels = 4;
constexpr std::array<const char*, kMatteKinds> kMatteNames{"CryptoObject", "CryptoMaterial", "CryptoAsset"};
constexpr std::string_view kColorPrefix = "AOV COLOR ", kValuePrefix = "AOV VALUE ";

SurfaceLayer aov_layer(const AovPass& aov) { return {Kind::AOV, aov.channels(), aov}; }
SurfaceLayer matte_layer(size_t kind, int level) {
  return {Kind::MATTE, kMatteChannels, {}, static_cast<MatteKind>(kind), level};
}

/// With two digits.
std::string matte_name(size_t kind, int level) {
  std::string name = kMatteNames[kind];  // sums of strings set off a false warning of GCC 12
  name += '0';
  return name += std::to_string(level);
}

}  // namespace

bool SurfacePasses::any() const {
  const bool has_mattes = std::ranges::any_of(matte_levels, [](int levels) { return levels > 0; });
  return mist || uv || motion || occlusion || roughness || !aovs.empty() || has_mattes;
}

std::optional<SurfaceLayer> find_surface_layer(const std::string& name) {
  if (name == "Mist") return mist_layer();
  if (name == "UV") return uv_layer();
  if (name == "Vector") return vector_layer();
  if (name == "Ambient Occlusion") return occlusion_layer();
  if (name == "Roughness") return roughness_layer();
  if (name.starts_with(kColorPrefix)) return aov_layer({name.substr(kColorPrefix.size()), true});
  if (name.starts_with(kValuePrefix)) return aov_layer({name.substr(kValuePrefix.size()), false});
  for (size_t kind = 0; kind < kMatteNames.size(); ++kind)
    for (int level = 0; level < kMaxMatteLevels; ++level)
      if (name == matte_name(kind, level)) return matte_layer(kind, level);
  return std::nullopt;
}

std::string name_of(const SurfaceLayer& layer) {
  switch (layer.kind) {
    case Kind::MIST:
      return "Mist";
    case Kind::UV:
      return "UV";
    case Kind::VECTOR:
      return "Vector";
    case Kind::OCCLUSION:
      return "Ambient Occlusion";
    case Kind::ROUGHNESS:
      return "Roughness";
    case Kind::AOV:
      return std::string(layer.aov.is_color ? kColorPrefix : kValuePrefix) += layer.aov.name;
    case Kind::MATTE:
      return matte_name(static_cast<size_t>(layer.matte), layer.level);
  }
  return {};
}

std::vector<SurfaceLayer> layers_of(const SurfacePasses& passes) {
  std::vector<SurfaceLayer> layers;
  if (passes.mist) layers.push_back(mist_layer());
  if (passes.uv) layers.push_back(uv_layer());
  if (passes.motion) layers.push_back(vector_layer());
  if (passes.occlusion) layers.push_back(occlusion_layer());
  if (passes.roughness) layers.push_back(roughness_layer());
  for (const AovPass& aov : passes.aovs) layers.push_back(aov_layer(aov));
  for (size_t kind = 0; kind < passes.matte_levels.size(); ++kind)
    for (int level = 0; level < passes.matte_levels[kind]; ++level) layers.push_back(matte_layer(kind, level));
  return layers;
}

void keep(const SurfaceLayer& layer, SurfacePasses& passes) {
  switch (layer.kind) {
    case Kind::MIST:
      passes.mist = true;
      break;
    case Kind::UV:
      passes.uv = true;
      break;
    case Kind::VECTOR:
      passes.motion = true;
      break;
    case Kind::OCCLUSION:
      passes.occlusion = true;
      break;
    case Kind::ROUGHNESS:
      passes.roughness = true;
      break;
    case Kind::AOV:
      if (std::ranges::find(passes.aovs, layer.aov) == passes.aovs.end()) passes.aovs.push_back(layer.aov);
      break;
    case Kind::MATTE: {
      int& levels = passes.matte_levels[static_cast<size_t>(layer.matte)];
      levels = std::max(levels, layer.level + 1);
      break;
    }
  }
}

}  // namespace cistern
