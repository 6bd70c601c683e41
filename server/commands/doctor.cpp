#include "server/commands/doctor.h"

#include <Eigen/Core>
#include <thread>

extern "C" {
#include <libavcodec/avcodec.h>
}

#include "relight/gpu/device.h"
#include "server/metrics/version.h"
#include "server/stream/encode_h264.h"
#include "server/stream/encode_jpeg.h"

namespace lumigraft::server {
namespace {

/// Writes one line: the check, and "ok" with a detail or the reason of the failure.
template <typename Function>
bool check(std::ostream& out, const char* what, Function function) {
  try {
    const std::string detail = function();
    out << "  " << what << ": ok, " << detail << '\n';
    return true;
  } catch (const std::exception& e) {
    out << "  " << what << ": cannot be used: " << e.what() << '\n';
    return false;
  }
}

/// Lists every device with its backend, or why it cannot be used. One usable device is enough.
void list_gpus(std::ostream& out) {
  for (const relight::gpu::DeviceListing& device : relight::gpu::list_devices()) {
    out << "  " << relight::gpu::name_of(device.backend) << ": " << device.name;
    if (!device.rejection_reason.empty()) {
      out << ": cannot be used: " << device.rejection_reason << '\n';
    } else {
      out << ": ok, " << (device.software ? "software" : "hardware") << '\n';
    }
  }
}

}  // namespace

bool write_doctor_report(std::ostream& out) {
  out << version_line() << ", " << std::thread::hardware_concurrency() << " cores, "
      << Eigen::SimdInstructionSetsInUse() << '\n';
  list_gpus(out);
  bool good = check(out, "GPU", [] {
    const relight::gpu::Backend backend = relight::gpu::best_backend();
    return std::string(relight::gpu::name_of(backend)) + " draws unless --backend says otherwise, on " +
           relight::gpu::create_device(backend, relight::gpu::DeviceOptions{})->name();
  });
  const capture::Image<std::uint8_t> grey(64, 64, 3, 128);
  good &= check(out, "H.264", [&] {
    H264Encoder encoder(grey.width, grey.height);
    encoder.encode(grey, 0, true);
    const unsigned v = avcodec_version();
    return encoder.codec_string() + ", libavcodec " + std::to_string(AV_VERSION_MAJOR(v)) + '.' +
           std::to_string(AV_VERSION_MINOR(v)) + '.' + std::to_string(AV_VERSION_MICRO(v)) + " with libx264";
  });
  good &= check(out, "JPEG",
                [&] { return std::to_string(JpegEncoder(85).encode(grey).size()) + " bytes for a grey tile"; });
  out << (good ? "  everything that serve and replay need is here\n"
               : "  something that serve and replay need is missing\n");
  return good;
}

}  // namespace lumigraft::server
