#pragma once

#include <cmath>
#include <cstdint>

namespace cistern {

// Weighted reservoir sampling.
// [Chao 1982, A General Purpose Unequal Probability Sampling Plan]
// [Bitterli et al. 2020, Spatiotemporal Reservoir Resampling for Real-Time Ray Tracing with Dynamic Direct Lighting]
//
// The papers' letters: p_hat is the target function (not normalised), w the resampling weight of a candidate, w_sum
// their sum, W the unbiased contribution weight of the chosen sample, c its confidence ("M" in the 2020 paper).

/// What is stored: a sample and how it is to be weighed. E[W g(sample)] is the integral of g over the support of the
/// technique that made the reservoir, in the measure of S (which every user of one kind of S shares).
/// W = 0: a null sample. It found nothing, which is a result: it keeps its confidence and takes part in every merge.
template <class S>
struct Reservoir {
  S sample{};
  float W = 0.0f;
  float c = 0.0f;
};

/// The reservoir with at most `cap` confidence. To be done before a merge: c then counts in its weights.
template <class S>
Reservoir<S> cap_confidence(Reservoir<S> reservoir, float cap) {
  if (reservoir.c > cap) reservoir.c = cap;
  return reservoir;
}

/// Whether x may be a weight: finite and not negative.
inline bool is_weight(double x) { return std::isfinite(x) && x >= 0.0; }

/// What streams: keeps one of the candidates offered, each with probability w / w_sum.
/// Weights that are not finite or negative count as zero and add one to `non_finite_weights`, which outlives this.
template <class S>
class ReservoirBuilder {
 public:
  explicit ReservoirBuilder(uint64_t& non_finite_weights) : non_finite_weights_(non_finite_weights) {}

  /// Offers a candidate. w = (MIS weight, 1 / M for M samples of one technique) · p_hat · W, where W = 1 / pdf for a
  /// sample drawn directly. `p_hat` is the sample's target; `u` in [0, 1) a number used for nothing else. A candidate
  /// of zero weight is never kept. True if this candidate is the one kept now.
  bool add(const S& sample, double w, float p_hat, float u) {
    if (!is_weight(w)) {
      ++non_finite_weights_;
      return false;
    }
    w_sum_ += w;
    if (!(u * w_sum_ < w)) return false;
    sample_ = sample;
    p_hat_ = p_hat;
    return true;
  }

  double w_sum() const { return w_sum_; }
  /// Target of the candidate kept; 0 while there is none.
  float p_hat() const { return p_hat_; }

  /// The candidate kept with W = w_sum / p_hat and confidence c; a null sample where every weight was zero.
  Reservoir<S> finish(float c) const {
    if (w_sum_ == 0.0) return {.c = c};
    const auto W = static_cast<float>(w_sum_ / p_hat_);
    if (is_weight(W)) return {sample_, W, c};
    ++non_finite_weights_;
    return {.c = c};
  }

 private:
  S sample_{};
  double w_sum_ = 0.0;
  float p_hat_ = 0.0f;
  uint64_t& non_finite_weights_;
};

}  // namespace cistern
