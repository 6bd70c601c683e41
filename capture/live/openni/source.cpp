#include "capture/live/openni/source.h"

#include <OpenNI.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <thread>

#include "capture/camera/camera_serial.h"
#include "capture/error.h"
#include "capture/live/usb_permission.h"

namespace lumigraft::capture {
namespace {

/// OpenNI2's message about its last failure, on one line.
std::string openni_error() {
  std::string text = openni::OpenNI::getExtendedError();
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20; }, ' ');
  text.erase(text.find_last_not_of(' ') + 1);
  return text.empty() ? "no reason given" : text;
}

/// Whether the device of that URI, or for an empty URI any device, is present but without permission.
bool is_forbidden(const std::string& uri) {
  openni::Array<openni::DeviceInfo> devices;
  openni::OpenNI::enumerateDevices(&devices);
  for (int i = 0; i < devices.getSize(); ++i) {
    if ((uri.empty() || uri == devices[i].getUri()) && is_forbidden_usb_device(devices[i].getUri())) return true;
  }
  return false;
}

/// OpenNI2 counts calls of initialize and shutdown, so several objects may exist.
struct Library {
  Library() {
    if (openni::OpenNI::initialize() != openni::STATUS_OK) {
      throw InputError("found no working OpenNI2: " + openni_error());
    }
  }
  ~Library() { openni::OpenNI::shutdown(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
};

/// Notified by OpenNI2's threads when a device is gone or a recording has ended.
class EndListener : public openni::OpenNI::DeviceStateChangedListener,
                    public openni::OpenNI::DeviceDisconnectedListener {
 public:
  EndListener() {
    openni::OpenNI::addDeviceStateChangedListener(this);
    openni::OpenNI::addDeviceDisconnectedListener(this);
  }
  ~EndListener() override {
    openni::OpenNI::removeDeviceStateChangedListener(this);
    openni::OpenNI::removeDeviceDisconnectedListener(this);
  }

  void onDeviceStateChanged(const openni::DeviceInfo* info, openni::DeviceState state) override {
    ended_ = ended_ || (static_cast<int>(state) == ONI_DEVICE_STATE_EOF && uri_ == info->getUri());
  }
  void onDeviceDisconnected(const openni::DeviceInfo* info) override { ended_ = ended_ || uri_ == info->getUri(); }

  void set_uri(const std::string& uri) { uri_ = uri; }
  bool ended() const { return ended_; }

 private:
  std::string uri_;  ///< set before the device starts, constant afterwards
  std::atomic<bool> ended_{false};
};

openni::PixelFormat format_of(const StreamSpec& spec) {
  if (spec.stream != Stream::depth) return openni::PIXEL_FORMAT_RGB888;
  return std::abs(spec.unit_m - 0.0001) < 1e-9 ? openni::PIXEL_FORMAT_DEPTH_100_UM : openni::PIXEL_FORMAT_DEPTH_1_MM;
}

std::string mode_text(const StreamSpec& spec) {
  return size_text(spec.width, spec.height) + " of " +
         (spec.stream != Stream::depth                           ? "8-bit RGB"
          : format_of(spec) == openni::PIXEL_FORMAT_DEPTH_100_UM ? "0.1 mm depth"
                                                                 : "1 mm depth");
}

bool fits(const openni::VideoMode& mode, const StreamSpec& spec) {
  return mode.getResolutionX() == spec.width && mode.getResolutionY() == spec.height &&
         mode.getPixelFormat() == format_of(spec);
}

/// One stream of a device and how far it has been read.
struct Lane {
  StreamSpec spec;
  openni::VideoStream stream;
  int left = 0;  ///< frames of a recording not yet read
  std::optional<int> first_index;
  std::uint64_t next_sequence = 0;
  std::int64_t last_time_ns = 0;
};

/// An open device with its streams, destroyed in the order that OpenNI2 requires.
struct OpenDevice {
  ~OpenDevice() {
    for (const auto& lane : lanes) lane->stream.stop();
    if (device.isValid() && device.isFile()) {
      // OpenNI2's player thread iterates over its list of streams without a lock: continuously while a stream is
      // started, every 10 ms otherwise. Destroying a stream meanwhile crashes it.
      std::this_thread::sleep_for(kOpenNiParameters.player_pause);
    }
    lanes.clear();
    device.close();
  }

  openni::Device device;
  std::vector<std::unique_ptr<Lane>> lanes;
};

}  // namespace

/// A device from opening to closing, or one pass over a recording. The constructor throws InputError with the reason
/// alone.
class OpenNiSource::Reader : public Source {
 public:
  Reader(Kind kind, const std::string& uri, const std::vector<StreamSpec>& specs, std::chrono::milliseconds silence)
      : kind_(kind), silence_(silence) {
    if (device_.open(uri.empty() ? openni::ANY_DEVICE : uri.c_str()) != openni::STATUS_OK) {
      const std::string why = openni_error();  // the next call overwrites it
      if (is_forbidden(uri)) throw CameraFault(kForbiddenUsb);
      throw CameraFault("found nothing OpenNI2 can open: " + why);
    }
    refuse_if(device_.isFile() != (kind == Kind::recording),
              std::string("found a ") + (device_.isFile() ? "recording" : "device") +
                  ", allowed: oni: for recordings, openni2: for devices");
    listener_.set_uri(device_.getDeviceInfo().getUri());
    if (kind == Kind::device) serial_ = serial_of_device();
    for (const StreamSpec& spec : specs) {
      check_serial(serial_, spec.serial);
      rate_hz_ = spec.settings.rate_hz ? spec.settings.rate_hz : rate_hz_;
    }
    for (const StreamSpec& spec : specs) {
      lanes_.push_back(std::make_unique<Lane>());
      lanes_.back()->spec = spec;
      create(*lanes_.back());
    }
    if (kind == Kind::recording) {
      openni::PlaybackControl* playback = device_.getPlaybackControl();
      // -1: one frame per read, independent of its time.
      if (playback == nullptr || playback->setSpeed(-1.0f) != openni::STATUS_OK ||
          playback->setRepeatEnabled(false) != openni::STATUS_OK) {
        throw InputError("found a recording that cannot be stepped: " + openni_error());
      }
      for (const auto& lane : lanes_) {
        lane->left = playback->getNumberOfFrames(lane->stream);
        refuse_if(lane->left <= 0,
                  std::string("found no ") + name_of(lane->spec.stream) + " pictures in the recording");
      }
      std::error_code error;
      left_ = std::filesystem::file_size(uri, error) / kOpenNiParameters.min_frame_bytes;
    } else {
      prepare_device();
    }
    for (const auto& lane : lanes_) {
      if (lane->stream.start() != openni::STATUS_OK) {
        throw CameraFault(std::string("found a ") + name_of(lane->spec.stream) +
                          " stream that does not start: " + openni_error());
      }
      if (kind == Kind::device) fix_exposure(*lane);  // after the start: a PS1080 ignores settings made before
    }
  }

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
    // A recording is read as fast as possible. It ends after its number of frames or, if that is wrong, by silence.
    if (finished_) return std::nullopt;
    std::vector<openni::VideoStream*> streams;
    for (const auto& lane : lanes_) streams.push_back(&lane->stream);
    int ready = -1;
    const auto wait = kind_ == Kind::device ? timeout
                      : listener_.ended()   ? silence_ / kOpenNiParameters.end_silence_divisor
                                            : silence_;
    const openni::Status status = openni::OpenNI::waitForAnyStream(streams.data(), static_cast<int>(streams.size()),
                                                                   &ready, static_cast<int>(wait.count()));
    if (status != openni::STATUS_OK || ready < 0 || ready >= static_cast<int>(lanes_.size())) {
      finished_ = kind_ == Kind::recording || listener_.ended();
      return std::nullopt;
    }
    SourceItem item = read_frame(*lanes_[ready]);
    if (kind_ == Kind::recording) {
      --lanes_[ready]->left;
      finished_ =
          --left_ == 0 || std::all_of(lanes_.begin(), lanes_.end(), [](const auto& lane) { return lane->left <= 0; });
    }
    return item;
  }

