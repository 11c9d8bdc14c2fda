#include <cmath>

#include "base/parallel.h"
#include "base/warp.h"
#include "render/opening_search.h"
#include "shading/material.h"
#include "transport/transmittance.h"

namespace cistern {
namespace {

constexpr uint32_t kStream = 0x74726961;
constexpr uint32_t kWalks = 512;
constexpr int kSamples = 16;     // of the light at each vertex
constexpr double kAlbedo = 0.5;  // of each vertex
/// What a sample takes through portals, over one without: where there are other lights, and where light samples were
/// not needed. (Rooms of the everyday benchmark and three of others' files: 1.04 to 1.12, 1.3 to 1.65.)
constexpr double kCost = 1.1, kCostWithoutLights = 1.5;
/// Variance times cost must be lower by this factor, or chance would decide.
constexpr double kLeastGain = 1.05;

/// What a BSDF sample finds of the light that is sampled too, but for lamps: those it leaves to light samples.
double find_light(const SkyWalks& walks, const LightSet& lights, const WalkVertex& v, Vec3 wi, const PathState& path) {
  const Scene& scene = walks.context().scene;
  const float bsdf_pdf = std::max(dot(wi, v.normal), 0.0f) / kPi;
  const auto weight = [&](std::optional<uint32_t> emitter, float pdf) {
    return emitter ? power_heuristic(bsdf_pdf, lights.pmf(*emitter, v.position, v.normal) * pdf) : 1.0f;
  };
  if (const Rgb share = walks.sky_share(v, wi); !is_black(share)) {
    const auto sky = lights.environment_emitter();
    const Rgb arriving = evaluate_environment(scene, wi, path) * share;
    return luminance(arriving) * weight(sky, lights.environment_pdf(wi, v.position));
  }
  const Ray ray{v.origin, wi, 0.0f, INFINITY, v.leaves};
  const std::optional<Hit> hit = walks.context().accel.intersect(ray, path.ray_kind);
  if (!hit) return 0.0;
  const SurfacePoint point = make_surface_point(scene, ray, *hit);
  const Rgb emission = evaluate_emission(scene, point, path, &walks.context().accel);
  if (is_black(emission)) return 0.0;
  const auto emitter = lights.emitter_of(hit->instance, hit->triangle);
  return luminance(emission) * weight(emitter, emitter ? lights.surface_pdf(point, v.position) : 0.0f);
}

/// A sample of the light that a white diffuse surface reflects, by a light and a BSDF sample.
double sample_light(const SkyWalks& walks, const LightSet& lights, const WalkVertex& v, Rng& rng) {
  PathState path;
  path.ray_kind = kVisibleToDiffuse;
  path.depth = 1;
  const double u_choice = rng.next_double();
  const Vec2 u_light = rng.next_vec2(), u_direction = rng.next_vec2();
  double sum = find_light(walks, lights, v, Frame(v.normal).to_world(square_to_cosine_hemisphere(u_direction)), path);
  const auto choice = lights.choose(v.position, v.normal, u_choice, u_light);
  const auto light = choice ? lights.evaluate(choice->sample, v.position, path) : std::nullopt;
  const float cosine = light ? dot(light->wi, v.normal) : 0.0f;
  if (!(cosine > 0.0f)) return sum;
  const float pdf = choice->pmf * light->pdf, bsdf = cosine / kPi;
  const float weight = lights.lamp_of(choice->sample.emitter) ? 1.0f : power_heuristic(pdf, bsdf);
  Rgb arriving = light->radiance;
  if (light->casts_shadow) arriving *= transmittance(walks.context(), v.origin, v.leaves, 0.0f, *light, path);
  return sum + luminance(arriving) * bsdf * weight / pdf;
}

struct Moments {
  double mean = 0.0, variance = 0.0;
};

std::vector<Moments> sample_vertices(const SkyWalks& walks, const LightSet& lights,
                                     std::span<const WalkVertex> vertices, const std::function<bool()>& is_stopped) {
  std::vector<Moments> result(vertices.size());
  parallel_blocks(vertices.size(), 16, [&](size_t, size_t begin, size_t end) {
    const FlushDenormals flush;
    for (size_t i = begin; i < end; ++i) {
      if (is_stopped && is_stopped()) return;
      Rng rng(0, static_cast<uint32_t>(i), 1, kStream);
      double sum = 0.0, squares = 0.0;
      for (int j = 0; j < kSamples; ++j) {
        const double light = sample_light(walks, lights, vertices[i], rng);
        if (!std::isfinite(light)) continue;
        sum += light;
        squares += light * light;
      }
      result[i] = {sum / kSamples, (squares - sum * sum / kSamples) / (kSamples - 1)};
    }
  });
  return result;
}

/// What a walk brings to its pixel: the sum over its vertices, of which each reflects a part.
struct WalkLight {
  double direct = 0.0, indirect = 0.0;  // means: of its first vertex, and of the others
  double variance = 0.0;
};

std::vector<WalkLight> sum_walks(std::span<const Moments> vertices, std::span<const size_t> begins) {
  std::vector<WalkLight> walks;
  for (size_t w = 0; w + 1 < begins.size(); ++w) {
    WalkLight& light = walks.emplace_back();
    double throughput = 1.0;
    for (size_t i = begins[w]; i < begins[w + 1]; ++i, throughput *= kAlbedo) {
      (i == begins[w] ? light.direct : light.indirect) += throughput * vertices[i].mean;
      light.variance += throughput * throughput * vertices[i].variance;
    }
  }
  return walks;
}

}  // namespace

bool openings_pay(const SkyWalks& walks, const LightSet& without, const LightSet& with,
                  const std::function<bool()>& is_stopped) {
  const SkyWalks::Walks found = walks.walk(0, kWalks, kStream, is_stopped);
  const auto before = sum_walks(sample_vertices(walks, without, found.vertices, is_stopped), found.begins);
  const auto after = sum_walks(sample_vertices(walks, with, found.vertices, is_stopped), found.begins);
  if (is_stopped && is_stopped()) return false;
  double indirect = 0.0;  // on average: that of a walk depends on where chance led it
  for (size_t i = 0; i < before.size(); ++i)
    indirect += 0.5 * (before[i].indirect + after[i].indirect) / static_cast<double>(before.size());
  double variance_before = 0.0, variance_after = 0.0;  // over the square of the pixel's light
  for (size_t i = 0; i < before.size(); ++i) {
    const double pixel = 0.5 * (before[i].direct + after[i].direct) + indirect;
    if (!(pixel > 0.0)) continue;
    variance_before += before[i].variance / (pixel * pixel);
    variance_after += after[i].variance / (pixel * pixel);
  }
  const double cost = without.is_empty() ? kCostWithoutLights : kCost;
  return kLeastGain * cost * variance_after < variance_before;
}

}  // namespace cistern
