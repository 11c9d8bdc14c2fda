#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "film/sample_rounding.h"
#include "transport/path_tracer.h"

namespace cistern {

/// Light first, then what is known of the first surfaces (from DEPTH on), then looks inside (from CELLS on), which show
/// one frame instead of a mean.
enum class Pass : uint8_t {
  COMBINED,
  DIRECT,
  INDIRECT,
  EMISSION,
  ENVIRONMENT,
  EMISSION_NOISE,  // how far Emission may be off
  COMBINED_NOISE,  // and Combined, its alpha too
  CAUGHT,          // what of Combined is seen on shadow catchers
  DIFFUSE_DIRECT,  // by the kind of the first scattering, see LightByKind
  DIFFUSE_INDIRECT,
  DIFFUSE_COLOR,
  GLOSSY_DIRECT,
  GLOSSY_INDIRECT,
  GLOSSY_COLOR,
  TRANSMISSION_DIRECT,
  TRANSMISSION_INDIRECT,
  TRANSMISSION_COLOR,
  VOLUME_DIRECT,
  VOLUME_INDIRECT,
  UNSCATTERED_EMISSION,
  UNSCATTERED_ENVIRONMENT,
  DEPTH,
  NORMAL,
  POSITION,
  DENOISING_ALBEDO,
  DENOISING_NORMAL,
  CELLS,
  CELL_OCCUPANCY,
  CELL_LEVEL,
  NORMAL_BIN,
  RESERVOIR_CONFIDENCE,
  RESERVOIR_WEIGHT,
  REUSE_COUNT,
  LIGHT_CHOICE_ENTROPY,
  LIGHT_CHOICE_SAMPLES,
  GUIDED,
  OBJECT_INDEX,
  MATERIAL_INDEX,
  SAMPLE_COUNT,  // of each pixel
  COUNT
};

struct PassDescription {
  const char* name;
  int channels;
};
const PassDescription& describe(Pass pass);
/// Whether it is light, which the film's exposure multiplies, and no colour of surfaces.
bool is_light(Pass pass);
/// Whether it is one that Film::add needs a LightByKind for.
constexpr bool splits_kinds(Pass pass) { return pass >= Pass::DIFFUSE_DIRECT && pass <= Pass::UNSCATTERED_ENVIRONMENT; }
/// The pass called `name`; throws Error naming it if there is none.
Pass find_pass(const std::string& name);

/// Passes of light groups are called "Light Group 0" and so on: the number of the one called `name`, empty if it is
/// none of them.
std::optional<int> find_light_group(const std::string& name);
std::string light_group_name(int group);
inline constexpr int kLightGroupChannels = 3;

/// Sums of path records per pixel. Each pixel keeps its own sample count, so a cancelled render is a valid picture
/// everywhere. Different pixels may be added to from different threads at once; a pixel's sum is made in the order of
/// the calls.
class Film {
 public:
  /// Combined is always there, Emission with its noise, and a kind's colour with its light. Per pixel: 4 bytes for the
  /// count and 4 per channel of the passes, also of `light_groups` of three channels. Light is resolved times
  /// `exposure`.
  Film(int width, int height, const std::vector<Pass>& passes, int light_groups = 0, float exposure = 1.0f);

  int width() const { return width_; }
  int height() const { return height_; }
  bool has(Pass pass) const { return !sums_[static_cast<size_t>(pass)].empty(); }

  /// A record with a value that is not finite, or beyond 1e30, is counted instead of added; its pixel still counts the
  /// sample (as black).
  void add(uint32_t pixel, const PathRecord& record, const LightByKind* by_kind = nullptr,
           std::span<const Rgb> by_group = {});
  /// Whether a pixel is to get no more samples, which whoever makes them asks; a finished one stays so.
  bool is_finished(uint32_t pixel) const { return !finished_.empty() && finished_[pixel] != 0; }
  void finish(uint32_t pixel);
  /// Sets a pixel of a pass that shows one frame; nothing if that pass is not kept.
  void show(Pass pass, uint32_t pixel, Rgb value);
  /// Mean of the samples, row 0 at the bottom, channels interleaved. Depth, Normal and Position are means over the
  /// samples that hit something (Depth 1e10 where none did). Combined is premultiplied RGBA. Emission Noise and
  /// Combined Noise are half the difference between the means of two halves of the samples, of which each covers the
  /// pixel evenly: an estimate of the standard error of Emission, or of Combined, with one degree of freedom, to be
  /// averaged over neighbours; of one sample, what it saw. Light by kinds of surface scattering is the
  /// mean divided by the mean colour of the kind, so that their product is what Combined has of it; where a channel of
  /// the colour is 0, and so the light, the quotient is the mean of the others. Throws Error for a pass that is not
  /// kept.
  std::vector<float> resolve(Pass pass) const;
  /// Mean light of a group, as above.
  std::vector<float> resolve_light_group(int group) const;
  uint64_t non_finite_samples() const;
  size_t memory_bytes() const;

 private:
  struct Sample {
    uint32_t pixel;
    SampleRounding rounding;
  };

  float* sum(Pass pass, uint32_t pixel);
  void add_number(Pass pass, size_t channel, const Sample& sample, float value);
  void add_color(Pass pass, const Sample& sample, Rgb value);
  void add_by_kind(const Sample& sample, const LightByKind& light);
  void add_by_group(const Sample& sample, std::span<const Rgb> light);
  void divide_by_color(std::vector<float>& light, Pass color) const;
  void add_first_hit(const Sample& sample, const PathRecord& record);
  std::vector<float> resolve_unexposed(Pass pass) const;
  std::vector<float> resolve_noise(Pass noise, Pass noisy) const;

  int width_, height_;
  std::vector<uint32_t> samples_, hits_, non_finite_;
  std::vector<uint8_t> finished_;  // by pixel; empty: none is
  std::vector<float> sums_[static_cast<size_t>(Pass::COUNT)];
  size_t light_groups_;
  float exposure_;
  std::vector<Rgb> group_sums_;  // those of a pixel side by side
};

}  // namespace cistern
