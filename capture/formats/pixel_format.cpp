#include "capture/formats/pixel_format.h"

extern "C" {
#include <libavutil/imgutils.h>
}

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "capture/formats/libav_pointers.h"
#include "capture/formats/rgb_frame.h"

namespace lumigraft::capture {
namespace {

struct LibavFormat {
  PixelFormat format;
  AVPixelFormat libav;
};

constexpr std::array<LibavFormat, 14> kLibavFormats = {{{PixelFormat::rgb8, AV_PIX_FMT_RGB24},
                                                        {PixelFormat::bgr8, AV_PIX_FMT_BGR24},
                                                        {PixelFormat::grey8, AV_PIX_FMT_GRAY8},
                                                        {PixelFormat::grey10, AV_PIX_FMT_GRAY10LE},
                                                        {PixelFormat::grey12, AV_PIX_FMT_GRAY12LE},
                                                        {PixelFormat::grey16, AV_PIX_FMT_GRAY16LE},
                                                        {PixelFormat::bayer_rggb8, AV_PIX_FMT_BAYER_RGGB8},
                                                        {PixelFormat::bayer_bggr8, AV_PIX_FMT_BAYER_BGGR8},
                                                        {PixelFormat::bayer_gbrg8, AV_PIX_FMT_BAYER_GBRG8},
                                                        {PixelFormat::bayer_grbg8, AV_PIX_FMT_BAYER_GRBG8},
                                                        {PixelFormat::yuyv, AV_PIX_FMT_YUYV422},
                                                        {PixelFormat::uyvy, AV_PIX_FMT_UYVY422},
                                                        {PixelFormat::nv12, AV_PIX_FMT_NV12},
                                                        {PixelFormat::z16, AV_PIX_FMT_GRAY16LE}}};

const LibavFormat* find_libav(PixelFormat format) {
  const auto* found = std::ranges::find(kLibavFormats, format, &LibavFormat::format);
  return found != kLibavFormats.end() ? found : nullptr;
}

bool is_bayer(PixelFormat format) {
  return format == PixelFormat::bayer_rggb8 || format == PixelFormat::bayer_bggr8 ||
         format == PixelFormat::bayer_gbrg8 || format == PixelFormat::bayer_grbg8;
}

/// Takes the upper eight of `bits` bits of every pixel for all three channels.
Image<std::uint8_t> grey_to_rgb(int width, int height, std::span<const std::uint8_t> bytes, int bits) {
  Image<std::uint8_t> rgb(width, height, 3);
  for (std::size_t i = 0; i < rgb.data.size() / 3; ++i) {
    const int value = bits == 8 ? bytes[i] : (bytes[2 * i] | bytes[2 * i + 1] << 8) >> (bits - 8);
    std::memset(&rgb.data[3 * i], value, 3);
  }
  return rgb;
}

}  // namespace

std::optional<std::size_t> bytes_of(PixelFormat format, int width, int height) {
  const LibavFormat* info = find_libav(format);
  const bool pairs = is_bayer(format) || format == PixelFormat::nv12;  // width and height must be even
  const bool odd = (width % 2 != 0 && (pairs || is_yuv(format))) || (height % 2 != 0 && pairs);
  if (info == nullptr || odd || width <= 0 || height <= 0) return std::nullopt;
  const int size = av_image_get_buffer_size(info->libav, width, height, 1);
  return size > 0 ? std::optional(static_cast<std::size_t>(size)) : std::nullopt;
}

RawFrame::RawFrame(PixelFormat pixel_format, std::vector<std::uint8_t> own_bytes) : format(pixel_format) {
  const auto kept = std::make_shared<const std::vector<std::uint8_t>>(std::move(own_bytes));
  bytes = *kept;
  keeps_bytes = kept;
}

RawFrame::RawFrame(PixelFormat pixel_format, std::span<const std::uint8_t> lent_bytes,
                   std::shared_ptr<const void> lender)
    : format(pixel_format), bytes(lent_bytes), keeps_bytes(std::move(lender)) {}

std::vector<std::uint8_t> without_padding(PixelFormat format, int width, int height, std::size_t row_bytes,
                                          std::span<const std::uint8_t> bytes) {
  const std::size_t size = bytes_of(format, width, height).value_or(0);
  const std::size_t row = format == PixelFormat::nv12 ? static_cast<std::size_t>(width) : size / height;
  if (size == 0 || row_bytes < row || bytes.size() < (size / row - 1) * row_bytes + row) return {};
  std::vector<std::uint8_t> out(size);
  for (std::size_t y = 0; y < size / row; ++y) std::memcpy(&out[y * row], &bytes[y * row_bytes], row);
  return out;
}

std::vector<std::uint8_t> nv12_without_padding(int width, int height, const std::array<std::size_t, 2>& row_bytes,
                                               const std::array<std::span<const std::uint8_t>, 2>& planes) {
  // Rows of both planes have as many bytes as grey rows; chroma has half as many rows.
  auto out = without_padding(PixelFormat::grey8, width, height, row_bytes[0], planes[0]);
  const auto chroma = without_padding(PixelFormat::grey8, width, height / 2, row_bytes[1], planes[1]);
  if (out.empty() || chroma.empty()) return {};
  out.insert(out.end(), chroma.begin(), chroma.end());
  return out;
}

std::optional<Image<std::uint16_t>> to_counts(int width, int height, std::span<const std::uint8_t> bytes) {
  static_assert(std::endian::native == std::endian::little, "the lower byte is first");
  Image<std::uint16_t> counts(width, height, 1);
  if (bytes.size() != 2 * counts.data.size()) return std::nullopt;
  std::memcpy(counts.data.data(), bytes.data(), bytes.size());
  return counts;
}

class PixelConverter::Libav {
 public:
  std::optional<Image<std::uint8_t>> uncompressed(AVPixelFormat format, int width, int height,
                                                  std::span<const std::uint8_t> bytes) {
    view_->format = format;
    view_->width = width;
    view_->height = height;
    av_image_fill_arrays(view_->data, view_->linesize, bytes.data(), format, width, height, 1);
    return non_empty(rgb_.convert(*view_, false));
  }

