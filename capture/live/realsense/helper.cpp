// lumigraft_realsense [SERIAL] STREAM...: helper program (docs/helpers.md) that runs librealsense2, for
// `helper:/PATH/lumigraft_realsense`. Without a serial number it takes the first camera.
#include <cmath>
#include <cstring>
#include <librealsense2/rs.hpp>
#include <optional>

#include "capture/error.h"
#include "capture/live/helper_output.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture {
namespace {

rs2::config requested(const std::string& serial, const std::vector<StreamSpec>& specs) {
  rs2::config config;
  if (!serial.empty()) config.enable_device(serial);
  for (const StreamSpec& spec : specs) {
    const bool depth = spec.stream == Stream::depth;
    config.enable_stream(depth ? RS2_STREAM_DEPTH : RS2_STREAM_COLOR, depth && spec.registered ? 0 : spec.width,
                         depth && spec.registered ? 0 : spec.height, depth ? RS2_FORMAT_Z16 : RS2_FORMAT_RGB8);
  }
  return config;
}

void check_unit(const rs2::device& device, const std::vector<StreamSpec>& specs) {
  for (const StreamSpec& spec : specs) {
    if (spec.stream != Stream::depth) continue;
    const double unit_m = device.first<rs2::depth_sensor>().get_depth_scale();
    refuse_if(std::abs(spec.unit_m - unit_m) > 1e-4 * unit_m,  // the camera reports it as a float
              "found unit_m = " + std::to_string(spec.unit_m) + ", allowed: " + std::to_string(unit_m));
  }
}

/// Sends a frame unless it was sent before: the library repeats the newest frame of a slower stream.
class Sender {
 public:
  explicit Sender(const std::vector<StreamSpec>& specs) : specs_(specs) {}

  void send(const StreamSpec& spec, const rs2::video_frame& frame) {
    std::optional<std::uint64_t>& last = last_[static_cast<std::size_t>(spec.stream)];
    const std::uint64_t number = frame ? frame.get_frame_number() : 0;
    if (!frame || last == number) return;
    last = number;
    refuse_if(frame.get_width() != spec.width || frame.get_height() != spec.height,
              "found " + size_text(frame.get_width(), frame.get_height()) +
                  ", allowed: " + size_text(spec.width, spec.height));
    const Stamp stamp{std::llround(1e6 * frame.get_timestamp()), 0, number};
    if (spec.stream == Stream::depth) {
      RawDepth depth{stamp, Image<std::uint16_t>(spec.width, spec.height, 1)};
      copy_rows(frame, reinterpret_cast<std::uint8_t*>(depth.counts.data.data()), 2);
      send_item(depth, specs_);
    } else {
      Frame color{.stamp = stamp, .encoded = Image<std::uint8_t>(spec.width, spec.height, 3)};
      copy_rows(frame, color.encoded.data.data(), 3);
      send_item(color, specs_);
    }
  }

 private:
  static void copy_rows(const rs2::video_frame& frame, std::uint8_t* to, int pixel_bytes) {
    const auto* from = static_cast<const std::uint8_t*>(frame.get_data());
    const int row = frame.get_width() * pixel_bytes;
    for (int y = 0; y < frame.get_height(); ++y, to += row, from += frame.get_stride_in_bytes()) {
      std::memcpy(to, from, static_cast<std::size_t>(row));
    }
  }

  const std::vector<StreamSpec>& specs_;
  std::array<std::optional<std::uint64_t>, kStreams.size()> last_;
};

void run(const std::string& serial, const std::vector<StreamSpec>& specs) {
  rs2::context context;
  bool found = false;
  for (const rs2::device& one : context.query_devices()) {
    found = found || serial.empty() || serial == one.get_info(RS2_CAMERA_INFO_SERIAL_NUMBER);
  }
  if (!found) throw CameraFault("found no such camera");
  const rs2::config config = requested(serial, specs);
  rs2::pipeline pipeline(context);
  refuse_if(!config.can_resolve(pipeline),
            "found no streams of these sizes, allowed: what `rs-enumerate-devices` lists");
  const rs2::device device = pipeline.start(config).get_device();
  check_unit(device, specs);
  send_text(HelperMessage::Kind::opened, device.get_info(RS2_CAMERA_INFO_SERIAL_NUMBER));
  rs2::align to_color(RS2_STREAM_COLOR);
  Sender sender(specs);
  for (;;) {
    rs2::frameset frames = pipeline.wait_for_frames(static_cast<unsigned>(kLiveParameters.silence.count()));
    const rs2::frameset aligned =
        frames.get_color_frame() && frames.get_depth_frame() ? to_color.process(frames) : frames;
    for (const StreamSpec& spec : specs) {
      if (spec.stream != Stream::depth) {
        sender.send(spec, frames.get_color_frame());
      } else if (!spec.registered) {
        sender.send(spec, frames.get_depth_frame());
      } else if (frames.get_color_frame()) {
        sender.send(spec, aligned.get_depth_frame());
      }
    }
  }
}

}  // namespace
}  // namespace lumigraft::capture

int main(int count, char** words) { lumigraft::capture::run_helper(count, words, lumigraft::capture::run); }
