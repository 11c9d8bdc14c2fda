#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <span>

#include "resampling/mis_weight.h"
#include "resampling/reservoir.h"

namespace cistern {

/// target(i, sample): p_hat_i(sample) >= 0, the target candidate i was made with, in the measure of S that all share.
template <class Target, class S>
concept TargetFunction = requires(const Target& target, size_t i, const S& sample) {
  { target(i, sample) } -> std::convertible_to<float>;
};

/// Numbers in [0, 1), such as Rng.
template <class Random>
concept RandomNumbers = requires(Random& random) {
  { random.next_float() } -> std::convertible_to<float>;
};

namespace detail {

/// The target, where a value that is no weight counts as zero and is counted.
template <class S, class Target>
struct CheckedTarget {
  const Target& target;
  uint64_t& non_finite_weights;

  float operator()(size_t i, const S& sample) const {
    const float p_hat = target(i, sample);
    if (is_weight(p_hat)) return p_hat;
    ++non_finite_weights;
    return 0.0f;
  }
};

/// Share of candidate i in `sample` by the balance heuristic; p_hat_0 is the receiver's target of it, above zero.
template <class S, class Target>
double balance_weight(std::span<const Reservoir<S>> candidates, size_t i, const S& sample, float p_hat_0,
                      const Target& target) {
  double own = 0.0, sum = 0.0;
  for (size_t j = 0; j < candidates.size(); ++j) {
    if (candidates[j].c == 0.0f) continue;
    const double share = double{candidates[j].c} * (j == 0 ? p_hat_0 : target(j, sample));
    if (j == i) own = share;
    sum += share;
  }
  return sum > 0.0 ? own / sum : 0.0;
}

/// Defensive pairwise share of candidate i in its own sample. c_0 must be above zero.
template <class S, class Target>
double pairwise_weight(std::span<const Reservoir<S>> candidates, size_t i, double c_sum, float p_hat_0,
                       const Target& target) {
  const double c_0 = candidates[0].c;
  const S& sample = candidates[i].sample;
  if (i > 0) return pairwise_weight_of_neighbour(candidates[i].c, target(i, sample), c_0, p_hat_0, c_sum);
  double weight = c_0 / c_sum;
  for (size_t j = 1; j < candidates.size(); ++j) {
    if (candidates[j].c == 0.0f) continue;
    weight += pairwise_weight_of_receiver(candidates[j].c, target(j, sample), c_0, p_hat_0, c_sum);
  }
  return weight;
}

/// What CONTRIBUTION leaves until a sample is chosen: C / Z(sample), or zero if its own candidate cannot have made it.
template <class S, class Target>
double contribution_factor(std::span<const Reservoir<S>> candidates, size_t chosen, double c_sum,
                           const Target& target) {
  double z = 0.0;
  for (size_t j = 0; j < candidates.size(); ++j) {
    const float c = candidates[j].c;
    // The receiver's target was above zero, or the sample would not have been chosen.
    const bool can_make = j == 0 || (c > 0.0f && target(j, candidates[chosen].sample) > 0.0f);
    if (!can_make && j == chosen) return 0.0;
    if (can_make) z += c;
  }
  return c_sum / z;
}

}  // namespace detail

/// Merges reservoirs into one for the receiver: picks y_i with probability proportional to m_i(y_i) p_hat_0(y_i) W_i
/// and gives it W = (sum of these) / p_hat_0(y) and the sum of all confidences. `candidates[0]` is the receiver's own
/// and, for an unbiased result, able to make every sample the receiver needs: c_0 > 0. Capping confidences comes
/// before.
///
/// Null candidates must be listed: they count in every weight. Which reservoirs are listed must not depend on their
/// samples. To refuse a sample of neighbour j, let target(j, .) be zero for it, in whichever reservoir it is found.
///
/// Calls of `target`, with n of the k + 1 candidates not null: CONSTANT n; CONTRIBUTION n + k; PAIRWISE 2 n - 1 + k if
/// the receiver's is not null, else 2 n; BALANCE n (k + 1). Candidates of zero confidence are never asked, and samples
/// outside the receiver's target cost one call. A null candidate's own sample is never evaluated, its target may be.
/// One random number per candidate that is not null.
///
/// Values of target or W that are not finite or negative count as zero, add one to `non_finite_weights` each, and keep
/// their confidence.
template <class S, class Target, class Random>
requires TargetFunction<Target, S> && RandomNumbers<Random> Reservoir<S> resample(
    std::span<const Reservoir<S>> candidates, const Target& target, MisWeight weights, Random& random,
    uint64_t& non_finite_weights) {
  assert(!candidates.empty());
  double c_sum = 0.0;
  for (const Reservoir<S>& candidate : candidates) {
    assert(candidate.c >= 0.0f);
    c_sum += candidate.c;
  }
  // Without the receiver there is nothing to pair with.
  if (weights == MisWeight::PAIRWISE && candidates[0].c == 0.0f) weights = MisWeight::BALANCE;

  const detail::CheckedTarget<S, Target> p_hat{target, non_finite_weights};
  ReservoirBuilder<S> builder(non_finite_weights);
  size_t chosen = 0;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const auto& [sample, W, c] = candidates[i];
    if (W == 0.0f || c == 0.0f) continue;
    const float u = random.next_float();
    const float p_hat_0 = p_hat(0, sample);
    if (p_hat_0 == 0.0f) continue;
    double m = c / c_sum;
    if (weights == MisWeight::BALANCE) m = detail::balance_weight(candidates, i, sample, p_hat_0, p_hat);
    if (weights == MisWeight::PAIRWISE) m = detail::pairwise_weight(candidates, i, c_sum, p_hat_0, p_hat);
    if (builder.add(sample, m * p_hat_0 * W, p_hat_0, u)) chosen = i;
  }
  Reservoir<S> merged = builder.finish(static_cast<float>(c_sum));
  if (weights == MisWeight::CONTRIBUTION && merged.W > 0.0f)
    merged.W *= static_cast<float>(detail::contribution_factor(candidates, chosen, c_sum, p_hat));
  return merged;
}

}  // namespace cistern
