#pragma once
// From the threads that hear cameras to those that write their pictures, one a stream, so that a disk that stalls for a
// second costs a live camera nothing.
#include <array>
#include <atomic>
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
    std::uint64_t pictures = 0;  ///< written
    std::uint64_t lost = 0;      ///< by the camera, or since the disk was too slow
    std::uint64_t unusable = 0;  ///< whose time does not go on, or in another format
  };

  /// Throws as SessionRecorder. With `behind` the writers take the processor only when the picture leaves it, and depth
  /// stays uncompressed until compress_depth: FFV1 takes up to a third of a core, from the picture or the recording.
  RecordingLanes(const SessionText& text, const Session& session, const std::filesystem::path& folder, bool behind);
  ~RecordingLanes();

  /// Each stream from one thread. Where the lane is full a live picture is lost, a recorded one waits.
  void put(SourceItem item, bool live);
  /// Returns when all was written, or after a failure.
  void finish();
  /// After finish(), as SessionRecorder's, by a thread that takes what no other wants.
  void compress_depth(const std::stop_token& stop);
  /// Why nothing is written any more; null where all is well.
  std::exception_ptr failure() const;
  Count count(Stream stream) const;

 private:
  static constexpr std::size_t kMost = 64;

  struct Lane {
    mutable std::mutex mutex;
    std::condition_variable changed;
    std::deque<SourceItem> waiting;
    bool closed = false;
    Count count;
    std::optional<std::uint64_t> next_sequence;
  };

  std::optional<SourceItem> take(Lane& lane) const;
  void write(Stream stream, bool behind);
  void close();

  SessionRecorder recorder_;
  std::array<Lane, 3> lanes_;  ///< by Stream
  mutable std::mutex mutex_;
  std::exception_ptr failure_;
  std::array<std::jthread, 3> writers_;
};

}  // namespace lumigraft::capture
