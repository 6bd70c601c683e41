#include "capture/formats/rgb_frame.h"

#include <cstring>

namespace lumigraft::capture {

Image<std::uint8_t> RgbFrame::convert(const AVFrame& frame, bool full_range) {
  const auto format = static_cast<AVPixelFormat>(frame.format);
  constexpr int kFlags = SWS_BILINEAR | SWS_FULL_CHR_H_INT | SWS_FULL_CHR_H_INP | SWS_ACCURATE_RND | SWS_BITEXACT;
  scaler_.reset(sws_getCachedContext(scaler_.release(), frame.width, frame.height, format, frame.width, frame.height,
                                     AV_PIX_FMT_RGB24, kFlags, nullptr, nullptr, nullptr));
  if (!scaler_) return {};
  const int* from = sws_getCoefficients(frame.colorspace == AVCOL_SPC_BT709 ? SWS_CS_ITU709 : SWS_CS_ITU601);
  sws_setColorspaceDetails(scaler_.get(), from, full_range ? 1 : 0, sws_getCoefficients(SWS_CS_DEFAULT), 1, 0, 1 << 16,
                           1 << 16);
  Image<std::uint8_t> rgb(frame.width, frame.height, 3);
  const int row_bytes = 3 * frame.width;
  // libswscale writes whole vectors. Where rows are whole vectors, too, it writes the image itself; others are padded
  // and copied.
  constexpr int kVector_bytes = 64;  // the widest that libswscale writes at once
  const int stride = (row_bytes + kVector_bytes - 1) / kVector_bytes * kVector_bytes;
  const bool direct = stride == row_bytes;
  if (!direct) padded_.resize(static_cast<std::size_t>(stride) * frame.height + kVector_bytes);
  std::uint8_t* planes[4] = {direct ? rgb.data.data() : padded_.data(), nullptr, nullptr, nullptr};
  const int strides[4] = {stride, 0, 0, 0};
  sws_scale(scaler_.get(), frame.data, frame.linesize, 0, frame.height, planes, strides);
  for (int y = 0; y < frame.height && !direct; ++y) {
    std::memcpy(&rgb.at(0, y), padded_.data() + static_cast<std::ptrdiff_t>(y) * stride,
                static_cast<std::size_t>(row_bytes));
  }
  return rgb;
}

}  // namespace lumigraft::capture
