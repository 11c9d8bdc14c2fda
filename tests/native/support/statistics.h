#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace cistern::test {

// p-values of the tests. A test states its false-alarm rate as the threshold below which it fails: with a fixed seed a
// pass stays a pass, with a fresh seed it fails falsely that often. `kFalseAlarmRate` is the rate of one comparison;
// several comparisons in one test share it with `shared_rate` [Šidák 1967].
inline constexpr double kFalseAlarmRate = 1e-4;

/// Threshold for each of `comparisons` independent p-values so that all together raise a false alarm with `rate`.
inline double shared_rate(int comparisons, double rate = kFalseAlarmRate) {
  return -std::expm1(std::log1p(-rate) / comparisons);
}

/// Q(a, x), the regularised upper incomplete gamma function: a > 0, x >= 0; relative error about 1e-12.
/// [Abramowitz and Stegun 1964, 6.5.29 (series) and 6.5.31 (continued fraction, by Lentz's method)]
inline double upper_incomplete_gamma(double a, double x) {
  constexpr int kMaxTerms = 100000;
  constexpr double kTolerance = 1e-14;
  if (x <= 0.0) return 1.0;
  const double log_scale = a * std::log(x) - x - std::lgamma(a);
  if (x < a + 1.0) {
    double term = 1.0 / a;
    double sum = term;
    for (int n = 1; n < kMaxTerms && term > sum * kTolerance; ++n) sum += term *= x / (a + n);
    return 1.0 - sum * std::exp(log_scale);
  }
  constexpr double kTiny = std::numeric_limits<double>::min() / kTolerance;
  double b = x + 1.0 - a;
  double c = 1.0 / kTiny;
  double d = 1.0 / b;
  double fraction = d;
  for (int n = 1; n < kMaxTerms; ++n) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = 1.0 / (std::abs(numerator * d + b) < kTiny ? kTiny : numerator * d + b);
    c = std::abs(b + numerator / c) < kTiny ? kTiny : b + numerator / c;
    fraction *= c * d;
    if (std::abs(c * d - 1.0) < kTolerance) break;
  }
  return fraction * std::exp(log_scale);
}

/// Probability that Pearson's chi-square of counts drawn from `expected` is at least that of `observed`. Both have the
/// same total (to sampling error if the total is free: pass a bin for what is left over). Bins that expect fewer than
/// `pool_below` counts are pooled into one, the smallest first, so that the chi-square law holds. 0 where something
/// was observed although nothing was expected; 1 where fewer than two bins are left.
inline double chi_square_p_value(std::span<const double> observed, std::span<const double> expected,
                                 double pool_below = 5.0) {
  std::vector<size_t> order(expected.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return std::pair(expected[i], i); });
  double statistic = 0.0, pooled_observed = 0.0, pooled_expected = 0.0;
  int bins = 0;
  const auto add_bin = [&](double o, double e) {
    statistic += (o - e) * (o - e) / e;
    ++bins;
  };
  for (size_t i : order) {
    if (expected[i] <= 0.0 && observed[i] > 0.0) return 0.0;
    if (expected[i] < pool_below || (pooled_expected > 0.0 && pooled_expected < pool_below)) {
      pooled_observed += observed[i];
      pooled_expected += expected[i];
    } else {
      add_bin(observed[i], expected[i]);
    }
  }
  if (pooled_expected > 0.0) add_bin(pooled_observed, pooled_expected);
  return bins < 2 ? 1.0 : upper_incomplete_gamma(0.5 * (bins - 1), 0.5 * statistic);
}

/// Two-sided p-value of a standard normal z.
inline double z_test_p_value(double z) { return std::erfc(std::abs(z) * std::sqrt(0.5)); }

/// I_x(a, b), the regularised incomplete beta function. [Abramowitz and Stegun 1964, 26.5.8]
inline double incomplete_beta(double a, double b, double x) {
  constexpr int kMaxTerms = 10000;
  constexpr double kTolerance = 1e-14;
  if (x <= 0.0 || x >= 1.0) return x <= 0.0 ? 0.0 : 1.0;
  if (x > (a + 1.0) / (a + b + 2.0)) return 1.0 - incomplete_beta(b, a, 1.0 - x);
  double c = 1.0;
  double d = 1.0 / (1.0 - (a + b) * x / (a + 1.0));
  double fraction = d;
  for (int m = 1; m < kMaxTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1.0 / (1.0 + even * d);
    c = 1.0 + even / c;
    fraction *= c * d;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1.0 / (1.0 + odd * d);
    c = 1.0 + odd / c;
    fraction *= c * d;
    if (std::abs(c * d - 1.0) < kTolerance) break;
  }
  const double log_scale = std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x);
  return std::exp(log_scale) * fraction / a;
}

/// Two-sided p-value of Student's t.
inline double t_test_p_value(double t, double degrees_of_freedom) {
  return incomplete_beta(0.5 * degrees_of_freedom, 0.5, degrees_of_freedom / (degrees_of_freedom + t * t));
}

/// Running mean and variance. [Welford 1962]
class Moments {
 public:
  void add(double x) {
    const double delta = x - mean_;
    mean_ += delta / static_cast<double>(++count_);
    sum_squares_ += delta * (x - mean_);
  }
  size_t count() const { return count_; }
  double mean() const { return mean_; }
  /// Unbiased variance of one sample; 0 below two samples.
  double variance() const { return count_ < 2 ? 0.0 : sum_squares_ / static_cast<double>(count_ - 1); }
  double variance_of_mean() const { return count_ < 1 ? 0.0 : variance() / static_cast<double>(count_); }

 private:
  size_t count_ = 0;
  double mean_ = 0.0, sum_squares_ = 0.0;
};

/// Two-sided p-value of "the mean is `expected`", Student's t. Equal constant samples: 1 if they match, else 0.
inline double mean_p_value(const Moments& sample, double expected) {
  const double difference = sample.mean() - expected;
  const double variance = sample.variance_of_mean();
  if (variance <= 0.0) return difference == 0.0 ? 1.0 : 0.0;
  return t_test_p_value(difference / std::sqrt(variance), static_cast<double>(sample.count() - 1));
}

/// Two-sided p-value of "both have the same mean". [Welch 1947]
inline double same_mean_p_value(const Moments& a, const Moments& b) {
  const double va = a.variance_of_mean(), vb = b.variance_of_mean();
  if (va + vb <= 0.0) return a.mean() == b.mean() ? 1.0 : 0.0;
  const double t = (a.mean() - b.mean()) / std::sqrt(va + vb);
  const double freedom =
      (va + vb) * (va + vb) /
      (va * va / (static_cast<double>(a.count()) - 1.0) + vb * vb / (static_cast<double>(b.count()) - 1.0));
  return t_test_p_value(t, freedom);
}

}  // namespace cistern::test
