#include "capture/record/stream_recorder.h"

extern "C" {
#include <libavutil/opt.h>
}

#include <bit>
#include <cstring>
#include <new>
#include <stdexcept>

#include "capture/error.h"
#include "capture/formats/libav_pointers.h"
#include "capture/formats/matroska_file.h"

namespace lumigraft::capture {

/// Encodes 16-bit counts as FFV1 (RFC 9043) version 3. Every frame is decodable alone; each slice has a checksum.
class StreamRecorder::DepthEncoder {
 public:
  DepthEncoder(int width, int height) {
    const AVCodec* codec = avcodec_find_encoder(AV_CODEC_ID_FFV1);
    context_.reset(codec != nullptr ? avcodec_alloc_context3(codec) : nullptr);
    if (!context_ || !frame_ || !packet_) throw std::runtime_error("found no FFV1 encoder in libavcodec");
    context_->width = width;
    context_->height = height;
    context_->pix_fmt = AV_PIX_FMT_GRAY16LE;
    context_->time_base = {1, 1000};  // required by libav and unused: the container has the times
    context_->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    context_->level = 3;
    context_->gop_size = 1;
    context_->thread_count = 1;
    context_->slices = 4;  // 2 x 2, each with its own checksum
    av_opt_set_int(context_->priv_data, "slicecrc", 1, 0);
    av_log_set_level(AV_LOG_QUIET);
    if (avcodec_open2(context_.get(), codec, nullptr) < 0) {
      throw std::runtime_error("FFV1 takes no pictures of " + size_text(width, height));
    }
    frame_->format = context_->pix_fmt;
    frame_->width = width;
    frame_->height = height;
    if (av_frame_get_buffer(frame_.get(), 0) < 0) throw std::bad_alloc();
  }

  std::vector<std::uint8_t> configuration() const {
    return {context_->extradata, context_->extradata + context_->extradata_size};
  }

  /// Valid until the next call.
  std::span<const std::uint8_t> encode(const Image<std::uint16_t>& counts) {
    if (av_frame_make_writable(frame_.get()) < 0) throw std::bad_alloc();
    for (int y = 0; y < counts.height; ++y) {
      std::memcpy(frame_->data[0] + static_cast<std::ptrdiff_t>(y) * frame_->linesize[0], &counts.at(0, y),
                  2 * static_cast<std::size_t>(counts.width));
    }
    frame_->pts = next_++;
    av_packet_unref(packet_.get());
    if (avcodec_send_frame(context_.get(), frame_.get()) < 0 ||
        avcodec_receive_packet(context_.get(), packet_.get()) < 0) {
      throw std::runtime_error("FFV1 could not encode a depth picture");
    }
    return {packet_->data, static_cast<std::size_t>(packet_->size)};
  }

 private:
  CodecContext context_;
  LibavFrame frame_{av_frame_alloc()};
  LibavPacket packet_{av_packet_alloc()};
  std::int64_t next_ = 0;
};

StreamRecorder::StreamRecorder(std::filesystem::path file, const StreamSpec& spec, DepthCoding coding)
    : file_(std::move(file)), spec_(spec), coding_(coding) {
  refuse_if(std::filesystem::exists(file_), file_.string() + ": found a recording, allowed: a new file");
}

StreamRecorder::~StreamRecorder() = default;

bool StreamRecorder::in_order(std::int64_t time_ns) {
  const bool bracket = spec_.stream == Stream::fisheye && time_ns == last_time_ns_;
  if (time_ns < 0 || (time_ns <= last_time_ns_ && !bracket)) return false;
  last_time_ns_ = time_ns;
  return true;
}

bool StreamRecorder::write(const SourceItem& item) {
  if (const auto* depth = std::get_if<RawDepth>(&item)) {
    if (!in_order(depth->stamp.time_ns)) return false;
    if (!out_) {
      MatroskaTrack track{.codec = "V_UNCOMPRESSED", .width = spec_.width, .height = spec_.height};
      track.uncompressed_fourcc = *fourcc_of(PixelFormat::grey16);
      if (coding_ == DepthCoding::ffv1) {
        encoder_ = std::make_unique<DepthEncoder>(spec_.width, spec_.height);
        track.codec = "V_FFV1";
        track.codec_private = encoder_->configuration();
      }
      out_ = std::make_unique<MatroskaFile>(file_, track);
    }
    static_assert(std::endian::native == std::endian::little, "grey16 has its lower byte first");
    const auto& counts = depth->counts.data;
    out_->append(depth->stamp.time_ns,
                 encoder_ ? encoder_->encode(depth->counts)
                          : std::span(reinterpret_cast<const std::uint8_t*>(counts.data()), 2 * counts.size()));
  } else if (const auto* frame = std::get_if<Frame>(&item)) {
    refuse_if(frame->encoded.empty() && !frame->original,
              file_.filename().string() +
                  ": found pictures of radiance, allowed: 8-bit pictures, since those are what cameras give");
    if (!in_order(frame->stamp.time_ns)) return false;
    const PixelFormat format = frame->original ? frame->original->format : PixelFormat::rgb8;
    const std::span<const std::uint8_t> bytes = frame->original ? frame->original->bytes : frame->encoded.data;
    if (!out_) {
      format_ = format;
      const auto fourcc = fourcc_of(format);
      out_ = std::make_unique<MatroskaFile>(
          file_, MatroskaTrack{.codec = fourcc ? "V_UNCOMPRESSED" : "V_MJPEG",
                               .width = spec_.width,
                               .height = spec_.height,
                               .uncompressed_fourcc = fourcc.value_or(std::array<char, 4>{})});
    }
    if (format != format_) return false;  // a Matroska track has one format
    const bool own_exposure = frame->exposure != spec_.exposure;
    out_->append(frame->stamp.time_ns, bytes, own_exposure ? std::optional(frame->exposure) : std::nullopt);
  } else {
    return false;
  }
  ++frames_;
  return true;
}

}  // namespace lumigraft::capture
