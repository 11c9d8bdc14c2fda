#pragma once

#include <cstdint>

namespace cistern {

/// What a user asks of reuse: a picture right on average, or a cheaper one that is too dark where neighbours differ.
enum class Bias : uint8_t { UNBIASED, FAST };

/// How the candidates i = 0..k of a merge share a sample y that several could have made; c_i are their confidences, C
/// the sum of all, p_hat_i their targets, 0 the receiver's own. All but CONSTANT sum to one wherever p_hat_0(y) > 0 and
/// c_0 > 0, and are zero where candidate i cannot make y.
enum class MisWeight : uint8_t {
  /// c_i / C, "1/M". Biased: counts candidates that could never have made y. [Bitterli et al. 2020] Alg. 4
  CONSTANT,
  /// c_i / (sum of the c_j with p_hat_j(y) > 0), "1/Z". Noisy where a target is far below the receiver's.
  /// [Bitterli et al. 2020] Alg. 6
  CONTRIBUTION,
  /// c_i p_hat_i(y) / (sum of c_j p_hat_j(y)), the generalised balance heuristic.
  /// [Lin et al. 2022, Generalized Resampled Importance Sampling]
  BALANCE,
  /// Each neighbour is weighed against the receiver only, which keeps c_0 / C of every sample.
  /// [Bitterli 2022, Correlations and Reuse for Fast and Accurate Physically Based Light Transport], made defensive as
  /// in
  /// [Lin et al. 2022]
  PAIRWISE,
};

/// The weights that keep a promise at the least cost for this many candidates, the receiver's own included. The only
/// place that knows what bias means.
MisWeight mis_weight_for(Bias bias, int candidates);

/// PAIRWISE share of a neighbour in its own sample y, given its target p_hat_j(y) and the receiver's p_hat_0(y).
double pairwise_weight_of_neighbour(double c_j, double p_hat_j, double c_0, double p_hat_0, double c_sum);

/// PAIRWISE share of the receiver in its own sample y that the pair with neighbour j leaves it; its whole weight is
/// c_0 / C plus the sum of these over all neighbours.
double pairwise_weight_of_receiver(double c_j, double p_hat_j, double c_0, double p_hat_0, double c_sum);

}  // namespace cistern
