#pragma once
// Counters and timings of the service, for /metrics, for `stats` once a second, and for the log. Thread-safe.
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace lumigraft::server {

/// Times of one stage over the last interval.
struct StageSummary {
  double mean_ms = 0, p95_ms = 0, max_ms = 0;
  std::uint64_t count = 0;
};

class Metrics {
 public:
  /// Upper bounds of the histogram's buckets in seconds; one more bucket holds larger values.
  static constexpr std::array<double, 12> kBuckets_s{0.001, 0.002, 0.005, 0.01, 0.02, 0.05,
                                                     0.1,   0.2,   0.5,   1.0,  2.0,  5.0};

  void time(const std::string& stage, double seconds);
  void drop(const std::string& slow_stage, std::uint64_t count = 1);
  /// The relight stage finished a frame. `grafted` false: an object should be shown, but the camera image passed
  /// through.
  void frame_made(bool grafted = true);
  /// The pose stage looked for the pose of a new camera frame. `rests`: nobody watches, so that not every such frame
  /// becomes a picture.
  void frame_posed(bool rests);
  void warn(std::uint64_t count);  ///< warnings attached to frames
  void encoded(const std::string& codec, std::size_t bytes);
  void viewers(int count) { viewers_ = count; }
  int viewers() const { return viewers_; }
  void refused_connection();
  /// Records the newest value chosen for a key of the plan or for an update interval, and the fraction of light that it
  /// omits.
  void decided(const std::string& key, int value, double left_out = 0);
  /// Bricks of the distance field, their memory, and bricks evicted so far.
  void fused(std::size_t bricks, std::size_t bytes, std::size_t evicted);
  /// The room was written to the disk.
  void kept(std::uintmax_t bytes) { kept_bytes_ = bytes; }
  /// A picture was written to the media server; whether there is a connection to it.
  void published() { ++published_; }
  void publish_connected(bool connected) { publish_connected_ = connected; }
  void cameras_with_faults(int count) { cameras_with_faults_ = count; }

  std::uint64_t frames() const;
  double age_of_last_frame_s() const;  ///< negative before the first
  double age_of_last_pose_s() const;   ///< since frame_posed; negative before the first
  double since_rest_s() const;         ///< since it last rested: 0 while it does; negative if it never did
  bool rests() const;
  double not_grafted_s() const;  ///< since when no frame was grafted, or since the start
  std::map<std::string, std::uint64_t> drops() const;

  struct Interval {
    double seconds = 0;
    std::uint64_t frames = 0;
    std::map<std::string, StageSummary> stages;
  };
  /// Values since the previous call.
  Interval take_interval();

  std::string prometheus() const;  ///< text format 0.0.4

 private:
  struct Stage {
    std::array<std::uint64_t, kBuckets_s.size() + 1> buckets{};
    double sum_s = 0;
    std::vector<float> interval_ms;
  };
  using Clock = std::chrono::steady_clock;

  mutable std::mutex mutex_;
  std::map<std::string, Stage> stages_;
  std::map<std::string, std::uint64_t> drops_;
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> encoded_;  ///< frames, bytes
  std::map<std::string, std::pair<int, double>> decided_;
  std::uint64_t frames_ = 0, warnings_ = 0, refused_ = 0;
  std::uint64_t interval_frames_ = 0;
  Clock::time_point last_frame_{}, last_grafted_ = Clock::now(), interval_start_ = Clock::now();
  std::optional<Clock::time_point> last_posed_, last_rested_;
  bool rests_ = false;
  std::atomic<std::size_t> bricks_ = 0, brick_bytes_ = 0, evicted_bricks_ = 0;
  std::atomic<std::uintmax_t> kept_bytes_ = 0;
  std::atomic<std::uint64_t> published_ = 0;
  std::atomic<bool> publish_connected_ = false;
  std::atomic<int> viewers_ = 0;
  std::atomic<int> cameras_with_faults_ = 0;
};

/// Times a stage from construction to destruction.
class StageTimer {
 public:
  StageTimer(Metrics& metrics, std::string stage) : metrics_(metrics), stage_(std::move(stage)) {}
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;
  ~StageTimer() { metrics_.time(stage_, elapsed_s()); }
  double elapsed_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  Metrics& metrics_;
  std::string stage_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace lumigraft::server
