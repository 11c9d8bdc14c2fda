#include "lights/environment_sampling.h"

#include "base/angle.h"
#include "base/parallel.h"
#include "base/warp.h"
#include "shading/material.h"

namespace cistern {

namespace {

/// Share of the samples drawn uniformly over the sphere. Compensated ones need more: smooth meshes of few faces reflect
/// light from behind their flat triangles, which BSDF samples never find and which most of the map leaves out. With
/// 0.02, variance of a smooth head under two skies was 1.9 and 2.1 times that with 0.2, which costs others 1 to 7 %.
constexpr float kUniformShare = 0.02f, kCompensatedUniformShare = 0.2f;
constexpr float kUniformPdf = 1.0f / (4.0f * kPi);
constexpr int kDefaultWidth = 512;  // of an environment without images
constexpr int kSmallestWidth = 64;
constexpr int kLargestWidth = 4096;
constexpr int kFineWidth = 1024;  // maps up to this width are filtered from twice the resolution
constexpr int kMaxSupersampling = 2;
/// Suns bring most of the light, but none to the shadows that they cast.
constexpr float kLargestSunShare = 0.75f;
/// Where less than this share of the light exceeds the mean, a map is no better than none.
constexpr float kFlat = 0.01f;
constexpr float kBelowOne = 0x1.fffffep-1f;

Vec3 direction_at(float u, float cos_theta) {
  const SineCosine azimuth = sine_cosine_of_turns(u);
  const float sine = safe_sqrt(1.0f - sqr(cos_theta));
  return {sine * azimuth.cosine, sine * azimuth.sine, cos_theta};
}

int largest_image_width(const Scene& scene, const MaterialProgram& program) {
  int width = 0;
  for (const int image : program.images) {
    if (image >= 0 && scene.images[static_cast<size_t>(image)])
      width = std::max(width, scene.images[static_cast<size_t>(image)]->width);
  }
  return width;
}

/// Whose light the sampler is made for.
PathState diffuse_path() {
  PathState path;
  path.ray_kind = kVisibleToDiffuse;
  return path;
}

float environment_luminance(const Scene& scene, Vec3 direction, const PathState& path) {
  const float value = luminance(evaluate_environment(scene, direction, path));
  return std::isfinite(value) ? std::max(value, 0.0f) : 0.0f;
}

/// Mean over a cone, on a spiral of points that share its solid angle equally.
float mean_luminance(const Scene& scene, const SkyCone& cone, const PathState& path) {
  constexpr int kPoints = 64;
  constexpr float kGoldenTurn = 0.618034f;
  float sum = 0.0f;
  for (int i = 0; i < kPoints; ++i) {
    const Vec2 u{(static_cast<float>(i) + 0.5f) / kPoints, static_cast<float>(i) * kGoldenTurn};
    sum += environment_luminance(scene, sample_cone(cone, {u.x, u.y - std::floor(u.y)}), path);
  }
  return sum / kPoints;
}

/// Luminance on a lattice of (columns) x (rows + 1) points, the first and last row at the poles; where a sun is, that
/// of the sky around it.
std::vector<float> evaluate_lattice(const Scene& scene, int columns, int rows, std::span<const SkyCone> suns) {
  std::vector<float> lattice(static_cast<size_t>(columns) * (static_cast<size_t>(rows) + 1));
  const PathState path = diffuse_path();
  parallel_blocks(static_cast<size_t>(rows) + 1, 8, [&](size_t, size_t begin, size_t end) {
    for (size_t y = begin; y < end; ++y) {
      const float cos_theta = std::cos(kPi * static_cast<float>(y) / static_cast<float>(rows));
      for (size_t x = 0; x < static_cast<size_t>(columns); ++x) {
        Vec3 direction = direction_at(static_cast<float>(x) / static_cast<float>(columns), cos_theta);
        for (const SkyCone& sun : suns) direction = outside(sun, direction);
        lattice[y * static_cast<size_t>(columns) + x] = environment_luminance(scene, direction, path);
      }
    }
  });
  return lattice;
}

/// Mean over each texel by the trapezoidal rule on the (s + 1)^2 lattice points on and inside its border: exact for
/// bilinear filtering on the lattice, and a bright pixel between texels shows in all of them.
std::vector<float> filter_lattice(const std::vector<float>& lattice, int width, int height, int s) {
  std::vector<float> texels(static_cast<size_t>(width) * static_cast<size_t>(height));
  const int columns = width * s;
  parallel_blocks(static_cast<size_t>(height), 8, [&](size_t, size_t begin, size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) {
        float sum = 0.0f;
        for (int j = 0; j <= s; ++j) {
          for (int i = 0; i <= s; ++i) {
            const float weight = (j == 0 || j == s ? 0.5f : 1.0f) * (i == 0 || i == s ? 0.5f : 1.0f);
            const size_t column = static_cast<size_t>((x * s + i) % columns);
            sum += weight * lattice[static_cast<size_t>(y * s + j) * static_cast<size_t>(columns) + column];
          }
        }
        texels[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)] =
            sum / static_cast<float>(s * s);
      }
    }
  });
  return texels;
}

}  // namespace

