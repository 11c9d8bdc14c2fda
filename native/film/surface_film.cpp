#include "film/surface_film.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "shading/material.h"
#include "shading/mesh_interpolation.h"
#include "shading/nodes_rays.h"
#include "transport/camera_ray.h"

namespace cistern {
namespace {

/// Surfaces that let more than the rest through are not the first seen: Cycles' default pass_alpha_threshold.
constexpr float kLeastAlpha = 0.5f;
constexpr size_t kUvChannels = 3, kMotionChannels = 4;
constexpr size_t kSharesOfLevel = 2;

/// (u, v, 1) of the map that is rendered; 0 on a mesh without one.
Vec3 rendered_uv(const Scene& scene, const SurfacePoint& point) {
  const Mesh& mesh = *scene.meshes[static_cast<size_t>(scene.instances[point.instance].mesh)];
  const int map = mesh.first_uv_map();
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

/// Where a point of a surface is in another frame, in object space; where that is not known, where it is now.
Vec3 position_then(const Scene& scene, const MotionStep& then, const SurfacePoint& point) {
  const int handle = scene.instances[point.instance].mesh;
  const Mesh& shown = *scene.meshes[static_cast<size_t>(handle)];
  const Vec3 now = interpolate_position(shown, point.triangle, point.barycentric);
  const auto known = then.positions.find(scene.undisplaced(handle));
  // Diced meshes have other points, displaced ones more of them where normals differ.
  if (known == then.positions.end() || shown.dicing || shown.is_strands()) return now;
  const Mesh& undisplaced = *scene.meshes[static_cast<size_t>(known->first)];
  if (known->second.size() != undisplaced.positions.size()) return now;
  const std::array<float, 3> weights{1.0f - point.barycentric.x - point.barycentric.y, point.barycentric.x,
                                     point.barycentric.y};
  Vec3 way;
  for (size_t j = 0; j < 3; ++j) {
    const size_t vertex = undisplaced.vertices[point.triangle][j];
    way += weights[j] * (known->second[vertex] - undisplaced.positions[vertex]);
  }
  return is_finite(way) ? now + way : now;
}

/// Of a surface, by MatteKind.
std::array<float, kMatteKinds> matte_ids(const Scene& scene, const SurfacePoint& point) {
  const ObjectLabel& label = scene.object_labels[static_cast<size_t>(scene.instances[point.instance].object)];
  const float material = point.material < 0 ? 0.0f : scene.materials[static_cast<size_t>(point.material)]->matte;
  return {label.matte, material, label.asset_matte};
}

}  // namespace

SurfaceFilm::SurfaceFilm(const SurfacePasses& passes, int width, int height, Vec2 frame_size)
    : passes_(passes), width_(width), frame_size_(frame_size) {
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  samples_.assign(pixels, 0);
  if (passes.mist) clear_view_.assign(pixels, 0.0f);
  if (passes.occlusion) open_.assign(pixels, 0.0f);
  if (passes.roughness) roughness_.assign(pixels, 0.0f);
  if (passes.uv) uv_.assign(kUvChannels * pixels, 0.0f);
  if (passes.motion) {
    motion_.assign(kMotionChannels * pixels, 0.0f);
    moving_.assign(pixels, 0);
  }
  for (const AovPass& aov : passes.aovs) {
    aov_hashes_.push_back(attribute_name_hash(aov.name));
    aovs_.emplace_back(static_cast<size_t>(aov.channels()) * pixels, 0.0f);
  }
  for (size_t kind = 0; kind < mattes_.size(); ++kind)
    mattes_[kind].resize(kSharesOfLevel * static_cast<size_t>(passes.matte_levels[kind]) * pixels);
  has_mattes_ = std::ranges::any_of(mattes_, [](const auto& mattes) { return !mattes.empty(); });
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

void SurfaceFilm::add(uint32_t pixel, const Scene& scene, std::span<const SeenSurface> seen, const Accel* accel) {
  const Sample sample{pixel, {pixel, samples_[pixel]++}};
  bool is_found = false;
  for (const SeenSurface& surface : seen) {
    const bool is_passed = surface.is_held_out && &surface != &seen.back();
    if (!is_found && !is_passed && !aovs_.empty()) add_aovs(sample, scene, surface, accel);
    if (surface.is_environment || surface.is_held_out) continue;
    if (passes_.mist)
      sample.rounding.add((1.0f - mist_of(scene.camera, surface.point.position)) * surface.contribution,
                          clear_view_[pixel]);
    if (passes_.occlusion) add_occlusion(sample, surface, accel);
    if (has_mattes_) add_mattes(sample, scene, surface);
    if (is_found || (surface.alpha < kLeastAlpha && scene.camera.type != CameraType::SHEET)) continue;
    is_found = true;
    if (passes_.roughness) sample.rounding.add(surface.clear * surface.roughness, roughness_[pixel]);
    if (passes_.uv) add_uv(sample, scene, surface);
    if (passes_.motion) add_motion(sample, scene, surface.point);
  }
}

void SurfaceFilm::add_occlusion(const Sample& sample, const SeenSurface& seen, const Accel* accel) {
  if (!(seen.contribution > 0.0f)) return;
  const bool can_occlude = accel != nullptr && passes_.occlusion_distance > 0.0f;
  const float open = can_occlude
                         ? ambient_occlusion(*accel, seen.point, {static_cast<int>(kLanes), false, false, false},
                                             passes_.occlusion_distance, seen.normal)
                         : 1.0f;
  sample.rounding.add(open * seen.contribution, open_[sample.pixel]);
}

void SurfaceFilm::add_uv(const Sample& sample, const Scene& scene, const SeenSurface& seen) {
  const Vec3 uv = seen.clear * rendered_uv(scene, seen.point);
  for (size_t i = 0; i < kUvChannels; ++i)
    sample.rounding.add(uv[static_cast<int>(i)], uv_[kUvChannels * sample.pixel + i]);
}

/// By how many pixels it was elsewhere a frame before, and by how many it will have moved from there to here a frame
/// later. [Cycles, primitive_motion_vector]
void SurfaceFilm::add_motion(const Sample& sample, const Scene& scene, const SurfacePoint& point) {
  ++moving_[sample.pixel];
  const std::optional<Vec2> now = project(scene.camera, point.position);
  float* sum = &motion_[kMotionChannels * sample.pixel];
  for (size_t step = 0; step < scene.motion.size(); ++step) {
    if (!scene.motion[step]) continue;
    const MotionStep& then = *scene.motion[step];
    const Vec3 place = then.object_to_world[point.instance].point(position_then(scene, then, point));
    const std::optional<Vec2> there = project(then.camera, place);
    if (!now || !there) continue;
    const float sign = step == 0 ? 1.0f : -1.0f;
    sample.rounding.add(sign * (there->x - now->x) * frame_size_.x, sum[2 * step]);
    sample.rounding.add(sign * (there->y - now->y) * frame_size_.y, sum[2 * step + 1]);
  }
}

void SurfaceFilm::add_aovs(const Sample& sample, const Scene& scene, const SeenSurface& seen, const Accel* accel) {
  const auto add = [&](const AovValues& values) {
    for (size_t i = 0; i < aovs_.size(); ++i) {
      if (aov_hashes_[i] != values.name_hash) continue;
      float* sum = &aovs_[i][static_cast<size_t>(passes_.aovs[i].channels()) * sample.pixel];
      if (!passes_.aovs[i].is_color) {
        sample.rounding.add(seen.clear * values.value, sum[0]);
        continue;
      }
      sample.rounding.add(seen.clear * values.color.r, sum[0]);
      sample.rounding.add(seen.clear * values.color.g, sum[1]);
      sample.rounding.add(seen.clear * values.color.b, sum[2]);
      sample.rounding.add(seen.clear, sum[3]);
    }
  };
  seen.is_environment ? evaluate_environment_aovs(scene, -seen.point.wo, seen.path, std::ref(add))
                      : evaluate_aovs(scene, seen.point, seen.path, std::ref(add), accel);
}

void SurfaceFilm::add_mattes(const Sample& sample, const Scene& scene, const SeenSurface& seen) {
  const float weight = seen.throughput * seen.alpha;
  if (!(weight > 0.0f)) return;
  const std::array<float, kMatteKinds> ids = matte_ids(scene, seen.point);
  for (size_t kind = 0; kind < mattes_.size(); ++kind) {
    const size_t slots = kSharesOfLevel * static_cast<size_t>(passes_.matte_levels[kind]);
    if (slots > 0 && ids[kind] != 0.0f)
      add_matte({&mattes_[kind][slots * sample.pixel], slots}, ids[kind], weight, sample.rounding);
  }
}

std::vector<float> SurfaceFilm::resolve(const SurfaceLayer& layer) const {
  switch (layer.kind) {
    case SurfaceLayer::Kind::MIST: {
      if (!passes_.mist) break;
      std::vector<float> mist = means(clear_view_, samples_);
      for (size_t i = 0; i < mist.size(); ++i) mist[i] = samples_[i] > 0 ? clamp01(1.0f - mist[i]) : 0.0f;
      return mist;
    }
    case SurfaceLayer::Kind::OCCLUSION: {
      if (!passes_.occlusion) break;
      const std::vector<float> open = means(open_, samples_);
      std::vector<float> grey;
      grey.reserve(static_cast<size_t>(layer.channels) * open.size());
      for (const float value : open) grey.insert(grey.end(), static_cast<size_t>(layer.channels), value);
      return grey;
    }
    case SurfaceLayer::Kind::ROUGHNESS:
      if (!passes_.roughness) break;
      return means(roughness_, samples_);
    case SurfaceLayer::Kind::UV:
      if (!passes_.uv) break;
      return means(uv_, samples_);
    case SurfaceLayer::Kind::VECTOR:
      if (!passes_.motion) break;
      return means(motion_, moving_);
    case SurfaceLayer::Kind::AOV: {
      const auto found = std::ranges::find(passes_.aovs, layer.aov);
      if (found == passes_.aovs.end()) break;
      return means(aovs_[static_cast<size_t>(found - passes_.aovs.begin())], samples_);
    }
    case SurfaceLayer::Kind::MATTE:
      if (layer.level >= passes_.matte_levels[static_cast<size_t>(layer.matte)]) break;
      return resolve_mattes(static_cast<size_t>(layer.matte), layer.level);
  }
  throw Error("pass '" + name_of(layer) + "'", "was not enabled for this render");
}

std::span<const MatteShare> SurfaceFilm::mattes_of(size_t kind, size_t pixel) const {
  const size_t slots = kSharesOfLevel * static_cast<size_t>(passes_.matte_levels[kind]);
  return {&mattes_[kind][slots * pixel], slots};
}

std::vector<float> SurfaceFilm::resolve_mattes(size_t kind, int level) const {
  std::vector<float> result;
  result.reserve(2 * kSharesOfLevel * samples_.size());
  std::vector<MatteShare> ranked;
  for (size_t pixel = 0; pixel < samples_.size(); ++pixel) {
    const std::span<const MatteShare> mattes = mattes_of(kind, pixel);
    ranked.assign(mattes.begin(), mattes.end());
    rank_mattes(ranked);
    for (size_t i = 0; i < kSharesOfLevel; ++i) {
      const MatteShare& share = ranked[kSharesOfLevel * static_cast<size_t>(level) + i];
      result.push_back(share.id);
      result.push_back(samples_[pixel] > 0 ? share.weight / static_cast<float>(samples_[pixel]) : 0.0f);
    }
  }
  return result;
}

size_t SurfaceFilm::memory_bytes() const {
  size_t bytes = (samples_.size() + clear_view_.size() + open_.size() + roughness_.size() + uv_.size() +
                  motion_.size() + moving_.size()) *
                 sizeof(float);
  for (const std::vector<float>& aov : aovs_) bytes += aov.size() * sizeof(float);
  for (const std::vector<MatteShare>& mattes : mattes_) bytes += mattes.size() * sizeof(MatteShare);
  return bytes;
}

}  // namespace cistern
