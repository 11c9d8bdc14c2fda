#include "film/film.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <numeric>

#include "base/check.h"

namespace cistern {
namespace {

constexpr std::array<PassDescription, static_cast<size_t>(Pass::COUNT)> kPasses{{
    {"Combined", 4},
    {"Direct", 3},
    {"Indirect", 3},
    {"Emission", 3},
    {"Environment", 3},
    {"Emission Noise", 3},
    {"Combined Noise", 4},
    {"Caught", 4},
    {"Diffuse Direct", 3},
    {"Diffuse Indirect", 3},
    {"Diffuse Color", 3},
    {"Glossy Direct", 3},
    {"Glossy Indirect", 3},
    {"Glossy Color", 3},
    {"Transmission Direct", 3},
    {"Transmission Indirect", 3},
    {"Transmission Color", 3},
    {"Volume Direct", 3},
    {"Volume Indirect", 3},
    {"Unscattered Emission", 3},
    {"Unscattered Environment", 3},
    {"Depth", 1},
    {"Normal", 3},
    {"Position", 3},
    {"Denoising Albedo", 3},
    {"Denoising Normal", 3},
    {"Cells", 3},
    {"Cell Occupancy", 1},
    {"Cell Level", 1},
    {"Normal Bin", 3},
    {"Reservoir Confidence", 1},
    {"Reservoir Weight", 1},
    {"Reuse Count", 1},
    {"Light Choice Entropy", 1},
    {"Light Choice Samples", 1},
    {"Guided", 1},
    {"Object Index", 1},
    {"Material Index", 1},
    {"Sample Count", 1},
}};

/// Which half of a pixel's samples one belongs to, as 1 or -1: by the parity of its number's bits (Thue and Morse),
/// since of points of Sobol's sequence those of even number all lie in one half of the pixel. Of any 2 n samples n are
/// in each.
float half_sign(uint32_t sample) { return std::popcount(sample) % 2 == 0 ? 1.0f : -1.0f; }

constexpr std::string_view kLightGroupPrefix = "Light Group ";

bool is_mean_over_hits(Pass pass) { return pass == Pass::DEPTH || pass == Pass::NORMAL || pass == Pass::POSITION; }

/// Far beyond any radiance or coordinate, and small enough that 2^24 of them do not overflow.
constexpr float kLargestValue = 1e30f;

bool fits(float v) { return std::abs(v) < kLargestValue; }  // false for nan
bool fits(Rgb c) { return fits(c.r) && fits(c.g) && fits(c.b); }
bool fits(Vec3 v) { return fits(to_rgb(v)); }

bool fits(const PathRecord& r) {
  return fits(r.direct) && fits(r.indirect) && fits(r.emission) && fits(r.environment) && fits(r.albedo) &&
         fits(r.denoising_normal) && fits(r.position) && fits(r.normal) && fits(r.depth) && fits(r.alpha);
}

bool fits(const LightByKind& light) {
  const auto all_fit = [](const auto& colors) { return std::ranges::all_of(colors, [](Rgb c) { return fits(c); }); };
  return all_fit(light.direct) && all_fit(light.indirect) && all_fit(light.color) && fits(light.emission) &&
         fits(light.environment);
}

/// Direct, indirect and colour of a kind of surface scattering.
struct KindPasses {
  Pass direct, indirect, color;
};
constexpr std::array<KindPasses, kPassKinds> kKindPasses{{
    {Pass::DIFFUSE_DIRECT, Pass::DIFFUSE_INDIRECT, Pass::DIFFUSE_COLOR},
    {Pass::GLOSSY_DIRECT, Pass::GLOSSY_INDIRECT, Pass::GLOSSY_COLOR},
    {Pass::TRANSMISSION_DIRECT, Pass::TRANSMISSION_INDIRECT, Pass::TRANSMISSION_COLOR},
}};

/// Light over colour. [Cycles, safe_divide_even_color]
Rgb divide_evenly(Rgb light, Rgb color) {
  const std::array<float, 3> l{light.r, light.g, light.b}, c{color.r, color.g, color.b};
  float known = 0.0f, sum = 0.0f;
  for (size_t i = 0; i < c.size(); ++i)
    if (c[i] != 0.0f) known += 1.0f, sum += l[i] / c[i];
  const float even = known > 0.0f ? sum / known : 0.0f;
  const auto quotient = [&](size_t i) { return c[i] != 0.0f ? l[i] / c[i] : even; };
  return {quotient(0), quotient(1), quotient(2)};
}

}  // namespace

const PassDescription& describe(Pass pass) { return kPasses[static_cast<size_t>(pass)]; }

Pass find_pass(const std::string& name) {
  for (size_t i = 0; i < kPasses.size(); ++i)
    if (name == kPasses[i].name) return static_cast<Pass>(i);
  throw Error("pass '" + name + "'", "there is no pass of this name");
}

std::optional<int> find_light_group(const std::string& name) {
  if (!name.starts_with(kLightGroupPrefix)) return std::nullopt;
  const char *begin = name.data() + kLightGroupPrefix.size(), *end = name.data() + name.size();
  int group = -1;
  const auto [stop, error] = std::from_chars(begin, end, group);
  const bool is_number = error == std::errc() && stop == end && group >= 0 && group < kMaxLightGroups;
  return is_number ? std::optional(group) : std::nullopt;
}

bool is_light(Pass pass) {
  const auto has_color = [pass](const KindPasses& kind) { return pass == kind.color; };
  return pass < Pass::DEPTH && std::ranges::none_of(kKindPasses, has_color);
}

std::string light_group_name(int group) { return std::string(kLightGroupPrefix) += std::to_string(group); }

Film::Film(int width, int height, const std::vector<Pass>& passes, int light_groups, float exposure)
    : width_(width), height_(height), light_groups_(static_cast<size_t>(light_groups)), exposure_(exposure) {
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const auto keep = [&](Pass pass) {
    sums_[static_cast<size_t>(pass)].assign(pixels * static_cast<size_t>(describe(pass).channels), 0.0f);
  };
  keep(Pass::COMBINED);
  for (Pass pass : passes) keep(pass);
  if (has(Pass::EMISSION_NOISE)) keep(Pass::EMISSION);
  for (const KindPasses& kind : kKindPasses)
    if (has(kind.direct) || has(kind.indirect)) keep(kind.color);
  group_sums_.assign(pixels * light_groups_, Rgb());
  samples_.assign(pixels, 0);
  hits_.assign(pixels, 0);
  non_finite_.assign(pixels, 0);
}

float* Film::sum(Pass pass, uint32_t pixel) {
  return &sums_[static_cast<size_t>(pass)][size_t{pixel} * static_cast<size_t>(describe(pass).channels)];
}

void Film::add_number(Pass pass, size_t channel, const Sample& sample, float value) {
  sample.rounding.add(value, sum(pass, sample.pixel)[channel]);
}

void Film::add_color(Pass pass, const Sample& sample, Rgb value) {
  if (!has(pass)) return;
  add_number(pass, 0, sample, value.r);
  add_number(pass, 1, sample, value.g);
  add_number(pass, 2, sample, value.b);
}

void Film::add(uint32_t pixel, const PathRecord& record, const LightByKind* by_kind, std::span<const Rgb> by_group) {
  const uint32_t number = samples_[pixel]++;
  if (!fits(record)) {
    ++non_finite_[pixel];
    return;
  }
  const Sample sample{pixel, {pixel, number}};
  const Rgb combined = record.combined();
  add_color(Pass::COMBINED, sample, combined);
  add_color(Pass::COMBINED_NOISE, sample, half_sign(number) * combined);
  add_number(Pass::COMBINED, 3, sample, record.alpha);
  if (has(Pass::COMBINED_NOISE)) add_number(Pass::COMBINED_NOISE, 3, sample, half_sign(number) * record.alpha);
  add_color(Pass::DIRECT, sample, record.direct);
  add_color(Pass::INDIRECT, sample, record.indirect);
  add_color(Pass::EMISSION, sample, record.emission);
  add_color(Pass::EMISSION_NOISE, sample, half_sign(number) * record.emission);
  add_color(Pass::ENVIRONMENT, sample, record.environment);
  if (has(Pass::CAUGHT) && record.caught > 0.0f) {
    add_color(Pass::CAUGHT, sample, combined - record.light_before_catcher);
    add_number(Pass::CAUGHT, 3, sample, record.caught - (record.alpha_before_catcher - record.alpha));
  }
  add_color(Pass::DENOISING_ALBEDO, sample, record.albedo);
  add_color(Pass::DENOISING_NORMAL, sample, to_rgb(record.denoising_normal));
  if (record.hit) add_first_hit(sample, record);
  if (by_kind) add_by_kind(sample, *by_kind);
  if (light_groups_ > 0) add_by_group(sample, by_group);
}

/// Not by halves: they fit where their record does, unless lamps of positive and of negative strength are beyond range.
void Film::add_by_group(const Sample& sample, std::span<const Rgb> light) {
  if (!std::ranges::all_of(light, [](Rgb c) { return fits(c); })) {
    ++non_finite_[sample.pixel];
    return;
  }
  const std::span<Rgb> sums = std::span(group_sums_).subspan(sample.pixel * light_groups_, light_groups_);
  for (size_t group = 0; group < std::min(light.size(), light_groups_); ++group)
    sample.rounding.add(light[group], sums[group]);
}

/// Combined is the same whether it is split or not: parts that do not fit are but missing from their passes.
void Film::add_by_kind(const Sample& sample, const LightByKind& light) {
  if (!fits(light)) {
    ++non_finite_[sample.pixel];
    return;
  }
  for (size_t kind = 0; kind < kKindPasses.size(); ++kind) {
    add_color(kKindPasses[kind].direct, sample, light.direct[kind]);
    add_color(kKindPasses[kind].indirect, sample, light.indirect[kind]);
    add_color(kKindPasses[kind].color, sample, light.color[kind]);
  }
  add_color(Pass::VOLUME_DIRECT, sample, light.direct[kVolumeLight]);
  add_color(Pass::VOLUME_INDIRECT, sample, light.indirect[kVolumeLight]);
  add_color(Pass::UNSCATTERED_EMISSION, sample, light.emission);
  add_color(Pass::UNSCATTERED_ENVIRONMENT, sample, light.environment);
}

void Film::add_first_hit(const Sample& sample, const PathRecord& record) {
  ++hits_[sample.pixel];
  add_color(Pass::NORMAL, sample, to_rgb(record.normal));
  add_color(Pass::POSITION, sample, to_rgb(record.position));
  if (has(Pass::DEPTH)) add_number(Pass::DEPTH, 0, sample, record.depth);
}

void Film::finish(uint32_t pixel) {
  if (finished_.empty()) finished_.assign(samples_.size(), 0);
  finished_[pixel] = 1;
}

void Film::show(Pass pass, uint32_t pixel, Rgb value) {
  if (!has(pass)) return;
  float* shown = sum(pass, pixel);
  shown[0] = value.r;
  if (describe(pass).channels == 3) shown[1] = value.g, shown[2] = value.b;
}

std::vector<float> Film::resolve(Pass pass) const {
  std::vector<float> picture = resolve_unexposed(pass);
  if (!is_light(pass) || exposure_ == 1.0f) return picture;
  const auto channels = static_cast<size_t>(describe(pass).channels);
  for (size_t first = 0; first < picture.size(); first += channels)
    for (size_t c = 0; c < 3; ++c) picture[first + c] *= exposure_;  // not alpha
  return picture;
}

std::vector<float> Film::resolve_unexposed(Pass pass) const {
  const std::vector<float>& sums = sums_[static_cast<size_t>(pass)];
  if (sums.empty()) throw Error(std::string("pass '") + describe(pass).name + "'", "was not enabled for this render");
  if (pass == Pass::SAMPLE_COUNT) return {samples_.begin(), samples_.end()};
  if (pass >= Pass::CELLS) return sums;
  if (pass == Pass::EMISSION_NOISE) return resolve_noise(pass, Pass::EMISSION);
  if (pass == Pass::COMBINED_NOISE) return resolve_noise(pass, Pass::COMBINED);
  const std::vector<uint32_t>& counts = is_mean_over_hits(pass) ? hits_ : samples_;
  const auto channels = static_cast<size_t>(describe(pass).channels);
  std::vector<float> mean(sums.size());
  for (size_t pixel = 0; pixel < counts.size(); ++pixel) {
    const float scale = counts[pixel] > 0 ? 1.0f / static_cast<float>(counts[pixel]) : 0.0f;
    for (size_t c = 0; c < channels; ++c) mean[pixel * channels + c] = sums[pixel * channels + c] * scale;
    if (pass == Pass::DEPTH && counts[pixel] == 0) mean[pixel] = kNoHitDepth;
  }
  for (const KindPasses& kind : kKindPasses)
    if (pass == kind.direct || pass == kind.indirect) divide_by_color(mean, kind.color);
  return mean;
}

std::vector<float> Film::resolve_light_group(int group) const {
  const auto index = static_cast<size_t>(group);
  if (group < 0 || index >= light_groups_)
    throw Error("pass '" + light_group_name(group) + "'", "was not enabled for this render");
  std::vector<float> mean;
  mean.reserve(samples_.size() * kLightGroupChannels);
  for (size_t pixel = 0; pixel < samples_.size(); ++pixel) {
    const float scale = samples_[pixel] > 0 ? exposure_ / static_cast<float>(samples_[pixel]) : 0.0f;
    const Rgb light = group_sums_[pixel * light_groups_ + index] * scale;
    mean.insert(mean.end(), {light.r, light.g, light.b});
  }
  return mean;
}

void Film::divide_by_color(std::vector<float>& light, Pass color) const {
  const std::vector<float> colors = resolve(color);
  for (size_t i = 0; i < light.size(); i += 3) {
    const Rgb quotient =
        divide_evenly({light[i], light[i + 1], light[i + 2]}, {colors[i], colors[i + 1], colors[i + 2]});
    light[i] = quotient.r, light[i + 1] = quotient.g, light[i + 2] = quotient.b;
  }
}

std::vector<float> Film::resolve_noise(Pass noise, Pass noisy) const {
  const std::vector<float>& differences = sums_[static_cast<size_t>(noise)];
  const std::vector<float>& sums = sums_[static_cast<size_t>(noisy)];
  const auto channels = static_cast<size_t>(describe(noise).channels);
  const auto channels_of_noisy = static_cast<size_t>(describe(noisy).channels);
  std::vector<float> resolved(differences.size());
  for (size_t i = 0; i < resolved.size(); ++i) {
    const size_t pixel = i / channels;
    const float sum = sums[pixel * channels_of_noisy + i % channels];
    const uint32_t samples = samples_[pixel];
    if (samples < 2) {
      resolved[i] = std::abs(sum);
      continue;
    }
    const float count = static_cast<float>(samples);
    const float excess = samples % 2 == 1 ? half_sign(samples - 1) : 0.0f;  // of the first half's samples
    resolved[i] = std::abs(differences[i] - excess / count * sum) / count;
  }
  return resolved;
}

uint64_t Film::non_finite_samples() const {
  return std::accumulate(non_finite_.begin(), non_finite_.end(), uint64_t{0});
}

size_t Film::memory_bytes() const {
  size_t floats = samples_.size() + hits_.size() + non_finite_.size();
  for (const std::vector<float>& s : sums_) floats += s.size();
  floats += group_sums_.size() * kLightGroupChannels;
  return floats * sizeof(float) + finished_.size();
}

}  // namespace cistern
