#include "server/commands/doctor/gpu_checks.h"

#include <filesystem>

extern "C" {
#include <libavcodec/avcodec.h>
}

#include "server/commands/doctor/permissions.h"
#include "server/stream/encode_h264.h"
#include "server/stream/encode_jpeg.h"

namespace lumigraft::server {
namespace {

constexpr const char* kDrivers =
    "sudo apt install mesa-vulkan-drivers (AMD, Intel, and software), or nvidia-driver of Debian's non-free";

/// Every device with its backend, or why it cannot be used. One usable device is enough.
void list_gpus(DoctorReport& report) {
  for (const relight::gpu::DeviceListing& device : relight::gpu::list_devices()) {
    const std::string what = std::string(relight::gpu::name_of(device.backend)) + ": " + device.name;
    if (device.rejection_reason.empty())
      report.ok(what, device.software ? "software" : "hardware");
    else
      report.line(what + ": cannot be used: " + device.rejection_reason);
  }
}

/// Nodes of GPUs, which drivers pass over silently where they may not open them.
void check_nodes(DoctorReport& report) {
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/dri", none)) {
    const std::filesystem::path& node = entry.path();
    if (node.filename().string().starts_with("renderD") && !may_use(node))
      report.note("GPU node " + node.string(), "this user may not use it", mend_node(node));
  }
}

}  // namespace

void check_gpu(DoctorReport& report, relight::gpu::Backend backend) {
  check_nodes(report);
  list_gpus(report);
  try {
    const bool best = backend == relight::gpu::Backend::best;
    if (best) backend = relight::gpu::best_backend();
    const auto device = relight::gpu::create_device(backend, relight::gpu::DeviceOptions{});
    report.ok("GPU", std::string(relight::gpu::name_of(backend)) +
                         (best ? " draws unless --backend says otherwise, on " : " draws as configured, on ") +
                         device->name());
    if (device->is_software())
      report.note("GPU", "only software: the processor draws, with fewer pictures a second than a GPU",
                  "with a GPU in this machine, " + std::string(kDrivers));
  } catch (const std::exception& e) {
    report.missing("GPU", e.what(), kDrivers);
  }
}

void check_encoders(DoctorReport& report) {
  const capture::Image<std::uint8_t> grey(64, 64, 3, 128);
  try {
    H264Encoder encoder(grey.width, grey.height);
    encoder.encode(grey, 0, true);
    const unsigned v = avcodec_version();
    report.ok("H.264", encoder.codec_string() + ", libavcodec " + std::to_string(AV_VERSION_MAJOR(v)) + '.' +
                           std::to_string(AV_VERSION_MINOR(v)) + '.' + std::to_string(AV_VERSION_MICRO(v)) +
                           " with libx264");
  } catch (const std::exception& e) {
    report.missing("H.264", e.what(), "sudo apt install --reinstall libavcodec59 libx264-164");
  }
  try {
    report.ok("JPEG", std::to_string(JpegEncoder(85).encode(grey).size()) + " bytes for a grey tile");
  } catch (const std::exception& e) {
    report.missing("JPEG", e.what(), "sudo apt install --reinstall libturbojpeg0");
  }
}

}  // namespace lumigraft::server