  bool finished() const override { return finished_; }
  void rewind() override {}
  std::string serial() const override { return serial_; }

 private:
  std::string serial_of_device() const {
    std::array<char, 256> text{};
    int size = static_cast<int>(text.size()) - 1;
    const bool known =
        device_.getProperty(openni::DEVICE_PROPERTY_SERIAL_NUMBER, text.data(), &size) == openni::STATUS_OK;
    return known ? text.data() : "";
  }

  void create(Lane& lane) {
    const openni::SensorType sensor = lane.spec.stream == Stream::depth ? openni::SENSOR_DEPTH : openni::SENSOR_COLOR;
    const std::string name = name_of(lane.spec.stream);
    refuse_if(!device_.hasSensor(sensor) || lane.stream.create(device_, sensor) != openni::STATUS_OK,
              "found no " + name + " stream");
    if (kind_ == Kind::recording) {
      if (!fits(lane.stream.getVideoMode(), lane.spec)) {
        const openni::VideoMode mode = lane.stream.getVideoMode();
        throw InputError("found a " + name + " stream of " + size_text(mode.getResolutionX(), mode.getResolutionY()) +
                         " in pixel format " + std::to_string(mode.getPixelFormat()) +
                         ", allowed: " + mode_text(lane.spec));
      }
      return;
    }
    const auto& modes = lane.stream.getSensorInfo().getSupportedVideoModes();
    const openni::VideoMode* best = nullptr;
    for (int i = 0; i < modes.getSize(); ++i) {
      if (fits(modes[i], lane.spec) && (!rate_hz_ || std::abs(modes[i].getFps() - *rate_hz_) < 0.5) &&
          (best == nullptr || modes[i].getFps() > best->getFps())) {
        best = &modes[i];
      }
    }
    if (best == nullptr || lane.stream.setVideoMode(*best) != openni::STATUS_OK) {
      const std::string rate = rate_hz_ ? " at " + std::to_string(std::lround(*rate_hz_)) + " Hz" : "";
      throw InputError("found no " + name + " mode for it, allowed by the session: " + mode_text(lane.spec) + rate);
    }
  }

