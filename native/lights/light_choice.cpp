#include "lights/light_choice.h"

#include <numeric>

namespace cistern {

namespace {

/// Where both kinds may light a receiver neither gets less of the samples: neither estimate knows about occlusion, and
/// indoors or in a lit street at night they are wrong by orders of magnitude.
constexpr float kSmallestShare = 0.3f;
/// Of an even sky that is looked for through portals alone: BSDF samples find it, too.
constexpr float kSmallestPortalShare = 0.03f;
/// As in the light tree: rounding at grazing angles must not exclude a light.
constexpr float kCosineSlack = 1e-3f;

}  // namespace

LightChoice::LightChoice(std::span<const EmitterEstimate> emitters, LightSampling sampling)
    : sampling_(sampling), count_(static_cast<uint32_t>(emitters.size())) {
  if (sampling == LightSampling::UNIFORM) return;
  std::vector<float> powers;
  powers.reserve(emitters.size());
  for (const EmitterEstimate& e : emitters) powers.push_back(e.power);
  if (sampling == LightSampling::POWER) {
    power_ = AliasTable(powers);
    return;
  }
  const float total_power = std::accumulate(powers.begin(), powers.end(), 0.0f);
  for (float& power : powers) power = total_power > 0.0f ? power / total_power : 1.0f / static_cast<float>(count_);
  power_pmf_ = std::move(powers);
  std::vector<LightBounds> bounds;
  leaf_of_.resize(emitters.size());
  for (uint32_t i = 0; i < count_; ++i) {
    const EmitterEstimate& e = emitters[i];
    if (e.is_distant) {
      leaf_of_[i] = kDistantBit | static_cast<uint32_t>(distant_.size());
      distant_.push_back({i, e.direction, e.cos_half_angle, e.irradiance, e.portals});
      only_portals_ = only_portals_ && e.portals;
    } else {
      leaf_of_[i] = static_cast<uint32_t>(finite_.size());
      finite_.push_back(i);
      bounds.push_back(e.bounds);
    }
  }
  tree_ = LightTree(bounds);
}

std::optional<LightChoice::Result> LightChoice::choose(const Vec3& position, const Vec3& n, double u) const {
  if (count_ == 0) return std::nullopt;
  if (sampling_ == LightSampling::TREE) return choose_by_tree(position, n, u);
  if (sampling_ == LightSampling::POWER && !power_.is_empty()) {
    const uint32_t emitter = power_.sample(u);
    return Result{emitter, power_.pmf(emitter)};
  }
  const auto emitter = static_cast<uint32_t>(u * count_);
  return Result{std::min(emitter, count_ - 1), 1.0f / static_cast<float>(count_)};
}

float LightChoice::pmf(uint32_t emitter, const Vec3& position, const Vec3& n) const {
  if (sampling_ == LightSampling::TREE) return pmf_by_tree(emitter, position, n);
  if (sampling_ == LightSampling::POWER && !power_.is_empty()) return power_.pmf(emitter);
  return 1.0f / static_cast<float>(count_);
}

float LightChoice::receiver_free_pmf(uint32_t emitter) const {
  if (sampling_ == LightSampling::TREE) return power_pmf_[emitter];
  if (sampling_ == LightSampling::POWER && !power_.is_empty()) return power_.pmf(emitter);
  return 1.0f / static_cast<float>(count_);
}

float LightChoice::estimate(const Distant& distant, const Vec3& position, const Vec3& n) {
  if (distant.portals) return distant.irradiance * distant.portals->seen_share(position);
  if (distant.direction == Vec3{} || n == Vec3{}) return distant.irradiance;
  const float cosine = dot(distant.direction, n);
  const float cos_half = distant.cos_half_angle;
  if (cosine >= cos_half) return distant.irradiance;
  const float best = cosine * cos_half + safe_sqrt(1.0f - sqr(cosine)) * safe_sqrt(1.0f - sqr(cos_half));
  return best < -kCosineSlack ? 0.0f : distant.irradiance * std::max(best, kCosineSlack);
}

float LightChoice::distant_estimate(const Vec3& position, const Vec3& n) const {
  float total = 0.0f;
  for (const Distant& distant : distant_) total += estimate(distant, position, n);
  return total;
}

float LightChoice::distant_share(float distant, const Vec3& position, const Vec3& n) const {
  if (distant == 0.0f) return 0.0f;
  const float finite = tree_.irradiance_estimate(position, n);
  if (finite == 0.0f) return 1.0f;
  const float smallest = only_portals_ ? kSmallestPortalShare : kSmallestShare;
  return std::clamp(distant / (distant + finite), smallest, 1.0f - kSmallestShare);
}

LightChoice::Result LightChoice::choose_distant(const Vec3& position, const Vec3& n, float total, double u) const {
  double target = u * total;
  Result result{};
  for (const Distant& distant : distant_) {
    const float weight = estimate(distant, position, n);
    if (weight == 0.0f) continue;
    result = {distant.emitter, weight / total};
    if (target < weight) break;
    target -= weight;
  }
  return result;
}

std::optional<LightChoice::Result> LightChoice::choose_by_tree(const Vec3& position, const Vec3& n, double u) const {
  const float distant = distant_estimate(position, n);
  const float share = distant_share(distant, position, n);
  if (u < share) {
    const Result result = choose_distant(position, n, distant, u / share);
    return Result{result.emitter, share * result.pmf};
  }
  const auto choice = tree_.choose(position, n, std::min((u - share) / (1.0 - share), kDoubleOneMinusEpsilon));
  if (!choice) return std::nullopt;
  return Result{finite_[choice->emitter], (1.0f - share) * choice->pmf};
}

float LightChoice::pmf_by_tree(uint32_t emitter, const Vec3& position, const Vec3& n) const {
  const float distant = distant_estimate(position, n);
  const float share = distant_share(distant, position, n);
  const uint32_t leaf = leaf_of_[emitter];
  if (leaf & kDistantBit) {
    return distant == 0.0f ? 0.0f : share * estimate(distant_[leaf & ~kDistantBit], position, n) / distant;
  }
  return share == 1.0f ? 0.0f : (1.0f - share) * tree_.pmf(leaf, position, n);
}

size_t LightChoice::memory_bytes() const {
  return power_.memory_bytes() + tree_.memory_bytes() + (finite_.capacity() + leaf_of_.capacity()) * sizeof(uint32_t) +
         power_pmf_.capacity() * sizeof(float) + distant_.capacity() * sizeof(Distant);
}

}  // namespace cistern
