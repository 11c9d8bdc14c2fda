#include "lights/light_tree.h"

#include <immintrin.h>

#include <bit>

namespace cistern {

namespace {

using Node = LightTree::Node;
constexpr int kWidth = LightTree::kWidth;

/// Slack of every culling test and floor of every cosine: rounding must never give zero probability to an emitter that
/// can reach the receiver at a grazing angle.
constexpr float kCosineSlack = 1e-3f;
/// Squared distances below this (m^2) count as this, so that a receiver on a point lamp gets finite estimates.
constexpr float kSmallestDistance2 = 1e-24f;

// One lane per child. GCC and Clang give the vector type the arithmetic operators.
using Lanes = __m256;

Lanes all(float v) { return _mm256_set1_ps(v); }
Lanes select(Lanes if_clear, Lanes if_set, Lanes mask) { return _mm256_blendv_ps(if_clear, if_set, mask); }
Lanes at_least(Lanes a, Lanes b) { return _mm256_cmp_ps(a, b, _CMP_GE_OQ); }
/// Of a right triangle with the square of the hypotenuse and the other cathetus.
Lanes cathetus(Lanes square, Lanes other) { return _mm256_sqrt_ps(_mm256_max_ps(square - other * other, all(0.0f))); }

/// An angle by its cosine and sine, both times the same length.
struct Angle {
  Lanes cosine, sine;
};
/// max(a - b, 0), times both lengths.
Angle angle_difference(const Angle& a, Lanes length_a, const Angle& b, Lanes length_b) {
  const Lanes is_within = at_least(a.cosine * length_b, b.cosine * length_a);
  return {select(a.cosine * b.cosine + a.sine * b.sine, length_a * length_b, is_within),
          select(a.sine * b.cosine - a.cosine * b.sine, all(0.0f), is_within)};
}

/// Estimates of the irradiance each child causes: intensity x cosine at the emitter x cosine at the receiver /
/// distance^2, the cosines being the largest that the bounds allow, and zero only where a cosine cannot be positive.
/// Sums are exact enough for lanes of any size to be chosen as often as they weigh.
struct Importances {
  alignas(32) float lane[kWidth];
  alignas(32) double sum[kWidth];  // of the lanes up to and including this one
  double total() const { return sum[kWidth - 1]; }
  double sum_below(int i) const { return i == 0 ? 0.0 : sum[i - 1]; }
};

/// Of four lanes, each with those before it.
__m256d running_sums(__m128 lanes) {
  const __m256d exact = _mm256_cvtps_pd(lanes);
  const __m256d pairs = exact + _mm256_castsi256_pd(_mm256_slli_si256(_mm256_castpd_si256(exact), 8));
  const __m256d lower_pair = _mm256_permute2f128_pd(pairs, pairs, 0x08);
  return pairs + _mm256_permute_pd(lower_pair, 0xf);
}

Importances with_sums(Lanes lanes) {
  const __m256d lower = running_sums(_mm256_castps256_ps128(lanes));
  const __m256d upper = running_sums(_mm256_extractf128_ps(lanes, 1));
  Importances out;
  _mm256_store_ps(out.lane, lanes);
  _mm256_store_pd(out.sum, lower);
  _mm256_store_pd(out.sum + kWidth / 2, upper + _mm256_permute4x64_pd(lower, 0xff));
  return out;
}

/// The lane in whose interval of the sums `target` lies. At least one lane is positive.
int find_lane(const Importances& weights, double target) {
  const __m256d targets = _mm256_set1_pd(target);
  const auto count_below = [targets](const double* sums) {
    return std::popcount(
        static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(_mm256_load_pd(sums), targets, _CMP_LE_OQ))));
  };
  int lane = count_below(weights.sum) + count_below(weights.sum + kWidth / 2);
  // Rounding may carry the target past the last lane.
  if (lane == kWidth) --lane;
  while (weights.lane[lane] == 0.0f) --lane;
  return lane;
}

