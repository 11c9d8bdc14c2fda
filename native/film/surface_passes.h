#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "film/cryptomatte.h"

namespace cistern {

/// How far away Mist begins and ends, in metres along camera rays, and the power of the fraction in between.
struct MistRange {
  float start = 5.0f, depth = 25.0f, falloff = 2.0f;
  friend bool operator==(const MistRange&, const MistRange&) = default;
};

/// A pass that materials write themselves, by name.
struct AovPass {
  std::string name;
  bool is_color = true;
  int channels() const { return is_color ? 4 : 1; }
  friend bool operator==(const AovPass&, const AovPass&) = default;
};

/// What is to be kept of the surfaces that camera rays meet, besides the passes of Film.
struct SurfacePasses {
  bool mist = false, uv = false, motion = false, occlusion = false, roughness = false;
  MistRange mist_range;
  float occlusion_distance = 10.0f;  // metres, beyond which nothing occludes
  std::vector<AovPass> aovs;
  std::array<int, kMatteKinds> matte_levels{};  // by MatteKind: pictures of two shares each

  bool any() const;
  friend bool operator==(const SurfacePasses&, const SurfacePasses&) = default;
};

/// One picture of a SurfaceFilm.
struct SurfaceLayer {
  enum class Kind : uint8_t { MIST, UV, VECTOR, OCCLUSION, ROUGHNESS, AOV, MATTE };
  Kind kind;
  int channels;
  AovPass aov{};
  MatteKind matte{};
  int level = 0;  // of a matte: two shares from rank 2 * level
  friend bool operator==(const SurfaceLayer&, const SurfaceLayer&) = default;
};

inline constexpr int kMaxMatteLevels = 8;

/// The layer called `name`; empty if no SurfacePasses can have it. Mist, UV, Vector, Ambient Occlusion,
/// Roughness, "AOV COLOR ..." and "AOV VALUE ..." with the name that materials know, CryptoObject00 to CryptoObject07,
/// and CryptoMaterial and CryptoAsset alike.
std::optional<SurfaceLayer> find_surface_layer(const std::string& name);
std::string name_of(const SurfaceLayer& layer);
/// All layers of these passes.
std::vector<SurfaceLayer> layers_of(const SurfacePasses& passes);
/// Adds it to what is to be kept; of mattes with all levels before it.
void keep(const SurfaceLayer& layer, SurfacePasses& passes);

}  // namespace cistern
