#include "server/stream/encode_h264.h"

extern "C" {
#include <libavutil/opt.h>
}

#include <algorithm>
#include <array>
#include <stdexcept>

#include "capture/formats/libav_pointers.h"
#include "capture/message_text.h"
#include "server/stream/parameters.h"

namespace lumigraft::server {
namespace {

constexpr int kTicksPerSecond = 90'000;  // usual video clock; x264 rejects finer ones at high levels
constexpr int kNominal_hz = 30;          // for the level, and the time in which x264 refills its bucket per frame

/// Throws if libav reports an error.
void check(const char* what, int code) {
  if (code >= 0) return;
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  throw std::runtime_error(std::string("H.264: ") + what + ": " + text.data());
}

/// Reads profile, constraints and level: the three bytes after the NAL header of the sequence parameter set.
std::string find_codec_string(const std::vector<std::uint8_t>& annex_b) {
  for (std::size_t i = 0; i + 6 < annex_b.size(); ++i) {
    if (annex_b[i] == 0 && annex_b[i + 1] == 0 && annex_b[i + 2] == 1 && (annex_b[i + 3] & 0x1f) == 7) {
      return capture::formatted("avc1.%02x%02x%02x", annex_b[i + 4], annex_b[i + 5], annex_b[i + 6]);
    }
  }
  return {};
}

}  // namespace

struct H264Encoder::State {
  capture::CodecContext codec;
  capture::LibavFrame frame{av_frame_alloc()};
  capture::LibavPacket packet{av_packet_alloc()};
  capture::LibavScaler to_yuv;
  std::int64_t first_time_ns = 0, last_key_ns = 0, last_pts = -1;
  std::string codec_string;
};

H264Encoder::H264Encoder(int width, int height, std::optional<Bound> bound) : state_(std::make_unique<State>()) {
  State& s = *state_;
  const AVCodec* x264 = avcodec_find_encoder_by_name("libx264");
  if (x264 == nullptr) throw std::runtime_error("H.264: libavcodec was built without libx264");
  s.codec.reset(avcodec_alloc_context3(x264));
  if (s.codec == nullptr || s.frame == nullptr || s.packet == nullptr) throw std::runtime_error("H.264: out of memory");
  s.codec->width = width & ~1;
  s.codec->height = height & ~1;
  s.codec->pix_fmt = AV_PIX_FMT_YUV420P;
  s.codec->time_base = {1, kTicksPerSecond};
  s.codec->framerate = {kNominal_hz, 1};
  s.codec->gop_size = 600;  // key frames are made by time, in encode()
  s.codec->max_b_frames = 0;
  s.codec->thread_count = 1;
  s.codec->log_level_offset = AV_LOG_INFO - AV_LOG_ERROR;  // only errors of x264 reach stderr
  s.codec->color_range = AVCOL_RANGE_MPEG;
  s.codec->colorspace = AVCOL_SPC_BT709;
  s.codec->color_primaries = AVCOL_PRI_BT709;
  s.codec->color_trc = AVCOL_TRC_IEC61966_2_1;
  if (bound) change_bound(*bound);
  av_opt_set(s.codec->priv_data, "preset", "ultrafast", 0);
  av_opt_set(s.codec->priv_data, "tune", "zerolatency", 0);
  av_opt_set(s.codec->priv_data, "profile", "baseline", 0);
  av_opt_set(s.codec->priv_data, "crf", "21", 0);
  av_opt_set(s.codec->priv_data, "forced-idr", "1", 0);
  av_opt_set(s.codec->priv_data, "x264-params", "sliced-threads=0:repeat-headers=1:annexb=1", 0);
  check("does not open", avcodec_open2(s.codec.get(), x264, nullptr));
  s.frame->format = s.codec->pix_fmt;
  s.frame->width = s.codec->width;
  s.frame->height = s.codec->height;
  check("no picture", av_frame_get_buffer(s.frame.get(), 0));
  s.to_yuv.reset(sws_getContext(s.codec->width, s.codec->height, AV_PIX_FMT_RGB24, s.codec->width, s.codec->height,
                                AV_PIX_FMT_YUV420P, SWS_BILINEAR, nullptr, nullptr, nullptr));
  if (s.to_yuv == nullptr) throw std::runtime_error("H.264: no conversion to 4:2:0");
  const int* bt709 = sws_getCoefficients(SWS_CS_ITU709);
  sws_setColorspaceDetails(s.to_yuv.get(), bt709, 1, bt709, 0, 0, 1 << 16, 1 << 16);
}

H264Encoder::~H264Encoder() = default;

void H264Encoder::change_bound(const Bound& bound) {
  // libavcodec compares these with x264's before every frame. Without look-ahead x264 does not know how long a frame
  // lasts and takes the nominal time: rates are in bits per frame of it.
  state_->codec->rc_max_rate = static_cast<std::int64_t>(kNominal_hz * bound.picture_bits);
  state_->codec->rc_buffer_size = static_cast<int>(std::max(bound.burst_bits, bound.picture_bits));
}

H264Encoder::AccessUnit H264Encoder::encode(const capture::Image<std::uint8_t>& srgb, std::int64_t time_ns, bool key) {
  State& s = *state_;
  const bool first = s.last_pts < 0;
  if (first) s.first_time_ns = time_ns;
  key = key || first || time_ns - s.last_key_ns >= kStream.key_every_ns;
  if (key) s.last_key_ns = time_ns;
  check("no picture", av_frame_make_writable(s.frame.get()));
  const std::uint8_t* rows[] = {srgb.data.data()};
  const int stride[] = {3 * srgb.width};
  sws_scale(s.to_yuv.get(), rows, stride, 0, s.codec->height, s.frame->data, s.frame->linesize);
  const std::int64_t pts = (time_ns - s.first_time_ns) / (1'000'000'000 / 1000) * kTicksPerSecond / 1000;
  s.last_pts = std::max(pts, s.last_pts + 1);
  s.frame->pts = s.last_pts;
  s.frame->pict_type = key ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
  check("encoding", avcodec_send_frame(s.codec.get(), s.frame.get()));
  check("encoding", avcodec_receive_packet(s.codec.get(), s.packet.get()));
  AccessUnit unit;
  unit.key = (s.packet->flags & AV_PKT_FLAG_KEY) != 0;
  unit.bytes.assign(s.packet->data, s.packet->data + s.packet->size);
  av_packet_unref(s.packet.get());
  if (unit.key) s.codec_string = find_codec_string(unit.bytes);
  return unit;
}

const std::string& H264Encoder::codec_string() const { return state_->codec_string; }

}  // namespace lumigraft::server
