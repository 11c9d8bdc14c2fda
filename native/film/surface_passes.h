#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cistern {

/// How far away Mist begins and ends, in metres along camera rays, and the power of the fraction in between.
struct MistRange {
  float start = 5.0f, depth = 25.0f, falloff = 2.0f;
  friend bool operator==(const MistRange&, const MistRange&) = default;
};

/// What is to be kept of the surfaces that camera rays meet, besides the passes of Film.
struct SurfacePasses {
  bool mist = false, uv = false;
  MistRange mist_range;

  bool any() const { return mist || uv; }
  friend bool operator==(const SurfacePasses&, const SurfacePasses&) = default;
};

/// One picture of a SurfaceFilm.
struct SurfaceLayer {
  enum class Kind : uint8_t { MIST, UV };
  Kind kind;
  int channels;
  friend bool operator==(const SurfaceLayer&, const SurfaceLayer&) = default;
};

/// The layer called `name`; empty if no SurfacePasses can have it.
std::optional<SurfaceLayer> find_surface_layer(const std::string& name);
std::string name_of(const SurfaceLayer& layer);
/// All layers of these passes.
std::vector<SurfaceLayer> layers_of(const SurfacePasses& passes);
/// Adds it to what is to be kept.
void keep(const SurfaceLayer& layer, SurfacePasses& passes);

}  // namespace cistern
