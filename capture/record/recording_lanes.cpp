#include "capture/record/recording_lanes.h"

#include <utility>

#include "capture/live/thread_priority.h"
#include "capture/record/parameters.h"

namespace lumigraft::capture {

RecordingLanes::RecordingLanes(const SessionText& text, const Session& session, const std::filesystem::path& folder,
                               bool background)
    : recorder_(text, session, folder, background ? DepthCoding::uncompressed : DepthCoding::ffv1) {
  for (const Stream stream : kStreams) {
    writers_[static_cast<std::size_t>(stream)] =
        std::jthread([this, stream, background] { write(stream, background); });
  }
}

void RecordingLanes::put(SourceItem item, bool live) {
  Lane& lane = lanes_[static_cast<std::size_t>(stream_of(item))];
  const std::uint64_t sequence = stamp_of(item).sequence;
  constexpr std::size_t kMaxQueued = kRecordParameters.queue_frames;
  std::unique_lock lock(lane.mutex);
  if (lane.next_sequence && sequence > *lane.next_sequence) lane.count.lost += sequence - *lane.next_sequence;
  lane.next_sequence = sequence + 1;
  if (std::holds_alternative<LostFrame>(item) || (live && lane.waiting.size() >= kMaxQueued)) {
    ++lane.count.lost;
    return;
  }
  lane.changed.wait(lock, [&lane] { return lane.waiting.size() < kMaxQueued || lane.closed; });
  lane.waiting.push_back(std::move(item));
  lane.changed.notify_all();
}

/// Waits for an item. Empty: the lane is closed and empty, or writing has failed.
std::optional<SourceItem> RecordingLanes::take(Lane& lane) const {
  std::unique_lock lock(lane.mutex);
  lane.changed.wait(lock, [&lane] { return !lane.waiting.empty() || lane.closed; });
  if (lane.waiting.empty() || failure()) return std::nullopt;
  SourceItem item = std::move(lane.waiting.front());
  lane.waiting.pop_front();
  lane.changed.notify_all();
  return item;
}

void RecordingLanes::write(Stream stream, bool background) {
  std::optional<ThreadPriority> priority;
  if (background) priority.emplace(kRecordParameters.background_niceness);
  Lane& lane = lanes_[static_cast<std::size_t>(stream)];
  try {
    while (const std::optional<SourceItem> item = take(lane)) {
      const bool kept = recorder_.write(stream, *item);
      const std::lock_guard lock(lane.mutex);
      ++(kept ? lane.count.frames : lane.count.unusable);
    }
  } catch (...) {
    {
      const std::lock_guard lock(mutex_);
      failure_ = failure_ ? failure_ : std::current_exception();
    }
    close();
  }
}

void RecordingLanes::close() {
  for (Lane& lane : lanes_) {
    const std::lock_guard lock(lane.mutex);
    lane.closed = true;
    lane.changed.notify_all();
  }
}

void RecordingLanes::finish() {
  close();
  for (std::jthread& writer : writers_) {
    if (writer.joinable()) writer.join();
  }
}

void RecordingLanes::compress_depth(const std::stop_token& stop) {
  const ThreadPriority priority(kRecordParameters.compression_niceness);
  recorder_.compress_depth(stop);
}

std::exception_ptr RecordingLanes::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

RecordingLanes::Count RecordingLanes::count(Stream stream) const {
  const Lane& lane = lanes_[static_cast<std::size_t>(stream)];
  const std::lock_guard lock(lane.mutex);
  return lane.count;
}

}  // namespace lumigraft::capture
