// An OpenNI2 driver for tests: one synthetic live device with depth and colour, so that library, recorder and player
// are the real ones.
//
// LUMIGRAFT_TEST_UNPLUG_AFTER=N in the environment makes the device disappear after N frames. LUMIGRAFT_TEST_PLUG names
// a folder; the device behaves by the names of the files in it. "absent": unplugged. "frozen": no frames. "paced":
// frames arrive at their times. "in-use": cannot be opened. One frame of eight: "lossy" omits it, "repeating" repeats
// it, "swapping" sends it after its successor, "late" sends it 80 ms late (depth). "jumped": the device's clock is an
// hour ahead. "resized": frames of half the height. Exposure and gain of colour are automatic at first; "stubborn":
// they stay so. Settings made before the start are lost, as on a PS1080.
#include <OniCTypes.h>
#include <unistd.h>

#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete pointer
#include <Driver/OniDriverAPI.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <thread>

#include "tests/capture/live/openni_test_pictures.h"

namespace {

using lumigraft::test::device_color;
using lumigraft::test::device_depth;
using lumigraft::test::device_time_us;
using lumigraft::test::kDeviceFps;
using lumigraft::test::kDeviceHeight;
using lumigraft::test::kDeviceHurries;
using lumigraft::test::kDeviceMaxDepth;
using lumigraft::test::kDeviceWidth;

bool plug_says(const char* what) {
  const char* folder = std::getenv("LUMIGRAFT_TEST_PLUG");
  return folder != nullptr && access((std::string(folder) + "/" + what).c_str(), F_OK) == 0;
}

class TestStream : public oni::driver::StreamBase {
 public:
  TestStream(OniSensorType sensor, int last, std::function<void()> unplug)
      : sensor_(sensor), last_(last), unplug_(std::move(unplug)) {}
  ~TestStream() override { stop_running(); }

  OniStatus start() override {
    running_ = true;
    automatic_ = {TRUE, TRUE};
    light_ = kUsualLight;
    thread_ = std::thread([this] { run(); });
    return ONI_STATUS_OK;
  }
  void stop() override { stop_running(); }

  OniBool isPropertySupported(int id) override {
    return id == ONI_STREAM_PROPERTY_VIDEO_MODE || id == ONI_STREAM_PROPERTY_CROPPING ||
           id == ONI_STREAM_PROPERTY_MIRRORING || (depth() ? id == ONI_STREAM_PROPERTY_MAX_VALUE : is_light(id));
  }
  OniStatus getProperty(int id, void* data, int* size) override {
    if (id == ONI_STREAM_PROPERTY_VIDEO_MODE) {
      return give(mode(), data, size);
    }
    if (id == ONI_STREAM_PROPERTY_CROPPING) {  // without an answer, a recording of the device plays nothing
      return give(OniCropping{}, data, size);
    }
    if (id == ONI_STREAM_PROPERTY_MIRRORING) {
      return give(OniBool{mirrored_}, data, size);
    }
    if (!depth() && is_light(id)) {
      return id < ONI_STREAM_PROPERTY_EXPOSURE
                 ? give(automatic_[id - ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE], data, size)
                 : give(light_[id - ONI_STREAM_PROPERTY_EXPOSURE], data, size);
    }
    return depth() && id == ONI_STREAM_PROPERTY_MAX_VALUE ? give(kDeviceMaxDepth, data, size)
                                                          : ONI_STATUS_NOT_IMPLEMENTED;
  }
  OniStatus setProperty(int id, const void* data, int /*size*/) override {
    if (id == ONI_STREAM_PROPERTY_MIRRORING) {
      mirrored_ = *static_cast<const OniBool*>(data);
      return ONI_STATUS_OK;
    }
    if (!depth() && is_light(id)) {
      return set_light(id, data);
    }
    return id == ONI_STREAM_PROPERTY_VIDEO_MODE ? ONI_STATUS_OK : ONI_STATUS_NOT_IMPLEMENTED;
  }

