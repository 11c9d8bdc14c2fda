#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

namespace cistern {

/// Blocks of `block_size` (the last one shorter) that cover [0, count).
inline constexpr size_t block_count(size_t count, size_t block_size) { return (count + block_size - 1) / block_size; }

/// Calls body(block, begin, end) for each block of [0, count), in parallel in the task arena of the caller. The blocks
/// do not depend on the number of threads, so results kept per block and joined in order do not either.
template <class Body>
void parallel_blocks(size_t count, size_t block_size, const Body& body) {
  const size_t blocks = block_count(count, block_size);
  if (blocks == 1) return body(size_t{0}, size_t{0}, count);
  tbb::parallel_for(size_t{0}, blocks, [&](size_t block) {
    const size_t begin = block * block_size;
    body(block, begin, std::min(begin + block_size, count));
  });
}

}  // namespace cistern
