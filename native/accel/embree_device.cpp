#include "accel/embree_device.h"

#include "accel/accel.h"
#include "base/check.h"
#include "base/shared_library.h"

namespace cistern {
namespace {

const char* error_text(RTCError code) {
  switch (code) {
    case RTC_ERROR_NONE:
      return "no error";
    case RTC_ERROR_INVALID_ARGUMENT:
      return "invalid argument";
    case RTC_ERROR_INVALID_OPERATION:
      return "invalid operation";
    case RTC_ERROR_OUT_OF_MEMORY:
      return "out of memory";
    case RTC_ERROR_UNSUPPORTED_CPU:
      return "unsupported processor";
    case RTC_ERROR_CANCELLED:
      return "cancelled";
    default:
      return "unknown error";
  }
}

bool goes_on(void* is_stopped, double) { return !(*static_cast<const IsStopped*>(is_stopped))(); }

}  // namespace

EmbreeDevice::EmbreeDevice() : device_(rtcNewDevice(nullptr)) {
  if (!device_) throw Error("Embree", std::string("no device: ") + error_text(rtcGetDeviceError(nullptr)));
  if (rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) == 0) {
    rtcReleaseDevice(device_);
    throw Error("Embree", "was built without ray masks, which object visibility needs");
  }
  rtcSetDeviceMemoryMonitorFunction(device_, count_memory, this);
}

EmbreeDevice::~EmbreeDevice() { rtcReleaseDevice(device_); }

bool EmbreeDevice::count_memory(void* device, ssize_t bytes, bool) {
  static_cast<EmbreeDevice*>(device)->memory_bytes_.fetch_add(static_cast<size_t>(bytes), std::memory_order_relaxed);
  return true;
}

void EmbreeDevice::check(const std::string& doing) const {
  const RTCError code = rtcGetDeviceError(device_);
  if (code != RTC_ERROR_NONE) throw Error("Embree", doing + ": " + error_text(code));
}

EmbreeScene new_scene(const EmbreeDevice& device, bool is_filtered) {
  EmbreeScene scene(rtcNewScene(device.get()));
  device.check("making a scene");
  // Robust costs 15 to 20 % of traversal in a Cornell box and saves the rays that slip through edges: 1 in 1,000 of
  // those aimed at one in the watertightness test. It rules out spatial splits (high quality), whose build costs 3 to 5
  // times as much for about 30 % faster incoherent rays in dense meshes.
  const unsigned filter = is_filtered ? kFilteredScene : RTC_SCENE_FLAG_NONE;
  rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | filter));
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  return scene;
}

bool commit_scene(const EmbreeDevice& device, RTCScene scene, const IsStopped& is_stopped, const std::string& doing) {
  if (!is_stopped) {
    rtcJoinCommitScene(scene);
    device.check(doing);
    return true;
  }
  if (is_stopped()) return false;
  rtcSetSceneProgressMonitorFunction(scene, goes_on, const_cast<IsStopped*>(&is_stopped));
  rtcJoinCommitScene(scene);
  const RTCError code = rtcGetDeviceError(device.get());
  if (code == RTC_ERROR_CANCELLED) return false;
  if (code != RTC_ERROR_NONE) throw Error("Embree", doing + ": " + error_text(code));
  rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
  return true;
}

void check_embree_version() {
  const RTCDevice device = rtcNewDevice(nullptr);
  const ssize_t found = device ? rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION) : 0;
  if (device) rtcReleaseDevice(device);
  if (found == RTC_VERSION) return;
  throw Error("Embree", "version " + std::to_string(found) + " answered: must be " + std::to_string(RTC_VERSION) +
                            ", the one this was built with (another library in the process has taken over its names)");
}

std::string embree_version() { return RTC_VERSION_STRING; }

std::string embree_library() { return library_of(reinterpret_cast<const void*>(&rtcNewDevice)); }

}  // namespace cistern
