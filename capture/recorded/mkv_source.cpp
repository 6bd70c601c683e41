#include "capture/recorded/mkv_source.h"

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/crc.h>
#include <libavutil/intreadwrite.h>
#include <libavutil/pixdesc.h>
}

#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "capture/error.h"
#include "capture/formats/libav_pointers.h"
#include "capture/formats/matroska_file.h"
#include "capture/formats/pixel_format.h"
#include "capture/formats/rgb_frame.h"
#include "capture/session/parameters.h"

namespace lumigraft::capture {
namespace {

struct FreeFormat {
  void operator()(AVFormatContext* p) const { avformat_close_input(&p); }
};

/// Whether every slice of an FFV1 packet has the right checksum (RFC 9043, 4.9: a slice ends with size, error status
/// and CRC-32). Checked here because libav's decoder silently fills a damaged slice from the previous frame.
bool slices_intact(const AVPacket& packet) {
  constexpr int kFooter = 3 + 1 + 4;  // bytes of size, error status and CRC-32
  int end = packet.size;
  while (end >= kFooter) {
    const int size = static_cast<int>(AV_RB24(packet.data + end - kFooter)) + kFooter;
    if (size > end || av_crc(av_crc_get_table(AV_CRC_32_IEEE), 0, packet.data + end - size, size) != 0) return false;
    end -= size;
  }
  return end == 0;
}

}  // namespace

/// One pass over the file. The constructor throws InputError with the reason alone.
class MkvSource::Reader {
 public:
  Reader(const std::filesystem::path& file, const StreamSpec& spec) : spec_(spec) {
    av_log_set_level(AV_LOG_QUIET);  // this program reports errors itself
    AVFormatContext* format = nullptr;
    // "file:" prevents names like http://... from being opened as URLs; the demuxer is given, so no other one is tried.
    const std::string url = "file:" + file.string();
    refuse_if(avformat_open_input(&format, url.c_str(), av_find_input_format("matroska"), nullptr) < 0,
              "found no readable Matroska file");
    format_.reset(format);
    refuse_if(avformat_find_stream_info(format, nullptr) < 0, "found a Matroska file whose streams cannot be read");
    stream_ = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    refuse_if(stream_ < 0, "found a Matroska file without video");
    const AVCodecParameters* parameters = format->streams[stream_]->codecpar;
    const bool depth = spec.stream == Stream::depth;
    const bool camera_format =
        parameters->codec_id == AV_CODEC_ID_RAWVIDEO || (!depth && parameters->codec_id == AV_CODEC_ID_MJPEG);
    refuse_if(parameters->codec_id != AV_CODEC_ID_FFV1 && !camera_format,
              std::string("found codec ") + avcodec_get_name(parameters->codec_id) +
                  ", allowed: " + (depth ? "ffv1, rawvideo" : "ffv1, mjpeg, rawvideo"));
    refuse_if(parameters->width != spec.width || parameters->height != spec.height,
              "found " + size_text(parameters->width, parameters->height) +
                  ", allowed: " + size_text(spec.width, spec.height));
    if (parameters->codec_id == AV_CODEC_ID_RAWVIDEO) {
      std::array<char, 4> fourcc{};
      std::memcpy(fourcc.data(), &parameters->codec_tag, fourcc.size());
      uncompressed_ = pixel_format_of(fourcc);
      refuse_if(!uncompressed_ || !bytes_of(*uncompressed_, spec.width, spec.height) ||
                    (depth && *uncompressed_ != PixelFormat::grey16),
                "found uncompressed video in a format or size that no camera here gives");
    }
    const AVCodec* codec = avcodec_find_decoder(parameters->codec_id);
    codec_.reset(avcodec_alloc_context3(codec));
    refuse_if(codec_ == nullptr || avcodec_parameters_to_context(codec_.get(), parameters) < 0,
              "found a stream that cannot be decoded");
    codec_->err_recognition = AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER | AV_EF_EXPLODE;
    refuse_if(avcodec_open2(codec_.get(), codec, nullptr) < 0, "found a stream that cannot be decoded");
    if (!frame_ || !packet_) throw std::bad_alloc();
  }

