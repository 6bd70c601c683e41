#include "server/stream/encode_stage.h"

#include <string>

#include "server/stream/parameters.h"

namespace lumigraft::server {
namespace {

using Clock = std::chrono::steady_clock;

std::span<const std::uint8_t> bytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

EncodeStage::EncodeStage(int jpeg_quality, EncoderDemand& demand, Metrics& metrics)
    : demand_(demand), metrics_(metrics), jpeg_(jpeg_quality) {}

std::shared_ptr<const StreamMessage> EncodeStage::message(const ShownFrame& frame, StreamKind kind,
                                                          std::span<const std::uint8_t> payload) const {
  StreamHeader header;
  header.kind = kind;
  header.flags = frame.passed_through ? StreamHeader::kPassedThrough : 0;
  header.sequence = frame.sequence;
  header.width = static_cast<std::uint16_t>(kind == StreamKind::jpeg ? frame.srgb->width : frame.srgb->width & ~1);
  header.height = static_cast<std::uint16_t>(kind == StreamKind::jpeg ? frame.srgb->height : frame.srgb->height & ~1);
  header.capture_time_ns = unix_time_ns(frame.captured);
  header.send_time_ns = unix_time_ns(Clock::now());
  return make_stream_message(header, payload);
}

void EncodeStage::encode_h264(const ShownFrame& frame, std::vector<std::shared_ptr<const StreamMessage>>& out) {
  const StageTimer timer(metrics_, "encode h264");
  const Clock::time_point now = Clock::now();
  if (!h264_ || frame.srgb->width != width_ || frame.srgb->height != height_) {
    width_ = frame.srgb->width;
    height_ = frame.srgb->height;
    h264_.emplace(width_, height_);
  }
  bool key = false;
  if (demand_.key && now - last_asked_key_ >= kStream.keys_apart) {
    demand_.key = false;
    key = true;
    last_asked_key_ = now;
  }
  try {
    const H264Encoder::AccessUnit unit = h264_->encode(*frame.srgb, now.time_since_epoch().count(), key);
    if (unit.key && h264_->codec_string() != codec_string_) {
      codec_string_ = h264_->codec_string();
      out.push_back(message(frame, StreamKind::config, bytes(codec_string_)));
    }
    out.push_back(message(frame, unit.key ? StreamKind::h264_key : StreamKind::h264_delta, unit.bytes));
    metrics_.encoded("h264", unit.bytes.size());
  } catch (...) {
    h264_.reset();
    throw;
  }
}

std::vector<std::shared_ptr<const StreamMessage>> EncodeStage::encode(const ShownFrame& frame) {
  std::vector<std::shared_ptr<const StreamMessage>> out;
  if (demand_.jpeg > 0) {
    const StageTimer timer(metrics_, "encode jpeg");
    const std::vector<std::uint8_t> file = jpeg_.encode(*frame.srgb);
    metrics_.encoded("jpeg", file.size());
    out.push_back(message(frame, StreamKind::jpeg, file));
  }
  if (demand_.wants_h264()) encode_h264(frame, out);
  return out;
}

std::int64_t unix_time_ns(Clock::time_point moment) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now - (Clock::now() - moment)).count();
}

}  // namespace lumigraft::server