 private:
  static bool is_light(int id) {
    return id >= ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE && id <= ONI_STREAM_PROPERTY_GAIN;
  }
  OniStatus set_light(int id, const void* data) {
    constexpr int kLargest = 255;
    if (id < ONI_STREAM_PROPERTY_EXPOSURE) {
      automatic_[id - ONI_STREAM_PROPERTY_AUTO_WHITE_BALANCE] =
          plug_says("stubborn") ? TRUE : *static_cast<const OniBool*>(data);
      return ONI_STATUS_OK;
    }
    const int value = *static_cast<const int*>(data);
    if (value < 1 || value > kLargest) {
      return ONI_STATUS_BAD_PARAMETER;
    }
    light_[id - ONI_STREAM_PROPERTY_EXPOSURE] = value;
    return ONI_STATUS_OK;
  }
  bool depth() const { return sensor_ == ONI_SENSOR_DEPTH; }
  OniVideoMode mode() const {
    return {depth() ? ONI_PIXEL_FORMAT_DEPTH_1_MM : ONI_PIXEL_FORMAT_RGB888, kDeviceWidth, kDeviceHeight, kDeviceFps};
  }
  template <typename T>
  static OniStatus give(const T& value, void* data, int* size) {
    if (*size != static_cast<int>(sizeof(T))) {
      return ONI_STATUS_ERROR;
    }
    std::memcpy(data, &value, sizeof(T));
    return ONI_STATUS_OK;
  }
  void stop_running() {
    running_ = false;
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  void run() {
    const auto begin = std::chrono::steady_clock::now();
    const bool hurries = kDeviceHurries && !plug_says("paced");
    for (int index = 0; running_; ++index) {
      if (hurries) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      } else {
        std::this_thread::sleep_until(begin + std::chrono::microseconds(device_time_us(index) - device_time_us(0)));
      }
      if ((last_ >= 0 && index >= last_) || plug_says("absent")) {
        unplug_();
        return;
      }
      if (!plug_says("frozen")) {
        show(index);
      }
    }
  }
  /// Sends a frame, changed by the faults that are set.
  void show(int index) {
    constexpr int kPeriod = 8, kAfterIt = 5;
    constexpr std::chrono::milliseconds kSoon{10};  // the library keeps only the newest frame until it is read
    if (index % kPeriod == kAfterIt && plug_says("swapping")) {
      send(index);
      std::this_thread::sleep_for(kSoon);
      send(index - 1);
      return;
    }
    const bool faulty = index % kPeriod == kAfterIt - 1;
    if (faulty && (plug_says("lossy") || plug_says("swapping"))) {
      return;
    }
    if (depth() && plug_says("late")) {  // delays the following frames too
      std::this_thread::sleep_for(faulty ? std::chrono::milliseconds(80) : kSoon);
    }
    send(index);
    if (faulty && plug_says("repeating")) {
      std::this_thread::sleep_for(kSoon);
      send(index);
    }
  }
  void send(int index) {
    OniFrame* frame = getServices().acquireFrame();
    if (frame == nullptr) {
      return;
    }
    const int pixel_bytes = depth() ? 2 : 3;
    frame->sensorType = sensor_;
    frame->frameIndex = index + 1;
    constexpr std::int64_t kHour_us = 3'600'000'000;
    frame->timestamp = static_cast<std::uint64_t>(device_time_us(index) + (plug_says("jumped") ? kHour_us : 0));
    const int height = plug_says("resized") ? kDeviceHeight / 2 : kDeviceHeight;
    frame->videoMode = mode();
    frame->videoMode.resolutionY = height;
    frame->width = kDeviceWidth;
    frame->height = height;
    frame->croppingEnabled = FALSE;
    frame->cropOriginX = frame->cropOriginY = 0;
    frame->stride = kDeviceWidth * pixel_bytes;
    frame->dataSize = frame->stride * height;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < kDeviceWidth; ++x) {
        const int seen_x = mirrored_ ? kDeviceWidth - 1 - x : x;
        if (depth()) {
          static_cast<std::uint16_t*>(frame->data)[y * kDeviceWidth + x] = device_depth(index, seen_x, y);
        } else {
          for (int c = 0; c < 3; ++c) {
            static_cast<std::uint8_t*>(frame->data)[3 * (y * kDeviceWidth + x) + c] = device_color(index, seen_x, y, c);
          }
        }
      }
    }
    raiseNewFrame(frame);
    getServices().releaseFrame(frame);
  }

  OniSensorType sensor_;
  int last_;
  std::function<void()> unplug_;
  std::atomic<bool> running_{false};
  std::atomic<OniBool> mirrored_{TRUE};  // as real depth cameras start
  static constexpr std::array<int, 2> kUsualLight = {50, 100};
  std::array<OniBool, 2> automatic_ = {TRUE, TRUE};  ///< white balance, exposure
  std::array<int, 2> light_ = kUsualLight;           ///< exposure, gain
  std::thread thread_;
};