/// Cosines and sines come times the distance, or both distances of a product: nothing waits for its reciprocal.
Importances importances(const Node& node, const Vec3& position, const Vec3& n) {
  const Lanes dx = _mm256_load_ps(node.center_x) - all(position.x);
  const Lanes dy = _mm256_load_ps(node.center_y) - all(position.y);
  const Lanes dz = _mm256_load_ps(node.center_z) - all(position.z);
  const Lanes d2 = _mm256_max_ps(dx * dx + dy * dy + dz * dz, all(kSmallestDistance2));
  const Lanes d = _mm256_sqrt_ps(d2), inverse_d2 = all(1.0f) / d2;
  const Lanes signed_radius = _mm256_load_ps(node.radius);
  const Lanes sign_bit = all(-0.0f);
  const Lanes radius = _mm256_andnot_ps(sign_bit, signed_radius), r2 = radius * radius;

  // Half angle under which the receiver sees the bounding sphere; pi from inside.
  const Lanes is_inside = at_least(r2, d2);
  const Lanes cos_seen = select(cathetus(d2, radius), -d, is_inside);
  const Lanes sin_seen = select(radius, all(0.0f), is_inside);

  // From the axis of the normals to the receiver, less the spread of the normals, less the extent of the cluster.
  const Lanes along =
      dx * _mm256_load_ps(node.axis_x) + dy * _mm256_load_ps(node.axis_y) + dz * _mm256_load_ps(node.axis_z);
  const Lanes cos_axis = select(-along, _mm256_andnot_ps(sign_bit, along), signed_radius);
  const Lanes cos_normals = _mm256_load_ps(node.cos_normals), sin_normals = _mm256_load_ps(node.sin_normals);
  const Angle off_normals = angle_difference({cos_axis, cathetus(d2, along)}, d, {cos_normals, sin_normals}, all(1.0f));
  const Lanes cos_out = angle_difference(off_normals, d, {cos_seen, sin_seen}, d).cosine * inverse_d2;
  const Lanes cos_emission = _mm256_load_ps(node.cos_emission) - all(kCosineSlack);
  const Lanes from_distance2 = _mm256_max_ps(d2, _mm256_load_ps(node.near_distance2));
  Lanes result = _mm256_load_ps(node.intensity) / from_distance2 * _mm256_max_ps(cos_out, all(kCosineSlack));
  result = _mm256_and_ps(result, at_least(cos_out, cos_emission));

  if (n.x != 0.0f || n.y != 0.0f || n.z != 0.0f) {
    const Lanes cos_n = dx * all(n.x) + dy * all(n.y) + dz * all(n.z);
    const Lanes cos_in = angle_difference({cos_n, cathetus(d2, cos_n)}, d, {cos_seen, sin_seen}, d).cosine * inverse_d2;
    result = result * _mm256_max_ps(cos_in, all(kCosineSlack));
    result = _mm256_and_ps(result, at_least(cos_in, all(-kCosineSlack)));
  }
  return with_sums(result);
}

/// Importances of a node that was chosen: where all vanish, by intensity.
Importances choosable_importances(const Node& node, const Vec3& position, const Vec3& n) {
  const Importances out = importances(node, position, n);
  return out.total() > 0.0 ? out : with_sums(_mm256_load_ps(node.intensity));
}

}  // namespace

LightTree::LightTree(std::span<const LightBounds> emitters)
    : nodes_(build_light_tree(emitters)), parent_of_node_(nodes_.size()), slot_of_emitter_(emitters.size(), kNoSlot) {
  for (uint32_t node = 0; node < nodes_.size(); ++node) {
    for (uint32_t i = 0; i < kWidth; ++i) {
      if (nodes_[node].intensity[i] == 0.0f) continue;
      const uint32_t child = nodes_[node].child[i], slot = node * kWidth + i;
      if (child & kLeafBit)
        slot_of_emitter_[child & ~kLeafBit] = slot;
      else
        parent_of_node_[child] = slot;
    }
  }
}

float LightTree::irradiance_estimate(const Vec3& position, const Vec3& n) const {
  return nodes_.empty() ? 0.0f : static_cast<float>(importances(nodes_[0], position, n).total());
}

std::optional<LightTree::Choice> LightTree::choose(const Vec3& position, const Vec3& n, double u) const {
  if (nodes_.empty()) return std::nullopt;
  Importances weights = importances(nodes_[0], position, n);
  if (!(weights.total() > 0.0)) return std::nullopt;
  double pmf = 1.0;
  for (uint32_t node = 0;;) {
    const double target = u * weights.total();
    const int chosen = find_lane(weights, target);
    u = std::clamp((target - weights.sum_below(chosen)) / weights.lane[chosen], 0.0, kDoubleOneMinusEpsilon);
    pmf *= weights.lane[chosen] / weights.total();
    const uint32_t child = nodes_[node].child[chosen];
    if (child & kLeafBit) return Choice{child & ~kLeafBit, static_cast<float>(pmf), u};
    node = child;
    weights = choosable_importances(nodes_[node], position, n);
  }
}

float LightTree::pmf(uint32_t emitter, const Vec3& position, const Vec3& n) const {
  double pmf = 1.0;
  uint32_t slot = slot_of_emitter_[emitter];
  if (slot == kNoSlot) return 0.0f;
  for (;;) {
    const uint32_t node = slot / kWidth;
    const Importances weights =
        node == 0 ? importances(nodes_[0], position, n) : choosable_importances(nodes_[node], position, n);
    if (weights.lane[slot % kWidth] == 0.0f) return 0.0f;
    pmf *= weights.lane[slot % kWidth] / weights.total();
    if (node == 0) return static_cast<float>(pmf);
    slot = parent_of_node_[node];
  }
}

size_t LightTree::memory_bytes() const {
  return nodes_.capacity() * sizeof(Node) +
         (parent_of_node_.capacity() + slot_of_emitter_.capacity()) * sizeof(uint32_t);
}

}  // namespace cistern
