#include "shading/phase.h"

#include "base/warp.h"

namespace cistern {
namespace {

/// Less anisotropy than this does not show, and the inverse below would divide by it.
constexpr float kIsotropic = 1e-3f;

/// Cosine of the deflection that `u` of all light exceeds.
float sample_cosine(float g, float u) {
  if (std::abs(g) < kIsotropic) return 1.0f - 2.0f * u;
  const float root = (1.0f - sqr(g)) / (1.0f + g - 2.0f * g * u);
  return std::clamp((1.0f + sqr(g) - sqr(root)) / (2.0f * g), -1.0f, 1.0f);
}

}  // namespace

float henyey_greenstein(float cosine, float g) {
  constexpr float kUniform = 1.0f / (4.0f * kPi);
  if (std::abs(g) < kIsotropic) return kUniform;
  const float a = std::abs(g), along = g < 0.0f ? -cosine : cosine;
  const float d2 = sqr(1.0f - a) + 2.0f * a * std::max(1.0f - along, 0.0f);  // 1 + g^2 - 2 g cos without cancellation
  return kUniform * (1.0f - sqr(a)) / (d2 * std::sqrt(d2));
}

Vec3 sample_henyey_greenstein(Vec3 direction, float g, Vec2 u) {
  const float cosine = sample_cosine(g, u.x), sine = safe_sqrt(1.0f - sqr(cosine));
  const SineCosine azimuth = sine_cosine_of_turns(u.y);
  return normalize(Frame(direction).to_world({sine * azimuth.cosine, sine * azimuth.sine, cosine}));
}

float evaluate_phase(const Medium& medium, float cosine) {
  float sum = 0.0f;
  for (int i = 0; i < medium.lobe_count; ++i) {
    const PhaseLobe& lobe = medium.lobes[static_cast<size_t>(i)];
    sum += average(lobe.scattering) * henyey_greenstein(cosine, lobe.g);
  }
  return sum / average(medium.scattering);
}

PhaseSample sample_phase(const Medium& medium, Vec3 direction, float u_lobe, Vec2 u_direction) {
  float left = u_lobe * average(medium.scattering);
  int chosen = 0;
  while (chosen + 1 < medium.lobe_count) {
    const float width = average(medium.lobes[static_cast<size_t>(chosen)].scattering);
    if (left < width) break;
    left -= width;
    ++chosen;
  }
  PhaseSample sample;
  sample.direction = sample_henyey_greenstein(direction, medium.lobes[static_cast<size_t>(chosen)].g, u_direction);
  sample.pdf = evaluate_phase(medium, dot(direction, sample.direction));
  return sample;
}

}  // namespace cistern