class TestDevice : public oni::driver::DeviceBase {
 public:
  TestDevice(int last, std::function<void()> unplug) : last_(last), unplug_(std::move(unplug)) {
    modes_[0] = {ONI_PIXEL_FORMAT_DEPTH_1_MM, kDeviceWidth, kDeviceHeight, kDeviceFps};
    modes_[1] = {ONI_PIXEL_FORMAT_RGB888, kDeviceWidth, kDeviceHeight, kDeviceFps};
    sensors_[0] = {ONI_SENSOR_DEPTH, 1, &modes_[0]};
    sensors_[1] = {ONI_SENSOR_COLOR, 1, &modes_[1]};
  }
  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = sensors_;
    *count = 2;
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType sensor) override {
    return sensor == ONI_SENSOR_DEPTH || sensor == ONI_SENSOR_COLOR ? new TestStream(sensor, last_, unplug_) : nullptr;
  }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }
  OniStatus setProperty(int id, const void*, int) override {
    return id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION ? ONI_STATUS_OK : ONI_STATUS_NOT_IMPLEMENTED;
  }
  OniStatus getProperty(int id, void* data, int* size) override {
    constexpr char kSerial[] = "LG-0042";
    if (id != ONI_DEVICE_PROPERTY_SERIAL_NUMBER || *size < static_cast<int>(sizeof kSerial)) {
      return ONI_STATUS_NOT_IMPLEMENTED;
    }
    std::memcpy(data, kSerial, sizeof kSerial);
    *size = sizeof kSerial;
    return ONI_STATUS_OK;
  }
  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode) override { return TRUE; }

 private:
  int last_;
  std::function<void()> unplug_;
  OniVideoMode modes_[2] = {};
  OniSensorInfo sensors_[2] = {};
};

class TestDriver : public oni::driver::DriverBase {
 public:
  explicit TestDriver(OniDriverServices* services) : DriverBase(services) {
    std::strcpy(info_.uri, "lumigraft-test");
    std::strcpy(info_.vendor, "lumigraft");
    std::strcpy(info_.name, "test device");
  }
  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    if (!plug_says("absent")) {
      deviceConnected(&info_);
    }
    return ONI_STATUS_OK;
  }
  oni::driver::DeviceBase* deviceOpen(const char*, const char*) override {
    if (plug_says("in-use")) {  // as PrimeSense's driver, which gets this error from libusb
      getServices().errorLoggerAppend("Failed to open the USB device: device is busy");
      return nullptr;
    }
    const char* last = std::getenv("LUMIGRAFT_TEST_UNPLUG_AFTER");
    gone_ = false;
    return new TestDevice(last == nullptr ? -1 : std::atoi(last), [this] {
      if (!gone_.exchange(true)) {
        deviceDisconnected(&info_);
      }
    });
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
  void shutdown() override {}

 private:
  OniDeviceInfo info_ = {};
  std::atomic<bool> gone_{false};
};

}  // namespace

ONI_EXPORT_DRIVER(TestDriver)
