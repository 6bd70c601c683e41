#pragma once
// Queues between the threads that receive frames and the threads that write them, one lane per stream, so that a live
// camera loses nothing while the disk stalls for a second.
#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "capture/record/session_recorder.h"

namespace lumigraft::capture {

class RecordingLanes {
 public:
  struct Count {
    std::uint64_t frames = 0;    ///< written
    std::uint64_t lost = 0;      ///< lost by the camera, or because the disk was too slow
    std::uint64_t unusable = 0;  ///< not written: time does not increase, or another format than the first frame
  };

  /// Throws as SessionRecorder. With `background` the writers run at low priority while a live picture is rendered, and
  /// depth stays uncompressed until compress_depth, because FFV1 takes up to a third of a core.
  RecordingLanes(const SessionText& text, const Session& session, const std::filesystem::path& folder, bool background);
  ~RecordingLanes() { finish(); }

  /// Called by one thread per stream. If the queue is full, a live frame is lost and a recorded frame waits.
  void put(SourceItem item, bool live);
  /// Returns when everything was written, or after a failure.
  void finish();
  /// After finish(): SessionRecorder::compress_depth at the lowest priority.
  void compress_depth(const std::stop_token& stop);
  /// Why writing has ended; null if it has not failed.
  std::exception_ptr failure() const;
  Count count(Stream stream) const;

 private:
  struct Lane {
    mutable std::mutex mutex;
    std::condition_variable changed;
    std::deque<SourceItem> waiting;
    bool closed = false;
    Count count;
    std::optional<std::uint64_t> next_sequence;
  };

  std::optional<SourceItem> take(Lane& lane) const;
  void write(Stream stream, bool background);
  void close();

  SessionRecorder recorder_;
  std::array<Lane, 3> lanes_;  ///< by Stream
  mutable std::mutex mutex_;
  std::exception_ptr failure_;
  std::array<std::jthread, 3> writers_;
};

}  // namespace lumigraft::capture
