#include "capture/live/aravis/source.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "capture/live/aravis/chunks.h"
#include "capture/live/aravis/library.h"
#include "capture/live/parameters.h"
#include "capture/live/usb_permission.h"
#include "capture/message_text.h"

namespace lumigraft::capture {
namespace {

using aravis::Check;
using aravis::Ref;

/// Colour before grey, and Bayer first, since it needs a third of the bandwidth of RGB.
constexpr PixelFormat kPreferred[] = {PixelFormat::bayer_rggb8, PixelFormat::bayer_bggr8, PixelFormat::bayer_gbrg8,
                                      PixelFormat::bayer_grbg8, PixelFormat::rgb8,        PixelFormat::bgr8,
                                      PixelFormat::grey8,       PixelFormat::grey10,      PixelFormat::grey12,
                                      PixelFormat::grey16};

}  // namespace

/// The camera from opening to closing. The constructor throws with the reason alone.
class AravisSource::Camera : public Source {
 public:
  Camera(const std::string& name, const StreamSpec& spec) : spec_(spec), exposure_(spec) {
    Check check;
    if (name.empty()) arv_update_device_list();
    camera_.reset(arv_camera_new(name.empty() ? nullptr : name.c_str(), check));
    if (!camera_) {
      if (aravis::usb3_vision_is_forbidden()) {
        throw CameraFault("found no such camera but one of USB3 Vision: " + std::string(kForbiddenUsb));
      }
      throw CameraFault("found no such camera that answers: " + (check.failed() ? check.text() : "none is there"));
    }
    ArvDevice* device = arv_camera_get_device(camera_.get());
    if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
      throw CameraFault("found it in use by another program, or by one that ended seconds ago without releasing it");
    }
    stop_acquisition();
    choose_format();
    choose_region();
    use_chunks();
    fix_exposure();
    set_controls();
    readout_s_ = reported_readout_s();
    start();
  }

