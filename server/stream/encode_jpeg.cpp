#include "server/stream/encode_jpeg.h"

#include <turbojpeg.h>

#include <stdexcept>
#include <string>

namespace lumigraft::server {

JpegEncoder::JpegEncoder(int quality) : quality_(quality), handle_(tjInitCompress()) {
  if (handle_ == nullptr) throw std::runtime_error("TurboJPEG does not start");
}

JpegEncoder::~JpegEncoder() { tjDestroy(handle_); }

std::vector<std::uint8_t> JpegEncoder::encode(const capture::Image<std::uint8_t>& srgb) {
  std::vector<std::uint8_t> out(tjBufSize(srgb.width, srgb.height, TJSAMP_420));
  unsigned char* data = out.data();
  unsigned long size = out.size();
  if (tjCompress2(handle_, srgb.data.data(), srgb.width, 3 * srgb.width, srgb.height, TJPF_RGB, &data, &size,
                  TJSAMP_420, quality_, TJFLAG_NOREALLOC) != 0) {
    throw std::runtime_error(std::string("JPEG: ") + tjGetErrorStr2(handle_));
  }
  out.resize(size);
  return out;
}

}  // namespace lumigraft::server
