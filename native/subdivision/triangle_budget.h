#pragma once

#include <atomic>
#include <cstddef>

namespace cistern {

/// How many triangles may still be made, asked from any thread.
class TriangleBudget {
 public:
  explicit TriangleBudget(size_t most) : most_(most) {}

  /// False once there are too many: nothing that is made is needed any more.
  bool take(size_t triangles) { return (taken_ += triangles) <= most_; }
  bool is_exceeded() const { return taken_ > most_; }
  size_t most() const { return most_; }

 private:
  size_t most_;
  std::atomic<size_t> taken_{0};
};

}  // namespace cistern
