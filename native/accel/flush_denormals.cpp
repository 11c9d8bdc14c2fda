#include <immintrin.h>

#include "accel/accel.h"

namespace cistern {
namespace {

constexpr unsigned kFlushToZeroAndDenormalsAreZero = 0x8040;

}  // namespace

FlushDenormals::FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | kFlushToZeroAndDenormalsAreZero); }

FlushDenormals::~FlushDenormals() {
  // Only the two modes are put back: exception flags raised meanwhile stay.
  _mm_setcsr((_mm_getcsr() & ~kFlushToZeroAndDenormalsAreZero) | (saved_ & kFlushToZeroAndDenormalsAreZero));
}

}  // namespace cistern
