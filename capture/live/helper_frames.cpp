#include "capture/live/helper_frames.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "capture/error.h"
#include "capture/live/parameters.h"
#include "capture/message_text.h"

namespace lumigraft::capture {
namespace {

std::vector<std::string> with_streams(std::vector<std::string> words, const std::vector<StreamSpec>& specs) {
  for (const StreamSpec& spec : specs) {
    const bool depth = spec.stream == Stream::depth;
    words.insert(words.end(), {depth                          ? spec.registered ? "registered-depth" : "depth"
                               : spec.stream == Stream::color ? "color"
                                                              : "fisheye",
                               std::to_string(spec.width), std::to_string(spec.height),
                               depth ? formatted("%.17g", spec.unit_m) : "0"});
  }
  return words;
}

}  // namespace

HelperFrames::Pipe HelperFrames::open_pipe() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw CameraFault(std::string("found no pipe for it: ") + std::strerror(errno));
  fcntl(ends[0], F_SETPIPE_SZ, kHelperParameters.pipe_bytes);  // if not permitted, it is only slower
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

HelperFrames::HelperFrames(const std::string& program, std::vector<std::string> arguments,
                           const std::vector<StreamSpec>& specs, std::chrono::milliseconds patience)
    : specs_(specs),
      patience_(patience),
      pipe_(open_pipe()),
      process_(program.c_str(), with_streams(std::move(arguments), specs), pipe_.write_end.number(), kHelperPipe) {
  pipe_.write_end = Descriptor();  // so that reading ends with the helper
  for (const StreamSpec& spec : specs) exposures_.emplace_back(spec);
  const auto first = receive_message(patience);
  if (!first && !ended_) throw CameraFault("its helper does not answer");
  const std::string text = first ? receive_text(*first) : "";
  if (ended_) throw CameraFault(end_reason_.empty() ? "its helper ended without an answer" : end_reason_);
  if (first->kind == HelperMessage::Kind::unavailable) throw CameraFault(text);
  refuse_if(first->kind != HelperMessage::Kind::opened, text);
  serial_ = text;
}

std::optional<SourceItem> HelperFrames::next(std::chrono::milliseconds timeout) {
  const auto message = receive_message(timeout);
  if (!message) return std::nullopt;
  if (message->kind == HelperMessage::Kind::unavailable || message->kind == HelperMessage::Kind::refused) {
    const std::string why = receive_text(*message);
    if (!ended_) end(why);
    return std::nullopt;
  }
  if (message->kind == HelperMessage::Kind::opened || message->stream >= specs_.size()) {
    end("its helper sent a message that is not allowed now, or of a stream that was not requested");
    return std::nullopt;
  }
  const Stamp stamp{message->time_ns, steady_now_ns(), message->sequence};
  if (message->kind == HelperMessage::Kind::frame) return receive_frame(*message, stamp);
  std::string why = receive_text(*message);
  return ended_ ? std::nullopt
                : std::optional<SourceItem>(LostFrame{stamp, specs_[message->stream].stream, std::move(why)});
}

std::string HelperFrames::take_warning() {
  for (ReportedExposure& exposure : exposures_) {
    if (std::string warning = exposure.take_warning(); !warning.empty()) return warning;
  }
  return {};
}

std::optional<SourceItem> HelperFrames::receive_frame(const HelperMessage& message, const Stamp& stamp) {
  const StreamSpec& spec = specs_[message.stream];
  const bool is_depth = spec.stream == Stream::depth;
  const std::size_t pixels = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
  if (const std::size_t bytes = pixels * (is_depth ? 2 : 3); message.bytes != bytes) {
    end(formatted("its helper sent a %s frame of %u bytes, allowed: %zu, for %s", name_of(spec.stream), message.bytes,
                  bytes, size_text(spec.width, spec.height).c_str()));
    return std::nullopt;
  }
  if (is_depth) {
    RawDepth depth{stamp, Image<std::uint16_t>(spec.width, spec.height, 1)};
    if (!receive({reinterpret_cast<std::uint8_t*>(depth.counts.data.data()), message.bytes})) return std::nullopt;
    return depth;
  }
  const auto reported = [](double number) { return number != 0.0 ? std::optional(number) : std::nullopt; };
  Frame frame{.stamp = stamp,
              .stream = spec.stream,
              .exposure = exposures_[message.stream].of_frame({reported(message.exposure_us), reported(message.gain)}),
              .encoded = Image<std::uint8_t>(spec.width, spec.height, 3)};
  if (!receive(frame.encoded.data)) return std::nullopt;
  return frame;
}

/// Empty: the timeout is over, or the helper has ended.
std::optional<HelperMessage> HelperFrames::receive_message(std::chrono::milliseconds timeout) {
  pollfd waiting{pipe_.read_end.number(), POLLIN, 0};
  if (ended_ || poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return std::nullopt;
  HelperMessage message;
  if (!receive({reinterpret_cast<std::uint8_t*>(&message), sizeof message})) return std::nullopt;
  if (message.mark != kHelperMark || message.kind > HelperMessage::Kind::lost) {
    end("its helper sent no message of version 1");
    return std::nullopt;
  }
  return message;
}

/// Fills `bytes`; false if the helper has ended or does not go on.
bool HelperFrames::receive(std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    pollfd waiting{pipe_.read_end.number(), POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(patience_.count()));
    if (ready < 0 && errno == EINTR) continue;
    const ssize_t got = ready > 0 ? read(waiting.fd, bytes.data(), bytes.size()) : 0;
    if (got <= 0) {
      end(ready == 0 ? "its helper does not answer" : process_.exit_reason());
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

/// The text after a message; empty if the helper has ended.
std::string HelperFrames::receive_text(const HelperMessage& message) {
  if (message.bytes > kHelperParameters.max_text_bytes) {
    end(formatted("its helper sent a text of %u bytes, allowed: %u", message.bytes, kHelperParameters.max_text_bytes));
    return {};
  }
  std::string text(message.bytes, '\0');
  return receive({reinterpret_cast<std::uint8_t*>(text.data()), text.size()}) ? on_one_line(text) : "";
}

void HelperFrames::end(const std::string& why) {
  ended_ = true;
  end_reason_ = why;
}

}  // namespace lumigraft::capture
