#include "server/stream/encode_stage.h"

#include <algorithm>
#include <string>

#include "server/stream/halve.h"
#include "server/stream/parameters.h"

namespace lumigraft::server {
namespace {

std::span<const std::uint8_t> bytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::shared_ptr<const StreamMessage> message(const ShownFrame& frame, StreamSize size, StreamKind kind,
                                             std::span<const std::uint8_t> payload) {
  StreamHeader header;
  header.kind = kind;
  header.flags = frame.passed_through ? StreamHeader::kPassedThrough : 0;
  header.sequence = frame.sequence;
  header.width = static_cast<std::uint16_t>(kind == StreamKind::jpeg ? frame.srgb->width : frame.srgb->width & ~1);
  header.height = static_cast<std::uint16_t>(kind == StreamKind::jpeg ? frame.srgb->height : frame.srgb->height & ~1);
  header.capture_time_ns = unix_time_ns(frame.captured);
  header.send_time_ns = unix_time_ns(std::chrono::steady_clock::now());
  return make_stream_message(header, payload, size, frame.captured);
}

}  // namespace

EncodeStage::EncodeStage(int jpeg_quality, EncoderDemand& demand, Metrics& metrics)
    : demand_(demand), metrics_(metrics), jpeg_(jpeg_quality) {}

void EncodeStage::prepare(H264Stream& stream, const ShownFrame& frame, int rate_kbit_s, Clock::time_point now) {
  if (stream.last_encoded != Clock::time_point{}) stream.period.add(now - stream.last_encoded);
  stream.last_encoded = now;
  std::optional<H264Encoder::Bound> bound;
  if (rate_kbit_s > 0) {
    const double period_s = std::clamp(std::chrono::duration<double>(stream.period.usual()).count(),
                                       kStream.shortest_period_s, kStream.longest_period_s);
    bound = {1e3 * rate_kbit_s * period_s, 1e3 * rate_kbit_s * kStream.burst_s};
  }
  const bool other = frame.srgb->width != stream.width || frame.srgb->height != stream.height;
  if (!stream.encoder || other || stream.bounded != bound.has_value()) {
    stream.width = frame.srgb->width;
    stream.height = frame.srgb->height;
    stream.bounded = bound.has_value();
    stream.encoder.emplace(stream.width, stream.height, bound);
  } else if (bound) {
    stream.encoder->change_bound(*bound);
  }
}

void EncodeStage::encode_h264(const ShownFrame& frame, StreamSize size, Messages& out) {
  const StageTimer timer(metrics_, "encode h264");
  const Clock::time_point now = Clock::now();
  H264Stream& stream = h264_[static_cast<std::size_t>(size)];
  SizeDemand& demand = demand_.of(size);
  try {
    prepare(stream, frame, demand.rate_kbit_s, now);
    bool key = false;
    if (demand.key && now - stream.last_asked_key >= kStream.keys_apart) {
      demand.key = false;
      key = true;
      stream.last_asked_key = now;
    }
    const H264Encoder::AccessUnit unit = stream.encoder->encode(*frame.srgb, now.time_since_epoch().count(), key);
    if (unit.key && stream.encoder->codec_string() != stream.codec_string) {
      stream.codec_string = stream.encoder->codec_string();
      out.push_back(message(frame, size, StreamKind::config, bytes(stream.codec_string)));
    }
    out.push_back(message(frame, size, unit.key ? StreamKind::h264_key : StreamKind::h264_delta, unit.bytes));
    metrics_.encoded(size == StreamSize::half ? "h264 half" : "h264", unit.bytes.size());
  } catch (...) {
    stream.encoder.reset();
    throw;
  }
}

void EncodeStage::encode_size(const ShownFrame& frame, StreamSize size, Messages& out) {
  const SizeDemand& demand = demand_.of(size);
  if (demand.jpeg > 0) {
    const StageTimer timer(metrics_, "encode jpeg");
    const std::vector<std::uint8_t> file = jpeg_.encode(*frame.srgb);
    metrics_.encoded(size == StreamSize::half ? "jpeg half" : "jpeg", file.size());
    out.push_back(message(frame, size, StreamKind::jpeg, file));
  }
  if (demand.h264 > demand.h264_busy || (size == StreamSize::full && demand_.publishing)) encode_h264(frame, size, out);
}

std::vector<std::shared_ptr<const StreamMessage>> EncodeStage::encode(const ShownFrame& frame) {
  Messages out;
  encode_size(frame, StreamSize::full, out);
  if (demand_.half.jpeg > 0 || demand_.half.h264 > demand_.half.h264_busy) {
    ShownFrame half = frame;
    half.srgb = std::make_shared<const capture::Image<std::uint8_t>>(halved(*frame.srgb));
    encode_size(half, StreamSize::half, out);
  }
  return out;
}

std::int64_t unix_time_ns(std::chrono::steady_clock::time_point moment) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now - (std::chrono::steady_clock::now() - moment))
      .count();
}

}  // namespace lumigraft::server