  std::optional<Image<std::uint8_t>> jpeg(int width, int height, std::span<const std::uint8_t> bytes) {
    if (!decoder_) {
      const AVCodec* codec = avcodec_find_decoder(AV_CODEC_ID_MJPEG);
      decoder_.reset(codec != nullptr ? avcodec_alloc_context3(codec) : nullptr);
      if (!decoder_) return std::nullopt;
      av_log_set_level(AV_LOG_QUIET);
      decoder_->err_recognition = AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER | AV_EF_EXPLODE;
      decoder_->thread_count = 1;
      if (avcodec_open2(decoder_.get(), codec, nullptr) < 0) {
        decoder_.reset();
        return std::nullopt;
      }
    }
    if (bytes.empty() || av_new_packet(packet_.get(), static_cast<int>(bytes.size())) < 0) return std::nullopt;
    std::memcpy(packet_->data, bytes.data(), bytes.size());
    const bool decoded = avcodec_send_packet(decoder_.get(), packet_.get()) >= 0 &&
                         avcodec_receive_frame(decoder_.get(), decoded_.get()) >= 0;
    av_packet_unref(packet_.get());
    if (!decoded) {
      avcodec_flush_buffers(decoder_.get());
      return std::nullopt;
    }
    if (decoded_->width != width || decoded_->height != height || decoded_->decode_error_flags != 0) {
      return std::nullopt;
    }
    return non_empty(rgb_.convert(*decoded_, true));
  }

 private:
  static std::optional<Image<std::uint8_t>> non_empty(Image<std::uint8_t> rgb) {
    return rgb.empty() ? std::nullopt : std::optional(std::move(rgb));
  }
  RgbFrame rgb_;
  LibavFrame view_{av_frame_alloc()};  ///< refers to the caller's bytes
  LibavFrame decoded_{av_frame_alloc()};
  LibavPacket packet_{av_packet_alloc()};
  CodecContext decoder_;
};

PixelConverter::PixelConverter() : libav_(std::make_unique<Libav>()) {}
PixelConverter::~PixelConverter() = default;

std::optional<Image<std::uint8_t>> PixelConverter::to_rgb(PixelFormat format, int width, int height,
                                                          std::span<const std::uint8_t> bytes) {
  if (format == PixelFormat::mjpeg) return libav_->jpeg(width, height, bytes);
  const std::optional<std::size_t> size = bytes_of(format, width, height);
  if (!size || bytes.size() < *size) return std::nullopt;
  if (format == PixelFormat::rgb8) {
    Image<std::uint8_t> rgb(width, height, 3);
    std::memcpy(rgb.data.data(), bytes.data(), *size);
    return rgb;
  }
  if (const int bits = grey_bits(format); bits != 0) return grey_to_rgb(width, height, bytes, bits);
  return libav_->uncompressed(find_libav(format)->libav, width, height, bytes);
}

}  // namespace lumigraft::capture
