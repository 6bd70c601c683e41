#include "server/commands/record.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <mutex>
#include <set>
#include <thread>

#include "capture/record/recording_lanes.h"
#include "capture/sync/pairing_reader.h"
#include "server/commands/parameters.h"

namespace lumigraft::server {
namespace {

using Clock = std::chrono::steady_clock;

/// Time span of a stream in its own time.
struct Span {
  std::optional<std::int64_t> first_time_ns;
  bool over = false;
};

class Recording {
 public:
  Recording(const RecordCommand& command, const ServiceInput& input)
      : sources_(capture::open_sources(input.session)),
        lanes_(input.session_text, named(input.session, sources_), command.out, false),
        seconds_(command.seconds),
        by_stream_{sources_.color.get(), sources_.depth.get(), sources_.fisheye.get()},
        distinct_(by_stream_.begin(), by_stream_.end()) {
    distinct_.erase(nullptr);
  }

  void run(const std::atomic<bool>& interrupted) {
    std::vector<std::jthread> readers;
    reading_ = static_cast<int>(distinct_.size());
    for (capture::Source* source : distinct_) {
      readers.emplace_back([this, source] { read(*source); });
    }
    const bool limited = sources_.live && seconds_;
    const Clock::time_point deadline =
        Clock::now() + kCommands.grace +
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds_.value_or(0)));
    while (reading_ > 0 && !interrupted && !stop_ && !lanes_.failure() && (!limited || Clock::now() < deadline)) {
      print_faults();
      std::this_thread::sleep_for(kCommands.tick);
    }
    stop_ = true;
    if (lanes_.failure()) lanes_.finish();  // a reader may be waiting for space in a queue
    readers.clear();
    print_faults();
    lanes_.finish();
    for (const std::exception_ptr& failure : {failure_, lanes_.failure()}) {
      if (failure) std::rethrow_exception(failure);
    }
  }

  void report(std::ostream& out, const std::filesystem::path& folder) const {
    out << "recorded to " << folder.string() << ":\n";
    for (const capture::Stream stream : capture::kStreams) {
      if (by_stream_[static_cast<std::size_t>(stream)] != nullptr) {
        const capture::RecordingLanes::Count count = lanes_.count(stream);
        out << "  " << name_of(stream) << ": " << count.frames << " pictures";
        if (count.lost > 0) out << ", " << count.lost << " lost";
        if (count.unusable > 0) out << ", " << count.unusable << " with times that do not increase omitted";
        out << '\n';
      }
    }
  }

  std::uint64_t frames() const { return lanes_.count(capture::Stream::color).frames; }

 private:
  static capture::Session named(capture::Session session, const capture::PairedSources& sources) {
    capture::take_serials(session, sources);
    return session;
  }
  /// Reports a camera's fault once when it begins.
  void print_faults() {
    std::set<std::string> now;
    for (const capture::Source* source : distinct_) now.insert(source->fault());
    now.erase("");
    for (const std::string& fault : now) {
      if (said_.count(fault) == 0) std::fprintf(stderr, "lumigraft: %s\n", fault.c_str());
    }
    said_ = std::move(now);
  }
  /// Whether the picture lies within the requested duration.
  bool within(Span& span, std::int64_t time_ns) const {
    span.first_time_ns = span.first_time_ns.value_or(time_ns);
    span.over = span.over || (seconds_ && static_cast<double>(time_ns - *span.first_time_ns) >= 1e9 * *seconds_);
    return !span.over;
  }

  /// Whether every stream of this source has reached the requested duration.
  bool all_over(const capture::Source& source) const {
    return std::ranges::all_of(capture::kStreams, [&](capture::Stream stream) {
      const auto i = static_cast<std::size_t>(stream);
      return by_stream_[i] != &source || spans_[i].over;
    });
  }

  void read(capture::Source& source) {
    try {
      while (!stop_ && !source.finished() && !all_over(source)) {
        std::optional<capture::SourceItem> item = source.next(kCommands.tick);
        if (!item) continue;
        Span& span = spans_[static_cast<std::size_t>(capture::stream_of(*item))];
        if (within(span, capture::stamp_of(*item).time_ns)) lanes_.put(std::move(*item), sources_.live);
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = failure_ ? failure_ : std::current_exception();
      stop_ = true;
    }
    --reading_;
  }

  capture::PairedSources sources_;
  capture::RecordingLanes lanes_;
  std::optional<double> seconds_;
  std::array<capture::Source*, 3> by_stream_;  ///< null for streams that the session does not have
  std::set<capture::Source*> distinct_;
  std::set<std::string> said_;
  std::array<Span, 3> spans_;  ///< by Stream; each is used by one thread
  std::atomic<int> reading_ = 0;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;
  std::exception_ptr failure_;
};

}  // namespace

void run_record(const RecordCommand& command, const std::atomic<bool>& interrupted, std::ostream& report) {
  const ServiceInput input = read_service(command.files, interactive_plan());
  Recording recording(command, input);
  recording.run(interrupted);
  recording.report(report, command.out);
  if (recording.frames() == 0) {
    throw std::runtime_error("no colour picture came: " + command.out.string() + " cannot be replayed");
  }
}

}  // namespace lumigraft::server
