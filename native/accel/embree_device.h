#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "accel/embree.h"

namespace cistern {

/// An Embree device, shared by all accels that descend from one another.
class EmbreeDevice {
 public:
  EmbreeDevice();
  ~EmbreeDevice();
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;

  RTCDevice get() const { return device_; }
  /// Bytes that Embree holds now for everything made on this device.
  size_t memory_bytes() const { return memory_bytes_.load(std::memory_order_relaxed); }
  /// What it holds more than before; 0 where others, who share the device, have freed more meanwhile.
  size_t memory_bytes_since(size_t before) const {
    const size_t now = memory_bytes();
    return now > before ? now - before : 0;
  }
  /// Throws Error with Embree's words when an earlier call on this thread failed. `doing` says what was tried.
  void check(const std::string& doing) const;

 private:
  static bool count_memory(void* device, ssize_t bytes, bool post);

  RTCDevice device_;
  std::atomic<size_t> memory_bytes_{0};
};

struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
struct ReleaseGeometry {
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene>;
using EmbreeGeometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, ReleaseGeometry>;

/// An empty scene with this project's flags; `is_filtered`: one that a HitFilter works in, which is slower.
EmbreeScene new_scene(const EmbreeDevice& device, bool is_filtered);

/// Asked from any thread whether to give up; an empty one is not asked.
using IsStopped = std::function<bool()>;

/// Builds with the threads of the caller's arena. False when it was stopped; the scene is then good for nothing but to
/// be released. Throws as EmbreeDevice::check.
bool commit_scene(const EmbreeDevice& device, RTCScene scene, const IsStopped& is_stopped, const std::string& doing);

}  // namespace cistern