  /// Seeks to the latest key cluster that is not after `time_ns`; frames before `time_ns` are then skipped.
  void skip_to(std::int64_t time_ns, const std::vector<MatroskaCluster>& clusters) {
    skip_to_ns_ = time_ns;
    const MatroskaCluster* best = nullptr;
    for (const MatroskaCluster& cluster : clusters) {
      if (ns(cluster.ticks) <= time_ns && cluster.key && cluster.frames_before > sequence_) best = &cluster;
    }
    if (best == nullptr || format_->nb_streams != 1) return;
    AVStream* stream = format_->streams[stream_];
    for (const MatroskaCluster* one : {best, best + (best != &clusters.back())}) {  // libav also needs the next entry
      av_add_index_entry(stream, one->position, one->ticks, 0, 0, AVINDEX_KEYFRAME);
    }
    if (av_seek_frame(format_.get(), stream_, best->ticks, AVSEEK_FLAG_BACKWARD) == 0) {
      avcodec_flush_buffers(codec_.get());
      sequence_ = best->frames_before;
    }
  }

  /// The next frame or lost frame. Empty at the end.
  std::optional<SourceItem> next() {
    for (;;) {
      const int received = avcodec_receive_frame(codec_.get(), frame_.get());
      if (received == 0) return convert();
      if (received == AVERROR_EOF) return std::nullopt;
      if (received != AVERROR(EAGAIN)) return lost("the picture cannot be decoded");
      const int read = av_read_frame(format_.get(), packet_.get());
      if (read < 0) {
        avcodec_send_packet(codec_.get(), nullptr);  // end of the file: drain the decoder
        continue;
      }
      const bool ours = packet_->stream_index == stream_;
      const bool damaged = ours && ((packet_->flags & AV_PKT_FLAG_CORRUPT) != 0 || !checksums_right());
      packet_time_ = packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts;
      if (ours && skipped()) continue;
      packet_exposure_ = own_exposure();
      if (ours && !damaged && uncompressed_) {
        SourceItem item = take_uncompressed();
        av_packet_unref(packet_.get());
        return item;
      }
      if (ours && codec_->codec_id == AV_CODEC_ID_MJPEG) jpeg_.assign(packet_->data, packet_->data + packet_->size);
      const int sent = ours && !damaged ? avcodec_send_packet(codec_.get(), packet_.get()) : 0;
      av_packet_unref(packet_.get());
      if (damaged || sent < 0) return lost("the picture is damaged");
    }
  }

 private:
  /// True if the newest packet is older than the wanted time. Packets since the last key frame are kept, since the
  /// wanted frame may need them, and decoded before it.
  bool skipped() {
    if (packet_time_ != AV_NOPTS_VALUE && ns(packet_time_) < skip_to_ns_) {
      if ((packet_->flags & AV_PKT_FLAG_KEY) != 0) needed_.clear();
      needed_.emplace_back(av_packet_alloc());
      av_packet_move_ref(needed_.back().get(), packet_.get());
      ++sequence_;
      return true;
    }
    const bool intra = uncompressed_ || codec_->codec_id == AV_CODEC_ID_MJPEG;
    for (const auto& before : needed_) {
      if (!intra && avcodec_send_packet(codec_.get(), before.get()) == 0) {
        avcodec_receive_frame(codec_.get(), frame_.get());
      }
    }
    needed_.clear();
    return false;
  }

