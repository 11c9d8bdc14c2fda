#include "resampling/mis_weight.h"

namespace cistern {
namespace {

struct Pair {
  double neighbour, receiver;
};

/// The two sides of a pair's balance heuristic: all neighbours together stand against the receiver.
Pair pair(double p_hat_j, double c_0, double p_hat_0, double c_sum) { return {(c_sum - c_0) * p_hat_j, c_0 * p_hat_0}; }

}  // namespace

MisWeight mis_weight_for(Bias bias, int candidates) {
  if (bias == Bias::FAST) return MisWeight::CONSTANT;
  // With two candidates the balance heuristic has the lowest variance and asks for no more targets than the pair does.
  return candidates <= 2 ? MisWeight::BALANCE : MisWeight::PAIRWISE;
}

double pairwise_weight_of_neighbour(double c_j, double p_hat_j, double c_0, double p_hat_0, double c_sum) {
  const Pair p = pair(p_hat_j, c_0, p_hat_0, c_sum);
  const double both = p.neighbour + p.receiver;
  return both > 0.0 ? c_j / c_sum * (p.neighbour / both) : 0.0;
}

double pairwise_weight_of_receiver(double c_j, double p_hat_j, double c_0, double p_hat_0, double c_sum) {
  const Pair p = pair(p_hat_j, c_0, p_hat_0, c_sum);
  const double both = p.neighbour + p.receiver;
  return both > 0.0 ? c_j / c_sum * (p.receiver / both) : 0.0;
}

}  // namespace cistern
