#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

namespace cistern {

/// How many triangles may still be made; everything asked from any thread.
class TriangleBudget {
 public:
  /// `is_stopped`, if there is one, ends it too.
  TriangleBudget(size_t most, const std::function<bool()>& is_stopped) : most_(most), is_stopped_(is_stopped) {}

  /// False once there are too many: what is made is not needed any more.
  bool take(size_t triangles) { return (taken_ += triangles) <= most_; }
  bool is_exceeded() const { return taken_ > most_; }
  bool is_stopped() const { return is_stopped_ && is_stopped_(); }

 private:
  size_t most_;
  const std::function<bool()>& is_stopped_;
  std::atomic<size_t> taken_{0};
};

}  // namespace cistern
