#include "render/sky_walks.h"

#include "base/parallel.h"
#include "base/warp.h"
#include "render/walk_start.h"
#include "transport/transmittance.h"

namespace cistern {
namespace {

constexpr uint32_t kMostVertices = 4;
constexpr size_t kBlockSize = 64;

}  // namespace

SkyWalks::SkyWalks(const Scene& scene, const Accel& accel, const Settings& settings)
    : no_lights_(std::make_shared<const Scene>(), LightSampling::UNIFORM),
      context_{scene, accel, no_lights_, settings.limits,
               pixel_footprint(scene.camera, settings.width, settings.height)},
      seed_(settings.seed) {
  context_.passes_panes = accel.has_panes() && settings.passes_panes(scene);
}

SkyWalks::Walks SkyWalks::walk(uint32_t first, uint32_t last, uint32_t stream,
                               const std::function<bool()>& is_stopped) const {
  std::vector<Walks> blocks(block_count(last - first, kBlockSize));
  parallel_blocks(last - first, kBlockSize, [&](size_t block, size_t begin, size_t end) {
    const FlushDenormals flush;
    Walks& walks = blocks[block];
    for (size_t i = begin; i < end; ++i) {
      if (is_stopped && is_stopped()) return;
      Rng rng(seed_, first + static_cast<uint32_t>(i), 0, stream);
      add_walk(rng, walks.vertices);
      walks.begins.push_back(walks.vertices.size());
    }
  });
  Walks all;
  if (is_stopped && is_stopped()) return all;
  for (const Walks& block : blocks) {
    const size_t offset = all.vertices.size();
    all.vertices.insert(all.vertices.end(), block.vertices.begin(), block.vertices.end());
    for (size_t i = 1; i < block.begins.size(); ++i) all.begins.push_back(offset + block.begins[i]);
  }
  return all;
}

void SkyWalks::add_walk(Rng& rng, std::vector<WalkVertex>& vertices) const {
  const std::optional<WalkStart> begin = start_walk(context_.scene, rng.next_vec2(), rng);
  if (!begin) return;
  Ray ray = begin->ray;
  std::optional<Hit> hit = begin->hit ? begin->hit : context_.accel.intersect(ray, kVisibleToCamera);
  for (uint32_t i = 0; hit; ++i) {
    const SurfacePoint point = make_surface_point(context_.scene, ray, *hit);
    if (!is_finite(point.position)) return;
    const Vec3 direction = Frame(point.ng).to_world(square_to_cosine_hemisphere(rng.next_vec2()));
    const Vec3 origin = offset_origin(point.position, point.clearance, point.ng, direction);
    WalkVertex& vertex =
        vertices.emplace_back(WalkVertex{point.position, point.ng, origin, direction, false, point.triangle_id()});
    vertex.sees_sky = !is_black(sky_share(vertex, direction));
    if (vertex.sees_sky || i + 1 == kMostVertices) return;
    ray = {origin, direction, 0.0f, INFINITY, vertex.leaves};
    hit = context_.accel.intersect(ray, kVisibleToDiffuse);
  }
}

Rgb SkyWalks::sky_share(const WalkVertex& from, Vec3 direction) const {
  IncidentLight light;
  light.wi = direction;
  light.distance = INFINITY;
  light.is_environment = true;
  return transmittance(context_, from.origin, from.leaves, 0.0f, light, {});
}

}  // namespace cistern
