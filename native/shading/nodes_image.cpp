#include "shading/nodes_image.h"

namespace cistern {
namespace {

constexpr int kProjectionMask = 0xff;
constexpr int kBoxBlendShift = 8, kBoxBlendMask = 0xff;
constexpr int kKeepMultipliedBit = 1 << 16;

enum Projection : int { kFlat, kBox, kSphere, kTube };
enum EnvironmentProjection : int { kEquirectangular, kMirrorBall, kHorizon };

/// Null for a missing image.
const Image* find_image(const NodeContext& c, int32_t index) {
  if (index < 0) return nullptr;
  const int handle = c.program.images[static_cast<size_t>(index)];
  return handle < 0 ? nullptr : c.scene.images[static_cast<size_t>(handle)].get();
}

/// The image of the tile that `uv` lies in, and `uv` in that tile; null for a missing tile.
const Image* find_tile(const NodeContext& c, int32_t table, Vec2& uv) {
  const std::vector<int>& tiles = c.program.tile_tables[static_cast<size_t>(table)];
  constexpr int kRows = kMaxTiles / kTilesInRow;
  if (!(uv.x > -1.0f && uv.y > -1.0f && uv.x < float{kTilesInRow} && uv.y < float{kRows})) return nullptr;
  const int column = static_cast<int>(uv.x), row = static_cast<int>(uv.y);
  const int tile = kTilesInRow * row + column;
  uv = {uv.x - static_cast<float>(column), uv.y - static_cast<float>(row)};
  return tile < static_cast<int>(tiles.size()) ? find_image(c, tiles[static_cast<size_t>(tile)]) : nullptr;
}

Texel missing_image() { return {Rgb{1.0f, 0.0f, 1.0f}, 1.0f}; }

Vec2 sphere_coordinates(Vec3 p) {
  const float l = length(p);
  if (!(l > 0.0f)) return {};
  const float u = p.x == 0.0f && p.y == 0.0f ? 0.0f : 0.5f - std::atan2(p.x, p.y) * (0.5f * kInvPi);
  return {u, 1.0f - std::acos(std::clamp(p.z / l, -1.0f, 1.0f)) * kInvPi};
}

Vec2 tube_coordinates(Vec3 p) {
  if (p.x == 0.0f && p.y == 0.0f) return {};
  return {0.5f - std::atan2(p.x, p.y) * (0.5f * kInvPi), 0.5f * (p.z + 1.0f)};
}

/// Weights of the three axes of a box projection, from |n| scaled to sum 1. The triangle of such n is cut into three
/// corners with one axis, three borders with two and, with blending, a middle with all three.
Vec3 box_weights(Vec3 n, float blend) {
  const float limit = 0.5f * (1.0f + blend);
  if (n.x > limit * (n.x + n.y) && n.x > limit * (n.x + n.z)) return {1.0f, 0.0f, 0.0f};
  if (n.y > limit * (n.x + n.y) && n.y > limit * (n.y + n.z)) return {0.0f, 1.0f, 0.0f};
  if (n.z > limit * (n.x + n.z) && n.z > limit * (n.y + n.z)) return {0.0f, 0.0f, 1.0f};
  if (!(blend > 0.0f)) return {1.0f, 0.0f, 0.0f};
  const auto share = [blend](float a, float b) { return clamp01((a / (a + b) - 0.5f * (1.0f - blend)) / blend); };
  if (n.z < (1.0f - limit) * (n.y + n.x)) {
    const float x = share(n.x, n.y);
    return {x, 1.0f - x, 0.0f};
  }
  if (n.x < (1.0f - limit) * (n.y + n.z)) {
    const float y = share(n.y, n.z);
    return {0.0f, y, 1.0f - y};
  }
  if (n.y < (1.0f - limit) * (n.x + n.z)) {
    const float x = share(n.x, n.z);
    return {x, 0.0f, 1.0f - x};
  }
  const auto middle = [limit](float a) { return ((2.0f - limit) * a + (limit - 1.0f)) / (2.0f * limit - 1.0f); };
  return {middle(n.x), middle(n.y), middle(n.z)};
}

/// `look_up` gives the texel at an image point.
template <class LookUp>
[[gnu::noinline]] Texel box_lookup(const NodeContext& c, Vec3 p, Vec3 normal, float blend, LookUp&& look_up) {
  const Vec3 n = c.is_environment ? normal : c.instance().object_to_world.transposed_vector(normal);
  const Vec3 magnitude{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  const Vec3 weight = box_weights(magnitude / (magnitude.x + magnitude.y + magnitude.z), blend);
  Texel sum{Rgb{}, 0.0f};
  const auto add = [&](float w, float u, float v) {
    if (w <= 0.0f) return;
    const Texel t = look_up({u, v});
    sum.color += w * t.color;
    sum.alpha += w * t.alpha;
  };
  // turned so that no side shows the image mirrored
  add(weight.x, n.x < 0.0f ? 1.0f - p.y : p.y, p.z);
  add(weight.y, n.y > 0.0f ? 1.0f - p.x : p.x, p.z);
  add(weight.z, n.z > 0.0f ? 1.0f - p.y : p.y, p.x);
  return sum;
}

float box_blend(const int32_t* parameters) {
  return 0.01f * static_cast<float>((parameters[3] >> kBoxBlendShift) & kBoxBlendMask);
}

/// Flat, sphere or tube.
Vec2 projected(const int32_t* parameters, Vec3 vector) {
  const Vec3 centered = 2.0f * vector - Vec3{1.0f, 1.0f, 1.0f};
  switch (parameters[3] & kProjectionMask) {
    case kSphere:
      return sphere_coordinates(centered);
    case kTube:
      return tube_coordinates(centered);
    default:
      return {vector.x, vector.y};
  }
}

/// At an image point of `image`, which may not be there.
Texel texel_at(const Image* image, Vec2 uv, const int32_t* parameters) {
  if (image == nullptr) return missing_image();
  const ColorAlpha color_alpha = parameters[3] & kKeepMultipliedBit ? ColorAlpha::MULTIPLIED : ColorAlpha::DIVIDED;
  return lookup_image(*image, uv.x, uv.y, static_cast<Interpolation>(parameters[1]),
                      static_cast<Extension>(parameters[2]), color_alpha);
}

/// `find` gives the image at an image point, and the point in it; null for one that is not there.
template <class Find>
Texel image_lookup(const NodeContext& c, const int32_t* parameters, Vec3 vector, Vec3 normal, Find&& find) {
  const auto look_up = [&](Vec2 uv) {
    const Image* image = find(uv);
    return texel_at(image, uv, parameters);
  };
  if ((parameters[3] & kProjectionMask) == kBox) return box_lookup(c, vector, normal, box_blend(parameters), look_up);
  Vec2 uv = projected(parameters, vector);
  const Image* image = find(uv);
  return texel_at(image, uv, parameters);
}

}  // namespace

Texel image_node(const NodeContext& c, const int32_t* parameters, Vec3 vector, Vec3 normal) {
  const Image* image = find_image(c, parameters[0]);
  return image_lookup(c, parameters, vector, normal, [image](Vec2&) { return image; });
}

Texel tiled_image_node(const NodeContext& c, const int32_t* parameters, Vec3 vector, Vec3 normal) {
  return image_lookup(c, parameters, vector, normal, [&](Vec2& uv) { return find_tile(c, parameters[0], uv); });
}

Texel environment_image_node(const NodeContext& c, const int32_t* parameters, Vec3 direction) {
  const Image* image = find_image(c, parameters[0]);
  if (image == nullptr) return missing_image();
  const auto interpolation = static_cast<Interpolation>(parameters[1]);
  if (parameters[2] == kEquirectangular) return lookup_equirectangular(*image, direction, interpolation);
  if (parameters[2] == kHorizon) return lookup_horizon(*image, direction, interpolation);
  // A mirror ball seen from -y: the image point is the half vector of the direction and the view.
  Vec3 d = normalize_or(direction, {});
  d.y -= 1.0f;
  const float divisor = 2.0f * safe_sqrt(-0.5f * d.y);
  if (divisor > 0.0f) d = d / divisor;
  return lookup_image(*image, 0.5f * (d.x + 1.0f), 0.5f * (d.z + 1.0f), interpolation, Extension::REPEAT,
                      ColorAlpha::MULTIPLIED);
}

}  // namespace cistern
