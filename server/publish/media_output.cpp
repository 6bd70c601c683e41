#include "server/publish/media_output.h"

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "capture/formats/libav_pointers.h"
#include "server/publish/parameters.h"

namespace lumigraft::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr AVRational kNanoseconds{1, 1'000'000'000};

void check(const char* what, int code) {
  if (code >= 0) return;
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  throw std::runtime_error(std::string(what) + ": " + (code == AVERROR_EXIT ? "no answer in time" : text.data()));
}

/// Options for libavformat, whose unused ones are freed.
struct Options {
  AVDictionary* all = nullptr;
  Options() = default;
  Options(const Options&) = delete;
  Options& operator=(const Options&) = delete;
  ~Options() { av_dict_free(&all); }
};

void set_format(AVStream& stream, const MediaOutput::Format& format) {
  AVCodecParameters& codec = *stream.codecpar;
  codec.codec_type = AVMEDIA_TYPE_VIDEO;
  codec.codec_id = AV_CODEC_ID_H264;
  codec.width = format.width;
  codec.height = format.height;
  const std::size_t size = format.parameter_sets.size();
  codec.extradata = static_cast<std::uint8_t*>(av_mallocz(size + AV_INPUT_BUFFER_PADDING_SIZE));
  if (codec.extradata == nullptr) throw std::runtime_error("out of memory");
  std::memcpy(codec.extradata, format.parameter_sets.data(), size);
  codec.extradata_size = static_cast<int>(size);
}

}  // namespace

struct MediaOutput::State {
  AVFormatContext* output = nullptr;
  capture::LibavPacket packet{av_packet_alloc()};
  std::stop_token stop;
  Clock::time_point deadline;
  bool begun = false;
  Clock::time_point first_captured;
  std::int64_t last_pts = -1;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (output == nullptr) return;
    // Also after a failure: the trailer of RTSP frees its connection.
    stop = {};
    deadline = Clock::now() + kPublish.goodbye;
    if (begun) av_write_trailer(output);
    if ((output->oformat->flags & AVFMT_NOFILE) == 0) avio_closep(&output->pb);
    avformat_free_context(output);
  }

  static int interrupted(void* state) {
    const State& s = *static_cast<const State*>(state);
    return s.stop.stop_requested() || Clock::now() > s.deadline ? 1 : 0;
  }
};

MediaOutput::MediaOutput(const PublishUrl& url, const Format& format, std::stop_token stop)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.stop = std::move(stop);
  s.deadline = Clock::now() + kPublish.open_patience;
  if (s.packet == nullptr) throw std::runtime_error("out of memory");
  check("libavformat", avformat_alloc_output_context2(&s.output, nullptr, url.muxer.c_str(), url.url.c_str()));
  s.output->interrupt_callback = {&State::interrupted, &s};
  s.output->flags |= AVFMT_FLAG_FLUSH_PACKETS;
  s.output->max_delay = 0;
  s.output->start_time_realtime = format.first_time_ns / 1000;  // so that RTCP tells times of capture
  s.first_captured = format.first_captured;
  AVStream* stream = avformat_new_stream(s.output, nullptr);
  if (stream == nullptr) throw std::runtime_error("out of memory");
  set_format(*stream, format);
  Options options;
  if (url.muxer == "rtsp") av_dict_set(&options.all, "rtsp_transport", "tcp", 0);
  if (url.muxer != "mpegts") av_dict_set_int(&options.all, "pkt_size", kPublish.packet_bytes, 0);
  if ((s.output->oformat->flags & AVFMT_NOFILE) == 0) {
    check("connecting",
          avio_open2(&s.output->pb, url.url.c_str(), AVIO_FLAG_WRITE, &s.output->interrupt_callback, &options.all));
  }
  check("connecting", avformat_write_header(s.output, &options.all));
  s.begun = true;
}

MediaOutput::~MediaOutput() = default;

void MediaOutput::write(std::span<const std::uint8_t> annex_b, bool key, Clock::time_point captured) {
  State& s = *state_;
  s.deadline = Clock::now() + kPublish.write_patience;
  const auto since = std::chrono::duration_cast<std::chrono::nanoseconds>(captured - s.first_captured);
  const std::int64_t pts = av_rescale_q(since.count(), kNanoseconds, s.output->streams[0]->time_base);
  s.last_pts = std::max(pts, s.last_pts + 1);
  AVPacket& packet = *s.packet;
  av_packet_unref(&packet);
  packet.data = const_cast<std::uint8_t*>(annex_b.data());  // av_write_frame only reads it
  packet.size = static_cast<int>(annex_b.size());
  packet.pts = packet.dts = s.last_pts;
  packet.flags = key ? AV_PKT_FLAG_KEY : 0;
  check("writing", av_write_frame(s.output, &packet));
}

}  // namespace lumigraft::server
