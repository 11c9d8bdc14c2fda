#include "base/direction_lobes.h"

#include <algorithm>
#include <cassert>

#include "base/angle.h"

namespace cistern {
namespace {

constexpr float kFarthest = 4.0f;  // square of the sphere's diameter

}  // namespace

void DirectionLobes::add(const Lobe& added) {
  assert(count_ < kMost);
  lobes_[count_++] = added;
  for (Lobe& lobe : std::span(lobes_.data(), count_ - 1)) lobe.share *= weight_;
  weight_ += added.share;
  for (Lobe& lobe : std::span(lobes_.data(), count_)) {
    lobe.share /= weight_;
    lobe.at_axis = lobe.share * (lobe.square_radius + kFarthest) / (kFarthest * kPi * lobe.square_radius);
  }
}

float DirectionLobes::pdf(const Vec3& w, const Vec3& position) const {
  float sum = 0.0f;
  for (const Lobe& lobe : lobes()) {
    const Vec3 off = w - lobe.axis_at(position);
    sum += lobe.at_axis / sqr(1.0f + dot(off, off) / lobe.square_radius);
  }
  return sum;
}

Vec3 DirectionLobes::sample(Vec2 u, const Vec3& position) const {
  size_t i = 0;
  while (i + 1 < count_ && u.x >= lobes_[i].share) u.x -= lobes_[i++].share;
  const Lobe& lobe = lobes_[i];
  // The part within r is (1 + a^2 / 4) r^2 / (r^2 + a^2).
  const float part = std::min(u.x / lobe.share, kOneMinusEpsilon) * kFarthest / (lobe.square_radius + kFarthest);
  const float square = std::min(lobe.square_radius * part / (1.0f - part), kFarthest);
  const float cosine = 1.0f - 0.5f * square, sine = std::sqrt(square * (1.0f - square / kFarthest));
  const SineCosine turn = sine_cosine_of_turns(u.y);
  return Frame(lobe.axis_at(position)).to_world({sine * turn.cosine, sine * turn.sine, cosine});
}

}  // namespace cistern
