#include "server/record.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <exception>
#include <mutex>
#include <set>
#include <thread>

#include "capture/error.h"
#include "capture/pairing_reader.h"
#include "capture/session_recorder.h"

namespace lumigraft {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kTick{50};

/// From the thread that hears a camera to the one that writes its pictures, so that a disk that stalls for a second
/// costs a live camera nothing. A recording waits where it is full.
class Lane {
 public:
  static constexpr std::size_t kMost = 64;

  void put(SourceItem item, bool live) {
    std::unique_lock lock(mutex_);
    if (live && waiting_.size() >= kMost) {
      ++lost;
      return;
    }
    changed_.wait(lock, [this] { return waiting_.size() < kMost || closed_; });
    waiting_.push_back(std::move(item));
    changed_.notify_all();
  }
  /// Empty: closed, and all was taken.
  std::optional<SourceItem> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !waiting_.empty() || closed_; });
    if (waiting_.empty()) {
      return std::nullopt;
    }
    SourceItem item = std::move(waiting_.front());
    waiting_.pop_front();
    changed_.notify_all();
    return item;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

  // Of the reading thread, until it has ended:
  std::optional<std::int64_t> first_time_ns;
  std::uint64_t next_sequence = 0;
  std::uint64_t lost = 0;
  bool over = false;  ///< its seconds are
  // Of the writing thread, until it has ended:
  std::uint64_t unusable = 0;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SourceItem> waiting_;
  bool closed_ = false;
};

class Recording {
 public:
  Recording(const RecordCommand& command, const ServiceInput& input)
      : sources_(open_sources(input.session)),
        recorder_(input.session_text, input.session, command.out),
        seconds_(command.seconds) {
    for (const auto& source : {sources_.color, sources_.depth, sources_.fisheye}) {
      if (source) {
        distinct_.insert(source.get());
      }
    }
    used_ = {true, sources_.depth != nullptr, sources_.fisheye != nullptr};
  }

  void run(const std::atomic<bool>& interrupted) {
    std::vector<std::jthread> writers, readers;
    for (std::size_t stream = 0; stream < lanes_.size(); ++stream) {
      writers.emplace_back([this, stream] { write(static_cast<Stream>(stream)); });
    }
    reading_ = static_cast<int>(distinct_.size());
    for (Source* source : distinct_) {
      readers.emplace_back([this, source] { read(*source); });
    }
    // A live camera that gives nothing never reaches the end of its seconds.
    constexpr std::chrono::seconds kGrace{2};
    const bool limited = sources_.live && seconds_;
    const Clock::time_point deadline =
        Clock::now() + kGrace +
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds_.value_or(0)));
    while (reading_ > 0 && !interrupted && !stop_ && (!limited || Clock::now() < deadline)) {
      say_troubles();
      std::this_thread::sleep_for(kTick);
    }
    stop_ = true;
    close_lanes_after(readers);
    writers.clear();
    if (failure_) {
      std::rethrow_exception(failure_);
    }
  }

  void report(std::ostream& out, const std::filesystem::path& folder) const {
    out << "recorded to " << folder.string() << ":\n";
    for (std::size_t stream = 0; stream < lanes_.size(); ++stream) {
      if (used_[stream]) {
        const Lane& lane = lanes_[stream];
        out << "  " << name_of(static_cast<Stream>(stream)) << ": " << recorder_.pictures(static_cast<Stream>(stream))
            << " pictures";
        if (lane.lost > 0) {
          out << ", " << lane.lost << " lost";
        }
        if (lane.unusable > 0) {
          out << ", " << lane.unusable << " whose time does not go on left out";
        }
        out << '\n';
      }
    }
  }

  std::uint64_t pictures() const { return recorder_.pictures(Stream::color); }

 private:
  /// A camera's trouble once it begins.
  void say_troubles() {
    std::set<std::string> now;
    for (const Source* source : distinct_) {
      now.insert(source->trouble());
    }
    now.erase("");
    for (const std::string& trouble : now) {
      if (said_.count(trouble) == 0) {
        std::fprintf(stderr, "lumigraft: %s\n", trouble.c_str());
      }
    }
    said_ = std::move(now);
  }
  void close_lanes_after(std::vector<std::jthread>& readers) {
    if (failure()) {
      close_lanes();  // nobody takes from them any more
    }
    readers.clear();
    close_lanes();
  }
  void close_lanes() {
    for (Lane& lane : lanes_) {
      lane.close();
    }
  }
  bool failure() {
    const std::lock_guard lock(mutex_);
    return failure_ != nullptr;
  }
  void fail() {
    {
      const std::lock_guard lock(mutex_);
      failure_ = failure_ ? failure_ : std::current_exception();
    }
    stop_ = true;
    close_lanes();
  }

  /// True where the picture still lies within the seconds that were asked for.
  bool within(Lane& lane, std::int64_t time_ns) const {
    lane.first_time_ns = lane.first_time_ns.value_or(time_ns);
    lane.over = lane.over || (seconds_ && static_cast<double>(time_ns - *lane.first_time_ns) >= 1e9 * *seconds_);
    return !lane.over;
  }

  /// True once every stream of this source has had its seconds.
  bool all_over(const Source& source) const {
    const auto over = [&](const std::shared_ptr<Source>& s, Stream stream) {
      return s.get() != &source || lanes_[static_cast<std::size_t>(stream)].over;
    };
    return over(sources_.color, Stream::color) && over(sources_.depth, Stream::depth) &&
           over(sources_.fisheye, Stream::fisheye);
  }

  void read(Source& source) {
    try {
      while (!stop_ && !source.finished() && !all_over(source)) {
        std::optional<SourceItem> item = source.next(kTick);
        if (!item) {
          continue;
        }
        const Stamp arrival = stamp_of(*item);
        Lane& lane = lanes_[static_cast<std::size_t>(stream_of(*item))];
        if (!within(lane, arrival.time_ns)) {
          continue;
        }
        if (arrival.sequence > lane.next_sequence) {
          lane.lost += arrival.sequence - lane.next_sequence;
        }
        lane.next_sequence = arrival.sequence + 1;
        if (std::holds_alternative<LostPicture>(*item)) {
          ++lane.lost;
        } else {
          lane.put(std::move(*item), sources_.live);
        }
      }
    } catch (...) {
      fail();
    }
    --reading_;
  }

  void write(Stream stream) {
    Lane& lane = lanes_[static_cast<std::size_t>(stream)];
    try {
      while (const std::optional<SourceItem> item = lane.take()) {
        lane.unusable += recorder_.write(stream, *item) ? 0 : 1;
      }
    } catch (...) {
      fail();
    }
  }

  PairedSources sources_;
  SessionRecorder recorder_;
  std::optional<double> seconds_;
  std::set<Source*> distinct_;
  std::set<std::string> said_;
  std::array<bool, 3> used_{};
  std::array<Lane, 3> lanes_;
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
  if (recording.pictures() == 0) {
    throw std::runtime_error("no colour picture came: " + command.out.string() + " cannot be replayed");
  }
}

}  // namespace lumigraft
