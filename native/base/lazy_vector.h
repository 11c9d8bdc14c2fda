#pragma once

#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace cistern {

/// Leaves new elements without a value unless one is given.
template <class T>
struct LazyAllocator : std::allocator<T> {
  template <class U>
  struct rebind {  // NOLINT(readability-identifier-naming): the standard's
    using other = LazyAllocator<U>;
  };
  template <class U>
  void construct(U*) noexcept {
    static_assert(std::is_trivially_copyable_v<U> && std::is_trivially_destructible_v<U>);
  }
  template <class U, class... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    std::construct_at(place, std::forward<Arguments>(arguments)...);
  }
};

/// A vector whose `resize` costs nothing: elements added by it must be assigned before they are read. For buffers of
/// the size of a picture, whose memory is then first touched by the threads that fill it, not by the one that asks.
template <class T>
using LazyVector = std::vector<T, LazyAllocator<T>>;

}  // namespace cistern