  std::int64_t ns(std::int64_t container_time) const {
    return av_rescale_q(container_time, format_->streams[stream_]->time_base, AVRational{1, 1'000'000'000});
  }

  /// False for a damaged packet of a stream with checksums. FFV1 before version 3 has none, and later versions may omit
  /// them: the first packet decides whether the stream has them.
  bool checksums_right() {
    if (codec_->codec_id != AV_CODEC_ID_FFV1) return true;
    const bool intact = slices_intact(*packet_);
    has_checksums_ = has_checksums_.value_or(intact);
    return intact || !*has_checksums_;
  }

  /// The exposure stored with a packet, for frames whose exposure is not that of the session.
  std::optional<double> own_exposure() const {
    std::size_t size = 0;
    const std::uint8_t* data = av_packet_get_side_data(packet_.get(), AV_PKT_DATA_MATROSKA_BLOCKADDITIONAL, &size);
    if (data == nullptr || size != 16 || AV_RB64(data) != MatroskaFile::kExposureId) return std::nullopt;
    const auto exposure = std::bit_cast<double>(static_cast<std::uint64_t>(AV_RB64(data + 8)));
    const bool valid = exposure >= kSessionLimits.min_exposure && exposure <= kSessionLimits.max_exposure;
    return valid ? std::optional(exposure) : std::nullopt;
  }

  Stamp stamp(std::int64_t container_time) {
    if (container_time != AV_NOPTS_VALUE) last_time_ns_ = ns(container_time);
    return {last_time_ns_, steady_now_ns(), sequence_++};
  }

  SourceItem lost(const std::string& reason) { return LostFrame{stamp(packet_time_), spec_.stream, reason}; }

  SourceItem convert() {
    const AVFrame& frame = *frame_;
    const Stamp at = stamp(frame.best_effort_timestamp);
    const std::string reason = unusable(frame);
    if (!reason.empty()) return LostFrame{at, spec_.stream, reason};
    if (spec_.stream == Stream::depth) return RawDepth{at, to_counts(frame)};
    const bool full_range = frame.color_range == AVCOL_RANGE_JPEG || codec_->codec_id == AV_CODEC_ID_MJPEG;
    Frame picture = picture_at(at, rgb_.convert(frame, full_range));
    if (codec_->codec_id == AV_CODEC_ID_MJPEG) {
      picture.original = std::make_shared<RawFrame>(RawFrame{PixelFormat::mjpeg, jpeg_});
    }
    return picture;
  }

  /// Why a decoded frame cannot be used; empty if it can.
  std::string unusable(const AVFrame& frame) const {
    if (frame.best_effort_timestamp == AV_NOPTS_VALUE) return "the picture has no timestamp";
    if (frame.decode_error_flags != 0 || (frame.flags & AV_FRAME_FLAG_CORRUPT) != 0) return "the picture is damaged";
    if (frame.width != spec_.width || frame.height != spec_.height) {
      return "found " + size_text(frame.width, frame.height) + ", allowed: " + size_text(spec_.width, spec_.height);
    }
    const AVPixFmtDescriptor* format = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
    const bool depth = spec_.stream == Stream::depth;
    const bool right = depth ? frame.format == AV_PIX_FMT_GRAY16LE || frame.format == AV_PIX_FMT_GRAY16BE
                             : format != nullptr && format->comp[0].depth == 8;
    if (!right) {
      return std::string("found pixel format ") + (format != nullptr ? format->name : "none") +
             (depth ? ", allowed: gray16" : ", allowed: 8 bits a channel");
    }
    return "";
  }

  static Image<std::uint16_t> to_counts(const AVFrame& frame) {
    Image<std::uint16_t> counts(frame.width, frame.height, 1);
    const bool big_endian = frame.format == AV_PIX_FMT_GRAY16BE;
    for (int y = 0; y < frame.height; ++y) {
      const std::uint8_t* row = frame.data[0] + static_cast<std::ptrdiff_t>(y) * frame.linesize[0];
      for (int x = 0; x < frame.width; ++x, row += 2) {
        counts.at(x, y) = static_cast<std::uint16_t>(big_endian ? AV_RB16(row) : AV_RL16(row));
      }
    }
    return counts;
  }

  /// An uncompressed frame has the camera's format and is converted to RGB as it was when it was recorded.
  SourceItem take_uncompressed() {
    const Stamp at = stamp(packet_->pts);
    const std::span<const std::uint8_t> bytes(packet_->data, static_cast<std::size_t>(packet_->size));
    if (spec_.stream == Stream::depth) return uncompressed_depth(at, bytes);
    std::optional<Image<std::uint8_t>> rgb = pixels_.to_rgb(*uncompressed_, spec_.width, spec_.height, bytes);
    if (!rgb) return LostFrame{at, spec_.stream, "the picture is damaged"};
    Frame picture = picture_at(at, std::move(*rgb));
    if (*uncompressed_ != PixelFormat::rgb8) {
      picture.original =
          std::make_shared<RawFrame>(RawFrame{*uncompressed_, std::vector<std::uint8_t>(bytes.begin(), bytes.end())});
    }
    return picture;
  }

  SourceItem uncompressed_depth(const Stamp& at, std::span<const std::uint8_t> bytes) const {
    auto counts = capture::to_counts(spec_.width, spec_.height, bytes);
    if (!counts) return LostFrame{at, spec_.stream, "the picture is damaged"};
    return RawDepth{at, std::move(*counts)};
  }

  Frame picture_at(const Stamp& at, Image<std::uint8_t> rgb) const {
    const double exposure = packet_exposure_.value_or(spec_.exposure);
    return {.stamp = at, .stream = spec_.stream, .exposure = exposure, .encoded = std::move(rgb)};
  }

  StreamSpec spec_;
  std::unique_ptr<AVFormatContext, FreeFormat> format_;
  CodecContext codec_;
  LibavFrame frame_{av_frame_alloc()};
  LibavPacket packet_{av_packet_alloc()};
  RgbFrame rgb_;
  PixelConverter pixels_;
  std::optional<PixelFormat> uncompressed_;
  std::vector<std::uint8_t> jpeg_;  ///< the newest packet of an MJPEG stream
  int stream_ = -1;
  std::int64_t skip_to_ns_ = std::numeric_limits<std::int64_t>::min();
  std::vector<LibavPacket> needed_;  ///< older packets since the last key frame, not decoded yet
  std::optional<bool> has_checksums_;
  std::int64_t packet_time_ = AV_NOPTS_VALUE;
  std::optional<double> packet_exposure_;  ///< of the next frame, since none of these decoders delays frames
  std::int64_t last_time_ns_ = 0;
  std::uint64_t sequence_ = 0;
};

MkvSource::MkvSource(const std::filesystem::path& file, const StreamSpec& spec) : file_(file), spec_(spec) {
  with_error_context(file.string(), [&] {
    reader_ = std::make_unique<Reader>(file, spec);
    ahead_ = reader_->next();
    refuse_if(!ahead_, "found a Matroska file without a picture");
    if (const auto* lost = std::get_if<LostFrame>(&*ahead_)) throw InputError("first picture: " + lost->reason);
    first_time_ns_ = stamp_of(*ahead_).time_ns;
  });
}

MkvSource::~MkvSource() = default;

std::optional<SourceItem> MkvSource::next(std::chrono::milliseconds /*timeout*/) {
  if (!ahead_) return std::nullopt;
  std::optional<SourceItem> item = std::move(ahead_);
  ahead_ = reader_->next();
  return item;
}

void MkvSource::skip_to(std::int64_t time_ns) {
  if (!clusters_) clusters_ = matroska_clusters(file_);
  reader_->skip_to(time_ns, *clusters_);
  while (ahead_ && stamp_of(*ahead_).time_ns < time_ns) ahead_ = reader_->next();
}

void MkvSource::rewind() {
  // Opened again instead of sought, so that the decoder starts in the same state as the first time.
  try {
    reader_ = std::make_unique<Reader>(file_, spec_);
    ahead_ = reader_->next();
  } catch (const InputError&) {
    ahead_.reset();  // the file does not exist any more: finished
  }
}

}  // namespace lumigraft::capture
