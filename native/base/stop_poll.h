#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

namespace cistern {

/// A question that the thread alone may ask that makes this, for all threads to know the answer: whether to stop.
class StopPoll {
 public:
  /// Without a question the answer is no.
  explicit StopPoll(std::function<bool()> ask) : ask_(std::move(ask)), asker_(std::this_thread::get_id()) {}

  /// From any thread, all the time. Once true it stays so; asks at most every 20 ms.
  bool operator()() {
    if (is_stopped_.load(std::memory_order_relaxed)) return true;
    if (!ask_ || std::this_thread::get_id() != asker_) return false;
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return false;
    next_ = now + std::chrono::milliseconds(20);
    if (ask_()) is_stopped_ = true;
    return is_stopped_;
  }

 private:
  std::function<bool()> ask_;
  std::thread::id asker_;
  std::chrono::steady_clock::time_point next_;
  std::atomic<bool> is_stopped_{false};
};

}  // namespace cistern
