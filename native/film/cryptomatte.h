#pragma once

#include <span>
#include <string>

#include "film/sample_rounding.h"

namespace cistern {

/// What mattes can tell apart.
enum class MatteKind : unsigned char { OBJECT, MATERIAL, ASSET };
inline constexpr int kMatteKinds = 3;

/// A share of a pixel: `id` is the matte_id of a name, or 0 for an empty slot.
struct MatteShare {
  float id = 0.0f, weight = 0.0f;
};

/// Adds to the slot of that id, to the first that is empty, or to the last, whosever it is. [Cycles,
/// kernel/film/cryptomatte_passes.h]
void add_matte(std::span<MatteShare> slots, float id, float weight, const SampleRounding& rounding);

/// Largest shares first; equal ones, and what is empty, in their order.
void rank_mattes(std::span<MatteShare> slots);

}  // namespace cistern
