#include "film/surface_film.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "shading/mesh_interpolation.h"
#include "transport/camera_ray.h"

namespace cistern {
namespace {

/// Surfaces that let more than the rest through are not the first seen: Cycles' default pass_alpha_threshold.
constexpr float kLeastAlpha = 0.5f;
constexpr size_t kUvChannels = 3;

/// (u, v, 1) of the map that is rendered; 0 on a mesh without one.
Vec3 rendered_uv(const Scene& scene, const SurfacePoint& point) {
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(scene.instances[point.instance].mesh)];
  const int map = find_first_uv_map(mesh);
  if (map < 0) return {};
  const Vec3 uv = interpolate_attribute(mesh, point.triangle, point.barycentric, map).value;
  return is_finite(uv) ? Vec3{uv.x, uv.y, 1.0f} : Vec3{};
}

std::vector<float> means(const std::vector<float>& sums, const std::vector<uint32_t>& counts) {
  const size_t channels = sums.size() / counts.size();
  std::vector<float> result(sums.size());
  for (size_t i = 0; i < sums.size(); ++i) {
    const uint32_t count = counts[i / channels];
    result[i] = count > 0 ? sums[i] / static_cast<float>(count) : 0.0f;
  }
  return result;
}

}  // namespace

SurfaceFilm::SurfaceFilm(const SurfacePasses& passes, int width, int height) : passes_(passes), width_(width) {
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  samples_.assign(pixels, 0);
  if (passes.mist) clear_view_.assign(pixels, 0.0f);
  if (passes.uv) uv_.assign(kUvChannels * pixels, 0.0f);
}

/// 0 before the range, 1 behind it.
float SurfaceFilm::mist_of(const Camera& camera, Vec3 position) const {
  const MistRange& range = passes_.mist_range;
  const float distance = camera.type == CameraType::ORTHOGRAPHIC
                             ? std::abs(camera_depth(camera, position))
                             : length(position - camera.camera_to_world.translation);
  const float share = range.depth > 0.0f ? clamp01((distance - range.start) / range.depth) : 0.0f;
  return std::pow(share, range.falloff);
}

void SurfaceFilm::add(uint32_t pixel, const Scene& scene, std::span<const SeenSurface> seen) {
  ++samples_[pixel];
  bool is_found = false;
  for (const SeenSurface& surface : seen) {
    if (surface.is_environment || surface.is_held_out) continue;
    if (passes_.mist)
      clear_view_[pixel] += (1.0f - mist_of(scene.camera, surface.point.position)) * surface.contribution;
    if (is_found || surface.alpha < kLeastAlpha) continue;
    is_found = true;
    add_first(pixel, scene, surface);
  }
}

void SurfaceFilm::add_first(uint32_t pixel, const Scene& scene, const SeenSurface& seen) {
  if (!passes_.uv) return;
  const Vec3 uv = rendered_uv(scene, seen.point);
  float* sum = &uv_[kUvChannels * pixel];
  sum[0] += uv.x, sum[1] += uv.y, sum[2] += uv.z;
}

std::vector<float> SurfaceFilm::resolve(const SurfaceLayer& layer) const {
  switch (layer.kind) {
    case SurfaceLayer::Kind::MIST: {
      if (!passes_.mist) break;
      std::vector<float> mist = means(clear_view_, samples_);
      for (size_t i = 0; i < mist.size(); ++i) mist[i] = samples_[i] > 0 ? clamp01(1.0f - mist[i]) : 0.0f;
      return mist;
    }
    case SurfaceLayer::Kind::UV:
      if (!passes_.uv) break;
      return means(uv_, samples_);
  }
  throw Error("pass", "was not enabled for this render");
}

size_t SurfaceFilm::memory_bytes() const { return (samples_.size() + clear_view_.size() + uv_.size()) * sizeof(float); }

}  // namespace cistern