std::optional<EnvironmentSampler> EnvironmentSampler::build(const Scene& scene, EnvironmentDensity density) {
  const Environment& environment = scene.environment;
  if (environment.material < 0 || !scene.materials[static_cast<size_t>(environment.material)]) return std::nullopt;
  const MaterialProgram& program = *scene.materials[static_cast<size_t>(environment.material)];
  if (!program.may_emit) return std::nullopt;
  const bool is_even = program.emission_is_constant || !environment.use_importance_sampling;
  if (density == EnvironmentDensity::COMPENSATED && is_even) return std::nullopt;

  EnvironmentSampler sampler;
  if (program.emission_is_constant) {
    sampler.mean_radiance_ = luminance(to_rgb(program.constant_emission));
  } else {
    const SkySuns suns = find_sky_suns(scene);
    const int best = suns.are_all_found ? largest_image_width(scene, program) : kLargestWidth;
    const int wanted = environment.importance_width > 0 ? environment.importance_width : best;
    const int width = std::clamp(wanted > 0 ? wanted : kDefaultWidth, kSmallestWidth, kLargestWidth);
    sampler.build_map(scene, environment.use_importance_sampling ? width : kSmallestWidth, suns.cones, density);
    sampler.share_out(scene, suns.cones);
  }
  if (!(sampler.mean_radiance_ > 0.0f)) return std::nullopt;
  if (!environment.use_importance_sampling) {
    sampler.width_ = sampler.height_ = 0;
    sampler.suns_.clear();
    sampler.sky_share_ = 1.0f;
  }
  return sampler;
}

void EnvironmentSampler::build_map(const Scene& scene, int width, std::span<const SkyCone> suns,
                                   EnvironmentDensity density) {
  width_ = width + width % 2;
  height_ = width_ / 2;
  const int image_width = largest_image_width(scene, *scene.materials[static_cast<size_t>(scene.environment.material)]);
  const int s = width_ <= kFineWidth || image_width > width_ ? kMaxSupersampling : 1;
  std::vector<float> texels =
      filter_lattice(evaluate_lattice(scene, width_ * s, height_ * s, suns), width_, height_, s);
  build_distribution(texels);
  uniform_share_ = kUniformShare;
  if (density == EnvironmentDensity::COMPLETE) return;
  uniform_share_ = kCompensatedUniformShare;
  const float mean = mean_radiance_;
  for (float& texel : texels) texel = std::max(texel - mean, 0.0f);
  build_distribution(texels);
  if (mean_radiance_ >= kFlat * mean) return;
  width_ = height_ = 0;  // what is left of an even sky would be rounding errors
  mean_radiance_ = 0.0f;
}

void EnvironmentSampler::share_out(const Scene& scene, std::span<const SkyCone> suns) {
  float total = mean_radiance_;
  for (const SkyCone& cone : suns) {
    const float mean = mean_luminance(scene, cone, diffuse_path());
    if (!(mean > 0.0f)) continue;
    suns_.push_back({cone, mean * cone.solid_angle() * kUniformPdf});
    total += suns_.back().share;
  }
  const float of_suns = total - mean_radiance_;
  mean_radiance_ = total;
  if (!(of_suns > 0.0f)) return;
  const float all_shares = std::min(of_suns / total, kLargestSunShare);
  for (Sun& sun : suns_) sun.share *= all_shares / of_suns;
  sky_share_ = 1.0f - all_shares;
}