  /// Closes the camera on another thread, since Aravis waits a dozen seconds for a camera that is gone.
  ~Camera() override {
    if (device_ != nullptr) g_signal_handlers_disconnect_by_data(device_, this);
    std::promise<void> promise;
    const std::future<void> closed = promise.get_future();
    std::thread([started = started_, camera = std::move(camera_), stream = std::move(stream_),
                 chunks = std::move(chunks_), promise = std::move(promise)]() mutable {
      if (started) {
        Check ignored;
        arv_camera_stop_acquisition(camera.get(), ignored);
      }
      chunks.reset();  // before the stream, whose buffers it refers to
      stream.reset();
      camera.reset();
      promise.set_value();
    }).detach();
    closed.wait_for(kAravisParameters.close_timeout);
  }

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
    ArvBuffer* buffer =
        arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(std::chrono::microseconds(timeout).count()));
    if (buffer == nullptr) return std::nullopt;
    SourceItem item = to_item(*buffer);
    arv_stream_push_buffer(stream_.get(), buffer);
    return item;
  }

  bool finished() const override { return lost_; }
  void rewind() override {}
  std::string take_warning() override {
    return warning_.empty() ? exposure_.take_warning() : std::exchange(warning_, "");
  }

 private:
  /// A program that was killed may have left the camera running; it would refuse settings or send frames elsewhere.
  void stop_acquisition() {
    Check ignored;
    arv_camera_stop_acquisition(camera_.get(), ignored);
  }

  void choose_format() {
    Check check;
    std::vector<PixelFormat> known;
    for (const gint64 offered : aravis::pixel_formats_of(camera_.get())) {
      if (const auto format = aravis::pixel_format_of(offered)) known.push_back(*format);
    }
    const auto offers = [&known](PixelFormat f) { return std::find(known.begin(), known.end(), f) != known.end(); };
    if (spec_.settings.pixel_format) {
      format_ = *spec_.settings.pixel_format;
    } else if (const auto* best = std::find_if(std::begin(kPreferred), std::end(kPreferred), offers);
               best != std::end(kPreferred)) {
      format_ = *best;
    }
    if (!offers(format_)) {
      std::string names;
      for (const PixelFormat format : known) names += " " + std::string(name_of(format));
      throw InputError("found no pixel format " + std::string(name_of(format_)) + ", offered:" + names);
    }
    if (!bytes_of(format_, spec_.width, spec_.height)) {
      throw InputError("found " + size_text(spec_.width, spec_.height) + ", allowed with " +
                       std::string(name_of(format_)) + ": even numbers");
    }
    arv_camera_set_pixel_format(camera_.get(), *aravis::aravis_format_of(format_), check);
    check.or_throw("pixel format");
  }

  void choose_region() {
    Check check;
    gint widest = 0, highest = 0;
    arv_camera_get_sensor_size(camera_.get(), &widest, &highest, check);
    check.or_throw("sensor size");
    refuse_if(spec_.width > widest || spec_.height > highest,
              "found a sensor of " + size_text(widest, highest) +
                  ", allowed by the session: " + size_text(spec_.width, spec_.height));
    arv_camera_set_region(camera_.get(), 0, 0, spec_.width, spec_.height, check);
    check.or_throw("size");
    gint x = 0, y = 0, width = 0, height = 0;
    arv_camera_get_region(camera_.get(), &x, &y, &width, &height, check);
    check.or_throw("size");
    refuse_if(width != spec_.width || height != spec_.height,
              "found a camera that gives " + size_text(width, height) +
                  ", allowed by the session: " + size_text(spec_.width, spec_.height));
  }

  /// Radiance = response / exposure requires an exposure that is fixed or reported; cameras without these features have
  /// one. What the colour camera changes by itself is estimated from its frames.
  void fix_exposure() {
    ArvCamera* camera = camera_.get();
    Check check;
    const auto switch_off = [&](const char* what, bool reported, bool available, const auto& set_off) {
      check.or_throw(what);  // no answer does not mean not available
      if (available) set_off();
      if (!check.permanent() || !(reported || spec_.stream == Stream::color)) check.or_throw(what);
    };
    switch_off("auto-exposure", chunks_ && chunks_->report_exposure(),
               arv_camera_is_exposure_auto_available(camera, check),
               [&] { arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, check); });
    switch_off("auto-gain", chunks_ && chunks_->report_gain(), arv_camera_is_gain_auto_available(camera, check),
               [&] { arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, check); });
    switch_off("white balance", false, arv_camera_is_feature_available(camera, "BalanceWhiteAuto", check),
               [&] { arv_camera_set_string(camera, "BalanceWhiteAuto", "Off", check); });
    const auto set = [&](const char* key, const std::optional<double>& wanted, auto* function) {
      if (!wanted) return;
      function(camera, *wanted, check);
      check.or_throw(key);
    };
    set("exposure_us", spec_.settings.exposure_us, arv_camera_set_exposure_time);
    set("gain", spec_.settings.gain, arv_camera_set_gain);
    set("rate_hz", spec_.settings.rate_hz, arv_camera_set_frame_rate);
  }

  /// Controls are named FEATURE, or FEATURE[ENTRY] with the entry of FEATURESelector, as in GenICam.
  void set_controls() {
    for (const auto& [name, value] : spec_.settings.controls) {
      const std::size_t bracket = name.find('[');
      const std::string feature = name.substr(0, bracket);
      if (bracket != std::string::npos) {
        choose(feature + "Selector", name.substr(bracket + 1, name.find(']') - bracket - 1), "controls." + name);
      }
      set_control(feature, value, "controls." + name);
    }
  }

  void choose(const std::string& selector, const std::string& entry, const std::string& key) {
    refuse_if(!ARV_IS_GC_ENUMERATION(arv_device_get_feature(arv_camera_get_device(camera_.get()), selector.c_str())),
              key + ": found no " + selector + " among the camera's features");
    Check check;
    const std::vector<std::string> offered = aravis::entries_of(camera_.get(), selector, check);
    check.or_throw(key);
    refuse_if(std::find(offered.begin(), offered.end(), entry) == offered.end(),
              key + ": found \"" + entry + "\", allowed: " + listed(offered));
    arv_camera_set_string(camera_.get(), selector.c_str(), entry.c_str(), check);
    check.or_throw(key);
  }

  void set_control(const std::string& feature, double value, const std::string& key) {
    ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(camera_.get()), feature.c_str());
    Check check;
    if (ARV_IS_GC_FLOAT(node)) {
      arv_camera_set_float(camera_.get(), feature.c_str(), value, check);
    } else if (ARV_IS_GC_BOOLEAN(node)) {
      arv_camera_set_boolean(camera_.get(), feature.c_str(), value != 0.0, check);
    } else if (ARV_IS_GC_INTEGER(node)) {
      arv_camera_set_integer(camera_.get(), feature.c_str(), static_cast<gint64>(value), check);
    } else {
      throw InputError(key + ": found no such number among the camera's features");
    }
    check.or_throw(key);
  }

  /// Empty if the camera does not say which shutter it has, or how fast it reads its rows.
  std::optional<double> reported_readout_s() {
    Check check;
    const auto has = [&](const char* feature) {
      return arv_camera_is_feature_available(camera_.get(), feature, check) && !check.failed();
    };
    if (!has("SensorShutterMode")) return std::nullopt;
    const char* mode = arv_camera_get_string(camera_.get(), "SensorShutterMode", check);
    if (check.failed() || mode == nullptr) return std::nullopt;
    if (std::string_view(mode) == "Global") return 0.0;
    if (std::string_view(mode) != "Rolling" || !has("SensorReadoutTime")) return std::nullopt;
    const double readout_us = arv_camera_get_float(camera_.get(), "SensorReadoutTime", check);
    return !check.failed() && readout_us >= 0 ? std::optional(1e-6 * readout_us) : std::nullopt;
  }

  void use_chunks() {
    auto chunks = std::make_unique<aravis::Chunks>(*camera_, spec_);
    if (!chunks->refused().empty()) warn(chunks->refused());
    if (!chunks->active()) return;
    exposure_ = ReportedExposure(spec_, chunks->gain_in_db());
    chunks_ = std::move(chunks);
  }

  /// Warns once, since a fault of chunks usually affects many frames.
  void warn(const std::string& fault) {
    if (!std::exchange(warned_, true)) {
      warning_ = std::string(name_of(spec_.stream)) + ": the camera's chunks lack the time or exposure of frames (" +
                 fault + "); the leader's time and the exposure of the frame before are used instead";
    }
  }

  void start() {
    Check check;
    if (arv_camera_is_gv_device(camera_.get())) {
      arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);  // needs no root
    }
    arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, check);
    check.or_throw("acquisition mode");
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, check));
    check.or_throw("stream");
    const guint payload = arv_camera_get_payload(camera_.get(), check);
    check.or_throw("payload");
    if (ARV_IS_GV_STREAM(stream_.get())) {
      // Room for two frames in the kernel, if net.core.rmem_max allows it; the default is a fifth of a megabyte.
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                   static_cast<gint>(std::min<guint64>(2 * guint64{payload}, G_MAXINT)), nullptr);
    }
    for (int i = 0; i < kAravisParameters.buffers; ++i) {
      arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
    }
    device_ = arv_camera_get_device(camera_.get());
    g_signal_connect(device_, "control-lost", G_CALLBACK(control_lost), this);
    arv_camera_start_acquisition(camera_.get(), check);
    check.or_throw("start");
    started_ = true;
  }

  static void control_lost(ArvDevice*, gpointer self) { static_cast<Camera*>(self)->lost_ = true; }

  /// Difference to the last frame ID. IDs have 16 bits without 0, or 64 bits.
  std::uint64_t steps_to(guint64 id) const {
    constexpr guint64 kLast16 = 65535;
    const guint64 steps = id > *last_id_ ? id - *last_id_ : id + kLast16 - *last_id_;
    return steps >= 1 && steps <= kLiveParameters.max_sequence_gap ? steps : 1;
  }

  struct Pixels {
    const std::uint8_t* data = nullptr;
    std::size_t bytes = 0;  ///< padding included
    std::size_t row_padding = 0;
  };

  /// The image in a buffer; empty if its size or format is not the requested one.
  Pixels pixels_in(ArvBuffer& buffer, std::size_t wanted) const {
    std::size_t size = 0;
    if (arv_buffer_get_payload_type(&buffer) == ARV_BUFFER_PAYLOAD_TYPE_CHUNK_DATA) {
      // The leader does not describe the image, which is the first chunk; only its length shows a different size.
      const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(&buffer, &size));
      const bool complete = data != nullptr && chunks_ && chunks_->are_complete(buffer, wanted);
      return complete ? Pixels{data, wanted} : Pixels{};
    }
    const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_image_data(&buffer, &size));
    gint row_padding = 0, frame_padding = 0;
    arv_buffer_get_image_padding(&buffer, &row_padding, &frame_padding);
    const auto rows = static_cast<std::size_t>(spec_.height);
    const std::size_t bytes =
        wanted + rows * static_cast<std::size_t>(row_padding) + static_cast<std::size_t>(frame_padding);
    if (data == nullptr || arv_buffer_get_image_width(&buffer) != spec_.width ||
        arv_buffer_get_image_height(&buffer) != spec_.height ||
        arv_buffer_get_image_pixel_format(&buffer) != *aravis::aravis_format_of(format_) || size < wanted) {
      return {};
    }
    return {data, std::min(bytes, size), static_cast<std::size_t>(row_padding)};
  }

  /// Time and exposure from the chunks. If a frame has no chunk time, its leader's time is shifted by the last known
  /// difference, so that the order of frames is kept.
  void read_chunks(ArvBuffer& buffer, std::size_t frame_bytes, Stamp& stamp, double& exposure) {
    const aravis::FrameSettings own = chunks_->read(buffer, frame_bytes);
    if (!own.fault.empty()) warn(own.fault);
    if (own.time_ns) chunk_offset_ns_ = *own.time_ns - stamp.time_ns;
    stamp.time_ns += chunk_offset_ns_;
    exposure = exposure_.of_frame(own.reported);
  }

  SourceItem to_item(ArvBuffer& buffer) {
    const ArvBufferStatus status = arv_buffer_get_status(&buffer);
    std::uint64_t sequence = next_sequence_;
    if (status == ARV_BUFFER_STATUS_SUCCESS) {  // the ID of a damaged frame may be wrong
      const guint64 id = arv_buffer_get_frame_id(&buffer);
      sequence = last_id_ ? std::max(sequence, last_complete_ + steps_to(id)) : sequence;
      last_id_ = id;
      last_complete_ = sequence;
    }
    next_sequence_ = sequence + 1;
    const guint64 time_ns = arv_buffer_get_timestamp(&buffer);
    Stamp stamp{static_cast<std::int64_t>(time_ns != 0 ? time_ns : arv_buffer_get_system_timestamp(&buffer)),
                steady_now_ns(), sequence};
    if (status != ARV_BUFFER_STATUS_SUCCESS) {
      const bool packets = status == ARV_BUFFER_STATUS_MISSING_PACKETS || status == ARV_BUFFER_STATUS_TIMEOUT;
      return LostFrame{stamp, spec_.stream,
                       packets ? "packets are missing" : "the picture is damaged (" + std::to_string(status) + ")"};
    }
    const std::size_t wanted = *bytes_of(format_, spec_.width, spec_.height);
    const Pixels pixels = pixels_in(buffer, wanted);
    if (pixels.data == nullptr) return LostFrame{stamp, spec_.stream, "the picture has another size or format"};
    Frame frame{.stream = spec_.stream, .exposure = spec_.exposure, .readout_s = readout_s_};
    if (chunks_) read_chunks(buffer, pixels.bytes, stamp, frame.exposure);
    frame.stamp = stamp;
    std::vector<std::uint8_t> own;
    std::span<const std::uint8_t> bytes(pixels.data, wanted);
    if (pixels.row_padding > 0) {
      const std::size_t row = wanted / static_cast<std::size_t>(spec_.height) + pixels.row_padding;
      own = without_padding(format_, spec_.width, spec_.height, row, {pixels.data, pixels.bytes});
      bytes = own;
    }
    std::optional<Image<std::uint8_t>> rgb = pixels_.to_rgb(format_, spec_.width, spec_.height, bytes);
    if (!rgb) return LostFrame{stamp, spec_.stream, "the picture is damaged"};
    frame.encoded = std::move(*rgb);
    if (format_ != PixelFormat::rgb8) {
      frame.original = std::make_shared<RawFrame>(format_, std::vector(bytes.begin(), bytes.end()));
    }
    return frame;
  }

  StreamSpec spec_;
  PixelFormat format_ = PixelFormat::rgb8;
  PixelConverter pixels_;
  ReportedExposure exposure_;
  std::optional<double> readout_s_;
  Ref<ArvCamera> camera_;
  Ref<ArvStream> stream_;
  std::unique_ptr<aravis::Chunks> chunks_;  ///< null if the camera has none
  std::int64_t chunk_offset_ns_ = 0;        ///< last chunk time minus leader time
  bool warned_ = false;
  std::string warning_;
  ArvDevice* device_ = nullptr;  ///< the camera's
  bool started_ = false;
  std::atomic<bool> lost_{false};
  std::optional<guint64> last_id_;   ///< of the last complete frame
  std::uint64_t last_complete_ = 0;  ///< its sequence number
  std::uint64_t next_sequence_ = 0;
};

AravisSource::AravisSource(const std::string& camera, const StreamSpec& spec)
    : ForwardingSource(with_error_context("aravis:" + camera, [&] { return std::make_shared<Camera>(camera, spec); })) {
}

}  // namespace lumigraft::capture
