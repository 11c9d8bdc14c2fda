#include "transport/uneven_media.h"

#include <algorithm>
#include <cmath>

namespace cistern {
namespace {

/// Of a ray; more means that it left a surface that is not closed far behind: the rest is taken for void.
constexpr int kMostCollisions = 1 << 16;
/// How dense media are compared with their bounds, about.
constexpr float kTypical = 0.5f;

float mean_magnitude(Rgb c) { return (std::abs(c.r) + std::abs(c.g) + std::abs(c.b)) * (1.0f / 3.0f); }

/// Walks along a ray, and sums up on the way.
class Collisions {
 public:
  /// At the rate of `factor` times the bounds and `even` per metre.
  Collisions(const UnevenRay& ray, float length, float even, float factor = 1.0f)
      : along_(ray), length_(length), even_(even), factor_(factor) {}

  /// On by an optical depth; false where the end comes first.
  bool move(float depth) {
    for (;;) {
      const float end = std::max(std::min(along_.end(), length_), distance_);
      const float step = rate() > 0.0f ? rate() * (end - distance_) : 0.0f;
      if (depth < step) {
        distance_ = std::min(distance_ + depth / rate(), end);
        return true;
      }
      depth -= step;
      depth_ += step;
      distance_ = end;
      if (!(distance_ < length_)) return false;
      along_.advance();
    }
  }
  bool next(PathSampler& sampler) { return ++count_ <= kMostCollisions && move(-std::log1p(-sampler.next_float())); }

  float distance() const { return distance_; }
  float rate() const { return even_ + factor_ * along_.bound(); }
  /// Passed in all, once the end is reached.
  float depth() const { return depth_; }

