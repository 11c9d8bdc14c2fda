#pragma once

#include "shading/bsdf.h"

namespace cistern {

/// How light left the first vertex of its path, where it was scattered for the first time: as PassKind, or by a
/// medium.
inline constexpr size_t kLightKinds = kPassKinds + 1, kVolumeLight = kPassKinds;

/// What a path found, by the kind of its first scattering as render passes want it: `direct` after one scattering,
/// whatever that was, and `indirect` after more. So mirrors have direct light, unlike PathRecord::direct, which is that
/// of rough surfaces. All of it, with `emission` and `environment`, which nothing has scattered, adds up to Combined;
/// but for an environment that a transparent film leaves out of that.
/// [Cycles, kernel/film/light_passes.h]
struct LightByKind {
  std::array<Rgb, kLightKinds> direct, indirect;
  Rgb emission, environment;
  KindColors color;  // albedo of what the camera sees, through transparent surfaces as well

  void add_direct(const KindColors& light) { add(direct, light); }
  void add_indirect(const KindColors& light) { add(indirect, light); }

 private:
  static void add(std::array<Rgb, kLightKinds>& sum, const KindColors& light) {
    for (size_t kind = 0; kind < light.size(); ++kind) sum[kind] += light[kind];
  }
};

inline KindColors operator*(const KindColors& colors, Rgb factor) {
  KindColors result;
  for (size_t kind = 0; kind < colors.size(); ++kind) result[kind] = colors[kind] * factor;
  return result;
}
inline KindColors& operator+=(KindColors& sum, const KindColors& colors) {
  for (size_t kind = 0; kind < colors.size(); ++kind) sum[kind] += colors[kind];
  return sum;
}

}  // namespace cistern
