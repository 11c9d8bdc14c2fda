#include "render/settings.h"

#include "base/check.h"

namespace cistern {
namespace {

constexpr int kMaxResolution = 65536;
/// Pixels are counted in 31 bits.
constexpr int64_t kMaxPixels = (int64_t{1} << 31) - 1;

template <class T>
void require(const char* setting, T value, T low, T high) {
  if (value >= low && value <= high) return;
  throw Error(std::string("setting '") + setting + "'",
              std::to_string(value) + " is not between " + std::to_string(low) + " and " + std::to_string(high));
}

void check_region(const Settings& s) {
  const Region& r = s.region;
  require("region x", r.x, 0, s.width - 1);
  require("region y", r.y, 0, s.height - 1);
  require("region width", r.width, 1, s.width - r.x);
  require("region height", r.height, 1, s.height - r.y);
  require("region pixels", int64_t{r.width} * r.height, int64_t{1}, kMaxPixels);
}

void check_limits(const PathLimits& limits) {
  constexpr int kMaxBounces = 1024;
  require("max_bounces", limits.max_bounces, 0, kMaxBounces);
  require("max_diffuse_bounces", limits.max_diffuse_bounces, 0, kMaxBounces);
  require("max_glossy_bounces", limits.max_glossy_bounces, 0, kMaxBounces);
  require("max_transmission_bounces", limits.max_transmission_bounces, 0, kMaxBounces);
  require("max_transparent_bounces", limits.max_transparent_bounces, 0, kMaxBounces);
  require("min_bounces", limits.min_bounces, 0, kMaxBounces);
  require("clamp_direct", limits.clamp_direct, 0.0f, 1e10f);
  require("clamp_indirect", limits.clamp_indirect, 0.0f, 1e10f);
}

}  // namespace

void check_settings(Settings& s) {
  require("width", s.width, 1, kMaxResolution);
  require("height", s.height, 1, kMaxResolution);
  if (s.region.width == 0 && s.region.height == 0) s.region = {0, 0, s.width, s.height};
  check_region(s);
  require("samples", s.samples, 1, 1 << 24);
  require("threads", s.threads, 0, 1024);
  require("filter_width", s.filter_width, 0.01f, 10.0f);
  require("time_limit", s.time_limit, 0.0, 1e9);
  check_limits(s.limits);
}

}  // namespace cistern
