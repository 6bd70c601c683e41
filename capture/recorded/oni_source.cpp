#include "capture/recorded/oni_source.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <span>

#include "capture/descriptor.h"
#include "capture/error.h"
#include "capture/live/helper_process.h"
#include "capture/message_text.h"
#include "capture/recorded/oni_messages.h"
#include "capture/recorded/parameters.h"

namespace lumigraft::capture {
namespace {

using Bytes = std::span<std::uint8_t>;

/// A pipe: this process reads, the helper writes.
struct Pipe {
  Descriptor read_end, write_end;
};

Pipe open_pipe() {
  int ends[2];
  refuse_if(pipe2(ends, O_CLOEXEC) != 0, std::string("found no pipe to read it through: ") + std::strerror(errno));
  fcntl(ends[0], F_SETPIPE_SZ, kRecordedParameters.oni_pipe_bytes);  // if not permitted, it is only slower
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

std::vector<std::string> helper_arguments(const std::string& file, const std::vector<StreamSpec>& specs) {
  std::vector<std::string> arguments = {file};
  for (const StreamSpec& spec : specs) {
    arguments.insert(arguments.end(), {spec.stream == Stream::depth ? "depth" : "color", std::to_string(spec.width),
                                       std::to_string(spec.height), formatted("%.17g", spec.unit_m)});
  }
  return arguments;
}

}  // namespace

/// One pass over the recording. The constructor throws InputError with the reason alone.
class OniSource::Reader {
 public:
  Reader(const std::string& file, const std::vector<StreamSpec>& specs)
      : specs_(specs), process_("lumigraft_oni", helper_arguments(file, specs), pipe_.write_end.number(), kOniPipe) {
    pipe_.write_end = Descriptor();  // so that reading ends with the helper
    OniMessage opened;
    if (!receive({reinterpret_cast<std::uint8_t*>(&opened), sizeof opened})) {
      throw InputError(file + ": found a recording that crashes OpenNI2: " + exit_reason());
    }
    if (opened.kind != OniMessage::Kind::opened) {
      opened.text.back() = '\0';
      throw InputError(opened.text.data());
    }
  }

  std::optional<SourceItem> next() {
    OniMessage message;
    if (finished_ || !receive({reinterpret_cast<std::uint8_t*>(&message), sizeof message}) ||
        message.stream >= specs_.size()) {
      return ended();
    }
    const StreamSpec& spec = specs_[message.stream];
    last_ = {message.time_ns, steady_now_ns(), message.sequence};
    last_stream_ = spec.stream;
    if (message.kind != OniMessage::Kind::frame) {
      message.text.back() = '\0';
      return LostFrame{last_, spec.stream, message.text.data()};
    }
    if (spec.stream == Stream::depth) {
      RawDepth depth{last_, Image<std::uint16_t>(spec.width, spec.height, 1)};
      const Bytes bytes(reinterpret_cast<std::uint8_t*>(depth.counts.data.data()), 2 * depth.counts.data.size());
      return receive(bytes) ? std::optional<SourceItem>(std::move(depth)) : ended();
    }
    Frame frame{.stamp = last_, .stream = spec.stream, .exposure = spec.exposure};
    frame.encoded = Image<std::uint8_t>(spec.width, spec.height, 3);
    return receive(frame.encoded.data) ? std::optional<SourceItem>(std::move(frame)) : ended();
  }

  bool finished() const { return finished_; }
  const std::string& fault() const { return fault_; }

 private:
  /// Fills `bytes`; false if the helper has ended or does not answer.
  bool receive(Bytes bytes) {
    while (!bytes.empty()) {
      pollfd waiting{pipe_.read_end.number(), POLLIN, 0};
      const int ready = poll(&waiting, 1, static_cast<int>(kRecordedParameters.oni_timeout.count()));
      if (ready < 0 && errno == EINTR) continue;
      silent_ = ready == 0;
      const ssize_t got = ready > 0 ? read(waiting.fd, bytes.data(), bytes.size()) : 0;
      if (got <= 0) return false;
      bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
    return true;
  }

  std::string exit_reason() { return silent_ ? "it does not answer" : process_.exit_reason(); }

  std::optional<SourceItem> ended() {
    if (finished_) return std::nullopt;
    finished_ = true;
    const std::string why = exit_reason();
    if (why.empty()) return std::nullopt;
    fault_ = "OpenNI2 crashes while reading the rest of the recording: " + why;
    return LostFrame{{last_.time_ns, steady_now_ns(), last_.sequence + 1}, last_stream_, fault_};
  }

  std::vector<StreamSpec> specs_;
  Pipe pipe_ = open_pipe();
  HelperProcess process_;
  Stamp last_;
  Stream last_stream_ = Stream::color;
  bool silent_ = false, finished_ = false;
  std::string fault_;
};

OniSource::OniSource(std::string file, std::vector<StreamSpec> specs)
    : file_(std::move(file)), specs_(std::move(specs)), reader_(std::make_unique<Reader>(file_, specs_)) {}

OniSource::~OniSource() = default;

std::optional<SourceItem> OniSource::next(std::chrono::milliseconds) {
  return reader_ == nullptr ? std::nullopt : reader_->next();
}

bool OniSource::finished() const { return reader_ == nullptr || reader_->finished(); }

void OniSource::rewind() {
  reader_.reset();
  try {
    reader_ = std::make_unique<Reader>(file_, specs_);
  } catch (const InputError&) {
    // The file does not exist any more: finished().
  }
}

std::string OniSource::fault() const { return reader_ == nullptr ? "" : reader_->fault(); }

}  // namespace lumigraft::capture