  void prepare_device() {
    for (const auto& lane : lanes_) {
      lane->stream.setMirroringEnabled(false);
      refuse_if(lane->stream.getMirroringEnabled(), "found a device that only gives mirrored pictures");
      if (lane->spec.stream == Stream::depth) {
        const auto wanted =
            lane->spec.registered ? openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR : openni::IMAGE_REGISTRATION_OFF;
        const bool set = device_.isImageRegistrationModeSupported(wanted) &&
                         device_.setImageRegistrationMode(wanted) == openni::STATUS_OK;
        refuse_if(lane->spec.registered && !set,
                  "found a device that cannot register depth to colour, allowed: depth.registered = false");
      }
    }
    device_.setDepthColorSyncEnabled(true);  // if supported; pairing by time works without
  }

  /// Radiance = response / exposure requires a fixed exposure; devices without these controls have one. What stays
  /// automatic is estimated from the frames.
  static void fix_exposure(Lane& lane) {
    const CameraSettings& wanted = lane.spec.settings;
    openni::CameraSettings* camera = lane.stream.getCameraSettings();
    if (camera == nullptr) {
      refuse_if(wanted.gain || !wanted.controls.empty(),
                "found a device whose exposure and gain cannot be set, allowed: neither `gain` nor `controls`");
      return;
    }
    camera->setAutoExposureEnabled(false);
    camera->setAutoWhiteBalanceEnabled(false);
    const auto set = [](const std::string& key, double value, const auto& apply) {
      if (std::floor(value) != value || apply(static_cast<int>(value)) != openni::STATUS_OK) {
        throw InputError(key + ": found " + std::to_string(value) +
                         ", which the device does not take: " + openni_error());
      }
    };
    for (const auto& [name, value] : wanted.controls) {
      set("controls." + name, value, [camera](int exposure) { return camera->setExposure(exposure); });
    }
    if (wanted.gain) {
      set("gain", *wanted.gain, [camera](int gain) { return camera->setGain(gain); });
    }
  }

