// lumigraft_orbbec [SERIAL] STREAM...: helper program (docs/helpers.md) that runs OrbbecSDK 2, for
// `helper:/PATH/lumigraft_orbbec`. Without a serial number it takes the first camera.
#include <cmath>
#include <cstring>
#include <libobsensor/ObSensor.hpp>

#include "capture/error.h"
#include "capture/live/helper_output.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture {
namespace {

std::shared_ptr<ob::Device> find_device(const ob::Context& context, const std::string& serial) {
  const std::shared_ptr<ob::DeviceList> all = context.queryDeviceList();
  for (std::uint32_t i = 0; i < all->getCount(); ++i) {
    if (serial.empty() || serial == all->getSerialNumber(i)) return all->getDevice(i);
  }
  throw CameraFault("found no such camera");
}

std::shared_ptr<ob::Config> requested(const std::vector<StreamSpec>& specs) {
  const auto config = std::make_shared<ob::Config>();
  for (const StreamSpec& spec : specs) {
    const bool depth = spec.stream == Stream::depth, any_size = depth && spec.registered;
    config->enableVideoStream(depth ? OB_STREAM_DEPTH : OB_STREAM_COLOR,
                              any_size ? OB_WIDTH_ANY : static_cast<std::uint32_t>(spec.width),
                              any_size ? OB_HEIGHT_ANY : static_cast<std::uint32_t>(spec.height), OB_FPS_ANY,
                              depth ? OB_FORMAT_Y16 : OB_FORMAT_RGB);
  }
  return config;
}

void send(const StreamSpec& spec, const std::vector<StreamSpec>& specs, const std::shared_ptr<ob::VideoFrame>& frame) {
  const int width = static_cast<int>(frame->getWidth()), height = static_cast<int>(frame->getHeight());
  refuse_if(width != spec.width || height != spec.height,
            "found " + size_text(width, height) + ", allowed: " + size_text(spec.width, spec.height));
  const Stamp stamp{static_cast<std::int64_t>(1000 * frame->getTimeStampUs()), 0, frame->getIndex()};
  if (spec.stream == Stream::depth) {
    const double unit_m = 1e-3 * frame->as<ob::DepthFrame>()->getValueScale();
    refuse_if(std::abs(spec.unit_m - unit_m) > 1e-4 * unit_m,  // the camera reports it as a float
              "found unit_m = " + std::to_string(spec.unit_m) + ", allowed: " + std::to_string(unit_m));
    RawDepth depth{stamp, Image<std::uint16_t>(width, height, 1)};
    std::memcpy(depth.counts.data.data(), frame->getData(), 2 * depth.counts.data.size());
    send_item(depth, specs);
  } else {
    Frame color{.stamp = stamp, .encoded = Image<std::uint8_t>(width, height, 3)};
    std::memcpy(color.encoded.data.data(), frame->getData(), color.encoded.data.size());
    send_item(color, specs);
  }
}

void run(const std::string& serial, const std::vector<StreamSpec>& specs) {
  ob::Context::setLoggerSeverity(OB_LOG_SEVERITY_OFF);
  ob::Context context;
  const std::shared_ptr<ob::Device> device = find_device(context, serial);
  ob::Pipeline pipeline(device);
  pipeline.start(requested(specs));
  send_text(HelperMessage::Kind::opened, device->getDeviceInfo()->getSerialNumber());
  ob::Align to_color(OB_STREAM_COLOR);
  for (;;) {
    const std::shared_ptr<ob::FrameSet> frames =
        pipeline.waitForFrameset(static_cast<std::uint32_t>(kLiveParameters.silence.count()));
    if (!frames) throw CameraFault("the camera delivers no frames");
    for (const StreamSpec& spec : specs) {
      const bool depth = spec.stream == Stream::depth;
      std::shared_ptr<ob::FrameSet> from = frames;
      if (depth && spec.registered) {
        if (!frames->getFrame(OB_FRAME_COLOR) || !frames->getFrame(OB_FRAME_DEPTH)) continue;
        from = to_color.process(frames)->as<ob::FrameSet>();
      }
      const std::shared_ptr<ob::Frame> frame = from->getFrame(depth ? OB_FRAME_DEPTH : OB_FRAME_COLOR);
      if (frame) send(spec, specs, frame->as<ob::VideoFrame>());
    }
  }
}

}  // namespace
}  // namespace lumigraft::capture

int main(int count, char** words) { lumigraft::capture::run_helper(count, words, lumigraft::capture::run); }
