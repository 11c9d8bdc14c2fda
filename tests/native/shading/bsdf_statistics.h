#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/rng.h"
#include "base/warp.h"
#include "shading/bsdf.h"
#include "support/statistics.h"

namespace cistern::test {

using DirectionSampler = std::function<std::optional<Vec3>(Rng&)>;
using DirectionDensity = std::function<float(Vec3)>;

// Bins of the sphere around a normal: equal angles, with an edge along the horizon.
inline constexpr int kThetaBins = 16, kPhiBins = 32;
// Gauss-Legendre rule of four points on [0, 1]. [Abramowitz and Stegun 1964, table 25.4]
struct QuadraturePoint {
  double x, weight;
};
inline constexpr QuadraturePoint kQuadrature[] = {{0.0694318442029737, 0.1739274225687269},
                                                  {0.3300094782075719, 0.3260725774312731},
                                                  {0.6699905217924281, 0.3260725774312731},
                                                  {0.9305681557970263, 0.1739274225687269}};

inline Vec3 direction_at(const Frame& frame, double theta, double phi) {
  return frame.to_world({static_cast<float>(std::sin(theta) * std::cos(phi)),
                         static_cast<float>(std::sin(theta) * std::sin(phi)), static_cast<float>(std::cos(theta))});
}

struct AngleCell {
  double theta, phi, theta_width, phi_width;

  double quadrature(const Frame& frame, const DirectionDensity& density) const {
    double sum = 0.0;
    for (QuadraturePoint t : kQuadrature) {
      const double angle = theta + t.x * theta_width;
      for (QuadraturePoint p : kQuadrature)
        sum += density(direction_at(frame, angle, phi + p.x * phi_width)) * std::sin(angle) * t.weight * p.weight;
    }
    return sum * theta_width * phi_width;
  }
};

/// Halves the cell until halving no longer matters: narrow peaks and edges need it.
inline double integrate_cell(const Frame& frame, const DirectionDensity& density, const AngleCell& cell, double coarse,
                             int depth = 0) {
  constexpr double kTolerance = 2e-6;
  constexpr int kMinDepth = 1, kMaxDepth = 6;
  const double h = 0.5 * cell.theta_width, w = 0.5 * cell.phi_width;
  const AngleCell parts[] = {{cell.theta, cell.phi, h, w},
                             {cell.theta, cell.phi + w, h, w},
                             {cell.theta + h, cell.phi, h, w},
                             {cell.theta + h, cell.phi + w, h, w}};
  double values[4], fine = 0.0;
  for (int i = 0; i < 4; ++i) fine += values[i] = parts[i].quadrature(frame, density);
  if (depth == kMaxDepth || (depth >= kMinDepth && std::abs(fine - coarse) < kTolerance)) return fine;
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) sum += integrate_cell(frame, density, parts[i], values[i], depth + 1);
  return sum;
}

/// Integral of `density` over each bin.
inline std::vector<double> integrate_bins(const Frame& frame, const DirectionDensity& density) {
  constexpr double kThetaWidth = M_PI / kThetaBins, kPhiWidth = 2.0 * M_PI / kPhiBins;
  std::vector<double> bins;
  for (int i = 0; i < kThetaBins; ++i)
    for (int j = 0; j < kPhiBins; ++j) {
      const AngleCell cell{i * kThetaWidth, j * kPhiWidth, kThetaWidth, kPhiWidth};
      bins.push_back(integrate_cell(frame, density, cell, 0.0));
    }
  return bins;
}

inline double integrate_sphere(const Frame& frame, const DirectionDensity& density) {
  double sum = 0.0;
  for (double bin : integrate_bins(frame, density)) sum += bin;
  return sum;
}

/// p-value of "`sampler` draws from `density`"; what the density lacks to 1 is the probability of no direction.
inline double sampler_p_value(const Frame& frame, const DirectionSampler& sampler, const DirectionDensity& density,
                              uint64_t seed, int samples = 60000) {
  std::vector<double> expected = integrate_bins(frame, density);
  double total = 0.0;
  for (double& bin : expected) total += bin *= samples;
  expected.push_back(std::max(samples - total, 0.0));
  std::vector<double> observed(expected.size());
  Rng rng(seed, 0, 0, 0);
  for (int i = 0; i < samples; ++i) {
    const std::optional<Vec3> w = sampler(rng);
    if (!w) {
      ++observed.back();
      continue;
    }
    const Vec3 local = frame.to_local(*w);
    const double phi = std::atan2(local.y, local.x) / (2.0 * M_PI) + (local.y < 0.0f ? 1.0 : 0.0);
    const double theta = std::acos(std::clamp(local.z, -1.0f, 1.0f));
    const int theta_bin = std::clamp(static_cast<int>(theta / M_PI * kThetaBins), 0, kThetaBins - 1);
    const int phi_bin = std::clamp(static_cast<int>(phi * kPhiBins), 0, kPhiBins - 1);
    ++observed[static_cast<size_t>(theta_bin * kPhiBins + phi_bin)];
  }
  return chi_square_p_value(observed, expected);
}

/// A direction at `cosine` to the frame's normal.
inline Vec3 at_angle(const Frame& frame, float cosine, float azimuth = 0.7f) {
  return direction_at(frame, std::acos(cosine), azimuth);
}

inline const Vec3 kTestNormal = normalize({0.3f, -0.5f, 0.8f});

/// A BSDF around kTestNormal seen from `wo`.
inline Bsdf make_bsdf(Vec3 wo) {
  Bsdf bsdf;
  bsdf.ng = bsdf.ns = kTestNormal;
  bsdf.wo = wo;
  return bsdf;
}

}  // namespace cistern::test