  SourceItem read_frame(Lane& lane) {
    openni::VideoFrameRef frame;
    const bool read = lane.stream.readFrame(&frame) == openni::STATUS_OK && frame.isValid();
    Stamp stamp{lane.last_time_ns, steady_now_ns(), lane.next_sequence};
    if (read) {
      if (!lane.first_index) lane.first_index = frame.getFrameIndex();
      const auto index = static_cast<std::int64_t>(frame.getFrameIndex()) - *lane.first_index;
      if (index > static_cast<std::int64_t>(stamp.sequence)) {
        stamp.sequence = static_cast<std::uint64_t>(index);  // the device counts lost frames
      }
      stamp.time_ns = static_cast<std::int64_t>(std::min<std::uint64_t>(frame.getTimestamp(), INT64_MAX / 1000)) * 1000;
    }
    lane.next_sequence = stamp.sequence + 1;
    lane.last_time_ns = stamp.time_ns;
    const std::size_t pixel = lane.spec.stream == Stream::depth ? 2 : 3;
    const std::size_t row = pixel * static_cast<std::size_t>(lane.spec.width);
    const auto lost = [&](const char* reason) { return LostFrame{stamp, lane.spec.stream, reason}; };
    if (!read) return lost("the picture is damaged");
    if (!fits(frame.getVideoMode(), lane.spec) || frame.getWidth() != lane.spec.width ||
        frame.getHeight() != lane.spec.height) {
      return lost("the picture has another size or format");
    }
    if (frame.getStrideInBytes() < static_cast<int>(row) ||
        frame.getDataSize() < frame.getStrideInBytes() * (frame.getHeight() - 1) + static_cast<int>(row)) {
      return lost("the picture is damaged");
    }
    const auto copy = [&](auto& image) {
      const auto* data = static_cast<const std::uint8_t*>(frame.getData());
      for (int y = 0; y < image.height; ++y) {
        std::memcpy(&image.at(0, y), data + static_cast<std::ptrdiff_t>(y) * frame.getStrideInBytes(), row);
      }
    };
    if (lane.spec.stream == Stream::depth) {
      RawDepth depth{stamp, Image<std::uint16_t>(lane.spec.width, lane.spec.height, 1)};
      copy(depth.counts);
      return depth;
    }
    Frame picture{.stamp = stamp, .stream = lane.spec.stream, .exposure = lane.spec.exposure};
    picture.encoded = Image<std::uint8_t>(lane.spec.width, lane.spec.height, 3);
    copy(picture.encoded);
    return picture;
  }

  Kind kind_;
  std::chrono::milliseconds silence_;
  std::uintmax_t left_ = 0;        ///< frames that a recording may still have, by the size of its file
  std::optional<double> rate_hz_;  ///< of all streams
  Library library_;
  EndListener listener_;
  OpenDevice open_;
  openni::Device& device_ = open_.device;
  std::vector<std::unique_ptr<Lane>>& lanes_ = open_.lanes;
  bool finished_ = false;
  std::string serial_;
};

OpenNiSource::OpenNiSource(Kind kind, const std::string& uri, const std::vector<StreamSpec>& specs,
                           std::chrono::milliseconds silence)
    : ForwardingSource(with_error_context((kind == Kind::device ? "openni2:" : "") + uri,
                                          [&] { return std::make_shared<Reader>(kind, uri, specs, silence); })) {}

}  // namespace lumigraft::capture
