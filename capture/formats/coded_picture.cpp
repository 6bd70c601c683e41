#include "capture/formats/coded_picture.h"

#include <turbojpeg.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "capture/error.h"
#include "capture/formats/picture_decoders.h"
#include "capture/formats/rgb_frame.h"

namespace lumigraft::capture {
namespace {

using PictureBytes = std::span<const std::uint8_t>;
using namespace std::literals;

bool starts_with(PictureBytes bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

/// Of Adobe's files, which store both inks and black inverted (libjpeg-turbo leaves them so).
Image<std::uint8_t> rgb_of_inverted_cmyk(const Image<std::uint8_t>& cmyk) {
  Image<std::uint8_t> rgb(cmyk.width, cmyk.height, 3);
  for (std::size_t i = 0; i < rgb.data.size(); ++i) {
    const int ink = cmyk.data[i / 3 * 4 + i % 3], black = cmyk.data[i / 3 * 4 + 3];
    rgb.data[i] = static_cast<std::uint8_t>((ink * black + 127) / 255);
  }
  return rgb;
}

Image<std::uint8_t> decode_jpeg(PictureBytes bytes, int max_edge) {
  const std::unique_ptr<void, decltype(&tjDestroy)> decoder(tjInitDecompress(), &tjDestroy);
  const auto size = static_cast<unsigned long>(bytes.size());
  int width = 0, height = 0, sampling = 0, colors = 0;
  if (tjDecompressHeader3(decoder.get(), bytes.data(), size, &width, &height, &sampling, &colors) != 0) return {};
  refuse_large_picture(width, height, max_edge);
  const bool inks = colors == TJCS_CMYK || colors == TJCS_YCCK;
  Image<std::uint8_t> picture(width, height, inks ? 4 : 3);
  const int failed = tjDecompress2(decoder.get(), bytes.data(), size, picture.data.data(), width, 0, height,
                                   inks ? TJPF_CMYK : TJPF_RGB, TJFLAG_LIMITSCANS);
  // A warning: the rest of a file that is cut short is grey.
  if (failed != 0 && tjGetErrorCode(decoder.get()) != TJERR_WARNING) return {};
  return inks ? rgb_of_inverted_cmyk(picture) : picture;
}

Image<std::uint8_t> decode_webp(PictureBytes bytes, int max_edge) {
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK) return {};
  refuse_large_picture(features.width, features.height, max_edge);
  const bool alpha = features.has_alpha != 0;
  Image<std::uint8_t> picture(features.width, features.height, alpha ? 4 : 3);
  const auto decode = alpha ? &WebPDecodeRGBAInto : &WebPDecodeRGBInto;
  const auto* decoded =
      decode(bytes.data(), bytes.size(), picture.data.data(), picture.data.size(), picture.channels * picture.width);
  return decoded != nullptr ? picture : Image<std::uint8_t>{};
}

struct LibavFormat {
  std::string_view start;
  AVCodecID codec;
};
constexpr std::array kLibavFormats = {LibavFormat{"BM"sv, AV_CODEC_ID_BMP},
                                      LibavFormat{"P1"sv, AV_CODEC_ID_PBM},
                                      LibavFormat{"P2"sv, AV_CODEC_ID_PGM},
                                      LibavFormat{"P3"sv, AV_CODEC_ID_PPM},
                                      LibavFormat{"P4"sv, AV_CODEC_ID_PBM},
                                      LibavFormat{"P5"sv, AV_CODEC_ID_PGM},
                                      LibavFormat{"P6"sv, AV_CODEC_ID_PPM},
                                      LibavFormat{"\x59\xa6\x6a\x95"sv, AV_CODEC_ID_SUNRAST},
                                      LibavFormat{"\0\0\0\x0cjP  "sv, AV_CODEC_ID_JPEG2000}};

/// Formats of which libav reads every kind.
Image<std::uint8_t> decode_by_libav(AVCodecID id, PictureBytes bytes, int max_edge) {
  const AVCodec* codec = avcodec_find_decoder(id);
  const CodecContext context(avcodec_alloc_context3(codec));
  const LibavPacket packet(av_packet_alloc());
  const LibavFrame frame(av_frame_alloc());
  if (!codec || !context || !packet || !frame) return {};
  av_log_set_level(AV_LOG_QUIET);                           // this program reports errors itself
  context->max_pixels = std::int64_t{max_edge} * max_edge;  // refused before any is decoded
  if (avcodec_open2(context.get(), codec, nullptr) < 0) return {};
  if (bytes.size() > 1u << 30 || av_new_packet(packet.get(), static_cast<int>(bytes.size())) < 0) return {};
  std::memcpy(packet->data, bytes.data(), bytes.size());
  const bool decoded = avcodec_send_packet(context.get(), packet.get()) >= 0 &&
                       avcodec_send_packet(context.get(), nullptr) >= 0 &&
                       avcodec_receive_frame(context.get(), frame.get()) >= 0;
  if (!decoded) {
    refuse_large_picture(context->width, context->height, max_edge);
    return {};
  }
  refuse_large_picture(frame->width, frame->height, max_edge);
  return RgbFrame().convert(*frame, true);
}

}  // namespace

void refuse_large_picture(std::int64_t width, std::int64_t height, int max_edge) {
  refuse_if(width > max_edge || height > max_edge, "found " + std::to_string(width) + " x " + std::to_string(height) +
                                                       " pixels, allowed: at most " + std::to_string(max_edge) +
                                                       " along an edge");
}

Image<std::uint8_t> decode_coded_picture(PictureBytes bytes, int max_edge) {
  if (starts_with(bytes, "\x89PNG"sv)) return decode_any_png(bytes, max_edge);
  if (starts_with(bytes, "\xff\xd8\xff"sv)) return decode_jpeg(bytes, max_edge);
  if (starts_with(bytes, "RIFF"sv)) return decode_webp(bytes, max_edge);
  if (starts_with(bytes, "II*\0"sv) || starts_with(bytes, "MM\0*"sv)) return decode_tiff(bytes, max_edge);
  const auto* format = std::find_if(kLibavFormats.begin(), kLibavFormats.end(),
                                    [&](const LibavFormat& f) { return starts_with(bytes, f.start); });
  return format != kLibavFormats.end() ? decode_by_libav(format->codec, bytes, max_edge) : Image<std::uint8_t>{};
}

Image<std::uint8_t> without_alpha(Image<std::uint8_t> picture) {
  if (picture.channels == 3) return picture;
  Image<std::uint8_t> rgb(picture.width, picture.height, 3);
  for (std::size_t i = 0; i < rgb.data.size(); ++i) rgb.data[i] = picture.data[i / 3 * 4 + i % 3];
  return rgb;
}

}  // namespace lumigraft::capture
