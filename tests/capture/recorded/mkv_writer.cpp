#include "tests/capture/recorded/mkv_writer.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <cstring>
#include <functional>
#include <stdexcept>

namespace lumigraft::test {
namespace {

void check(int code, const char* what) {
  if (code < 0) {
    throw std::runtime_error(std::string(what) + " failed");
  }
}

using Fill = std::function<void(std::size_t, AVFrame&)>;

/// Encodes one frame per time; `fill` sets its pixels.
void write(const std::filesystem::path& file, const std::string& codec_name, AVPixelFormat format, int width,
           int height, const std::vector<std::int64_t>& times_ms, const Fill& fill) {
  AVFormatContext* out = nullptr;
  check(avformat_alloc_output_context2(&out, nullptr, "matroska", file.c_str()), "context");
  const AVCodec* codec = avcodec_find_encoder_by_name(codec_name.c_str());
  AVCodecContext* encoder = avcodec_alloc_context3(codec);
  encoder->width = width;
  encoder->height = height;
  encoder->pix_fmt = format;
  encoder->time_base = {1, 1000};
  encoder->flags |= AV_CODEC_FLAG_QSCALE | AV_CODEC_FLAG_GLOBAL_HEADER;
  encoder->global_quality = 2 * FF_QP2LAMBDA;
  if (codec_name == "ffv1") {
    encoder->level = 3;  // with a checksum per slice
    encoder->gop_size = 1;
  }
  check(avcodec_open2(encoder, codec, nullptr), "codec");
  AVStream* stream = avformat_new_stream(out, nullptr);
  check(avcodec_parameters_from_context(stream->codecpar, encoder), "parameters");
  stream->time_base = encoder->time_base;
  check(avio_open(&out->pb, file.c_str(), AVIO_FLAG_WRITE), "file");
  check(avformat_write_header(out, nullptr), "header");
  AVFrame* frame = av_frame_alloc();
  AVPacket* packet = av_packet_alloc();
  const auto drain = [&] {
    while (avcodec_receive_packet(encoder, packet) == 0) {
      av_packet_rescale_ts(packet, encoder->time_base, stream->time_base);
      packet->stream_index = 0;
      check(av_interleaved_write_frame(out, packet), "packet");
    }
  };
  for (std::size_t i = 0; i < times_ms.size(); ++i) {
    frame->format = format;
    frame->width = width;
    frame->height = height;
    frame->quality = encoder->global_quality;
    check(av_frame_get_buffer(frame, 0), "frame");
    fill(i, *frame);
    frame->pts = times_ms[i];
    check(avcodec_send_frame(encoder, frame), "encode");
    av_frame_unref(frame);
    drain();
  }
  avcodec_send_frame(encoder, nullptr);
  drain();
  check(av_write_trailer(out), "trailer");
  av_packet_free(&packet);
  av_frame_free(&frame);
  avio_closep(&out->pb);
  avcodec_free_context(&encoder);
  avformat_free_context(out);
}

}  // namespace

void write_color_mkv(const std::filesystem::path& file, const std::string& codec,
                     const std::vector<TimedRgb>& pictures) {
  const AVPixelFormat format = codec == "mjpeg" ? AV_PIX_FMT_YUVJ444P : AV_PIX_FMT_BGR0;
  std::vector<std::int64_t> times;
  times.reserve(pictures.size());
  for (const TimedRgb& picture : pictures) {
    times.push_back(picture.time_ms);
  }
  const int width = pictures[0].rgb.width;
  const int height = pictures[0].rgb.height;
  SwsContext* scaler = sws_getContext(width, height, AV_PIX_FMT_RGB24, width, height, format,
                                      SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr, nullptr, nullptr);
  const int* coefficients = sws_getCoefficients(SWS_CS_ITU601);
  sws_setColorspaceDetails(scaler, coefficients, 1, coefficients, 1, 0, 1 << 16, 1 << 16);
  write(file, codec, format, width, height, times, [&](std::size_t i, AVFrame& frame) {
    const std::uint8_t* planes[4] = {pictures[i].rgb.data.data(), nullptr, nullptr, nullptr};
    const int strides[4] = {3 * width, 0, 0, 0};
    sws_scale(scaler, planes, strides, 0, height, frame.data, frame.linesize);
  });
  sws_freeContext(scaler);
}

void write_depth_mkv(const std::filesystem::path& file, const std::vector<TimedCounts>& pictures) {
  std::vector<std::int64_t> times;
  times.reserve(pictures.size());
  for (const TimedCounts& picture : pictures) {
    times.push_back(picture.time_ms);
  }
  const capture::Image<std::uint16_t>& first = pictures[0].counts;
  write(file, "ffv1", AV_PIX_FMT_GRAY16LE, first.width, first.height, times, [&](std::size_t i, AVFrame& frame) {
    for (int y = 0; y < first.height; ++y) {
      std::memcpy(frame.data[0] + static_cast<std::ptrdiff_t>(y) * frame.linesize[0], &pictures[i].counts.at(0, y),
                  2 * static_cast<std::size_t>(first.width));
    }
  });
}

}  // namespace lumigraft::test