void EnvironmentSampler::build_distribution(const std::vector<float>& texels) {
  row_cos_.resize(static_cast<size_t>(height_) + 1);
  for (int y = 0; y <= height_; ++y) {
    row_cos_[static_cast<size_t>(y)] =
        static_cast<float>(std::cos(std::numbers::pi * static_cast<double>(y) / static_cast<double>(height_)));
  }
  texels_ = CumulativeRows(width_, height_);
  rows_ = CumulativeRows(height_, 1);
  std::vector<float> rows(static_cast<size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    const double sum = texels_.set_row(y, &texels[static_cast<size_t>(y) * static_cast<size_t>(width_)]);
    rows[static_cast<size_t>(y)] = static_cast<float>(sum * static_cast<double>(texel_solid_angle(y)));
  }
  mean_radiance_ = static_cast<float>(rows_.set_row(0, rows.data())) * kUniformPdf;
}

float EnvironmentSampler::texel_solid_angle(int y) const {
  const auto row = static_cast<size_t>(y);
  return 2.0f * kPi / static_cast<float>(width_) * (row_cos_[row] - row_cos_[row + 1]);
}

float EnvironmentSampler::map_pdf(int x, int y) const {
  // Differences of the stored sums, not the luminance: these are the probabilities that `sample` really uses.
  return rows_.probability(0, y) * texels_.probability(y, x) / texel_solid_angle(y);
}

EnvironmentSampler::Sample EnvironmentSampler::sample(Vec2 u) const {
  for (const Sun& sun : suns_) {
    if (u.y < sun.share) {
      const Vec3 direction = sample_cone(sun.cone, {u.x, u.y / sun.share});
      // On the rim, rounding may take it out of the cone that it was drawn from: it has that density all the same.
      const float of_rim = contains(sun.cone, direction) ? 0.0f : sun.share / sun.cone.solid_angle();
      return {direction, pdf(direction) + of_rim};
    }
    u.y -= sun.share;
  }
  const Sample sample = sample_sky({u.x, std::min(u.y / sky_share_, kBelowOne)});
  return {sample.direction, sky_share_ * sample.pdf + suns_pdf(sample.direction)};
}

EnvironmentSampler::Sample EnvironmentSampler::sample_sky(Vec2 u) const {
  if (width_ == 0) return {square_to_sphere(u), kUniformPdf};
  if (u.y < uniform_share_) {
    const Vec3 direction = square_to_sphere({u.x, u.y / uniform_share_});
    return {direction, sky_pdf(direction)};
  }
  const float v = (u.y - uniform_share_) / (1.0f - uniform_share_);
  const int y = rows_.find(0, v), x = texels_.find(y, u.x);
  const auto row = static_cast<size_t>(y);
  const float in_row = clamp01((v - rows_.before(0, y)) / rows_.probability(0, y));
  const float in_texel = clamp01((u.x - texels_.before(y, x)) / texels_.probability(y, x));
  const float cos_theta = lerp(row_cos_[row], row_cos_[row + 1], in_row);
  const Vec3 direction = direction_at((static_cast<float>(x) + in_texel) / static_cast<float>(width_), cos_theta);
  return {direction, lerp(map_pdf(x, y), kUniformPdf, uniform_share_)};
}

float EnvironmentSampler::pdf(Vec3 direction) const { return sky_share_ * sky_pdf(direction) + suns_pdf(direction); }

float EnvironmentSampler::suns_pdf(Vec3 direction) const {
  float result = 0.0f;
  for (const Sun& sun : suns_)
    if (contains(sun.cone, direction)) result += sun.share / sun.cone.solid_angle();
  return result;
}

float EnvironmentSampler::sky_pdf(Vec3 direction) const {
  if (width_ == 0) return kUniformPdf;
  const float turns = azimuth_turns(direction.y, direction.x);
  const float u = turns < 0.0f ? turns + 1.0f : turns;
  const float v = inclination_half_turns(std::clamp(direction.z, -1.0f, 1.0f));
  const int x = std::min(static_cast<int>(u * static_cast<float>(width_)), width_ - 1);
  const int y = std::min(static_cast<int>(v * static_cast<float>(height_)), height_ - 1);
  return lerp(map_pdf(x, y), kUniformPdf, uniform_share_);
}

}  // namespace cistern