 private:
  BoundsAlong along_;
  float length_, even_, factor_;
  float distance_ = 0.0f, depth_ = 0.0f;
  int count_ = 0;
};

}  // namespace

BoundsAlong::BoundsAlong(const UnevenRay& ray) : ray_(ray) {
  for (const MediaStack::Entry& entry : ray.segment.uneven) {
    if (entry.instance == MediaStack::kWorld) {
      world_ = ray.media.world_bounds_along(ray.origin, ray.direction);
      world_bound_ = find_world_bound();
    } else {
      walks_[count_++] = ray.media.bounds_along(entry, ray.origin, ray.direction);
    }
  }
  add_up();
}

void BoundsAlong::advance() {
  const float end = end_;
  if (world_ && world_->end() <= end) {
    world_->advance();
    world_bound_ = find_world_bound();
  }
  for (size_t i = 0; i < count_; ++i)
    if (walks_[i].end() <= end) walks_[i].advance();
  add_up();
}

/// Blocks far away are large, and some have both: ground below which fog gets denser without end, and the ray above. Of
/// one that would take many steps it is what a few places on the ray have.
float BoundsAlong::find_world_bound() const {
  constexpr float kManySteps = 32.0f, kSlack = 2.0f;
  constexpr int kLooks = 8;
  const float length = world_->end() - world_->begin();
  if (!(world_->bound() * length > kManySteps) || std::isinf(length)) return world_->bound();
  float largest = 0.0f;
  for (int i = 0; i < kLooks; ++i) {
    const float distance = world_->begin() + length * (static_cast<float>(i) + 0.5f) / kLooks;
    const Medium medium = ray_.media.world_at(ray_.path, ray_.direction, ray_.origin + distance * ray_.direction);
    largest = std::max(largest, max_component(medium.extinction));
  }
  return std::clamp(kSlack * largest, kManySteps / length, world_->bound());
}

void BoundsAlong::add_up() {
  bound_ = world_bound_;
  end_ = world_ ? world_->end() : INFINITY;
  for (size_t i = 0; i < count_; ++i) {
    bound_ += walks_[i].bound();
    end_ = std::min(end_, walks_[i].end());
  }
}

Rgb estimate_transmittance(const UnevenRay& ray, float length, PathSampler& sampler) {
  constexpr float kDim = 0.05f;  // below, most estimates end: what they cost is worth more elsewhere
  Rgb result = medium_transmittance(ray.segment.even, length);
  for (Collisions collisions(ray, length, 0.0f); collisions.next(sampler);) {
    const Vec3 place = ray.origin + collisions.distance() * ray.direction;
    const Medium uneven = ray.media.uneven_at(ray.segment, ray.path, ray.direction, place);
    result *= Rgb(1.0f) - uneven.extinction * (1.0f / collisions.rate());
    const float size = mean_magnitude(result);
    if (size >= kDim) continue;
    if (!(sampler.next_float() * kDim < size)) return Rgb(0.0f);
    result *= kDim / size;
  }
  return result;
}

namespace {

/// Of an endless ray: summed up on the way to where nothing is left.
Rgb estimate_endless_radiance(const UnevenRay& ray, PathSampler& sampler) {
  constexpr float kDim = 0.05f;
  Rgb result, passed(1.0f);
  for (Collisions collisions(ray, INFINITY, 0.0f); collisions.next(sampler);) {
    const Medium medium = ray.at(collisions.distance());
    const float over_rate = 1.0f / collisions.rate();
    result += passed * medium.emission * over_rate;
    passed *= Rgb(1.0f) - medium.extinction * over_rate;
    const float size = mean_magnitude(passed);
    if (size >= kDim) continue;
    if (!(sampler.next_float() * kDim < size)) break;
    passed *= kDim / size;
  }
  return result;
}

}  // namespace

Rgb estimate_radiance(const UnevenRay& ray, float length, PathSampler& sampler) {
  if (std::isinf(length)) return estimate_endless_radiance(ray, sampler);
  const float t = sampler.next_float() * length;
  const Rgb emission = ray.at(t).emission;
  return is_black(emission) ? Rgb(0.0f) : emission * estimate_transmittance(ray, t, sampler) * length;
}

UnevenFlight sample_flight(const UnevenRay& ray, Rgb throughput, float length, PathSampler& sampler) {
  UnevenFlight flight{std::nullopt, Rgb(1.0f), {}};
  for (Collisions collisions(ray, length, max_component(ray.segment.even.extinction)); collisions.next(sampler);) {
    const float rate = collisions.rate();
    flight.medium = ray.at(collisions.distance());
    const Rgb rest = Rgb(rate) - flight.medium.extinction, carried = throughput * flight.weight;
    const float scattered = mean_magnitude(carried * flight.medium.scattering), passed = mean_magnitude(carried * rest);
    const float sum = scattered + passed;
    if (!(sum > 0.0f) || !std::isfinite(sum)) return {std::nullopt, Rgb(0.0f), {}};
    if (sampler.next_float() * sum < scattered) {
      flight.distance = collisions.distance();
      flight.weight *= flight.medium.scattering * (sum / (scattered * rate));
      return flight;
    }
    flight.weight *= rest * (sum / (passed * rate));
  }
  return flight;
}

UnevenDistances::UnevenDistances(const UnevenRay& ray, float length)
    : ray_(ray), length_(length), even_(average(ray.segment.even.extinction)) {
  Collisions to_end(ray_, length_, even_, kTypical);
  to_end.move(INFINITY);
  share_ = -std::expm1(-to_end.depth());
}

float UnevenDistances::sample(float u) const {
  Collisions collisions(ray_, length_, even_, kTypical);
  collisions.move(-std::log1p(-u * share_));
  return collisions.distance();
}

float UnevenDistances::pdf(float distance) const {
  Collisions collisions(ray_, std::min(distance, length_), even_, kTypical);
  collisions.move(INFINITY);
  return share_ > 0.0f ? collisions.rate() * std::exp(-collisions.depth()) / share_ : 0.0f;
}

}  // namespace cistern
