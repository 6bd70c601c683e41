#include "server/metrics/metrics.h"

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <sstream>

namespace lumigraft::server {
namespace {

constexpr std::size_t kMaxInterval =
    4096;  // bound when take_interval() is not called for long: the older half is discarded

std::size_t resident_bytes() {
  std::ifstream in("/proc/self/statm");
  std::size_t pages = 0, resident = 0;
  in >> pages >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

StageSummary summarise(std::vector<float>& times_ms) {
  StageSummary s;
  s.count = times_ms.size();
  if (times_ms.empty()) return s;
  std::sort(times_ms.begin(), times_ms.end());
  for (const float t : times_ms) s.mean_ms += t;
  s.mean_ms /= static_cast<double>(times_ms.size());
  s.p95_ms = times_ms[(times_ms.size() - 1) * 95 / 100];
  s.max_ms = times_ms.back();
  return s;
}

}  // namespace

void Metrics::time(const std::string& stage, double seconds) {
  std::lock_guard lock(mutex_);
  Stage& s = stages_[stage];
  const auto bucket = std::lower_bound(kBuckets_s.begin(), kBuckets_s.end(), seconds) - kBuckets_s.begin();
  ++s.buckets[static_cast<std::size_t>(bucket)];
  s.sum_s += seconds;
  if (s.interval_ms.size() >= kMaxInterval) {
    s.interval_ms.erase(s.interval_ms.begin(), s.interval_ms.begin() + kMaxInterval / 2);
  }
  s.interval_ms.push_back(static_cast<float>(1e3 * seconds));
}

void Metrics::drop(const std::string& slow_stage, std::uint64_t count) {
  std::lock_guard lock(mutex_);
  drops_[slow_stage] += count;
}

void Metrics::frame_made(bool grafted) {
  std::lock_guard lock(mutex_);
  ++frames_;
  ++interval_frames_;
  last_frame_ = Clock::now();
  if (grafted) last_grafted_ = last_frame_;
}

void Metrics::frame_posed(bool rests) {
  std::lock_guard lock(mutex_);
  last_posed_ = Clock::now();
  if (rests || rests_) last_rested_ = last_posed_;  // it rested until now
  rests_ = rests;
}

void Metrics::warn(std::uint64_t count) {
  std::lock_guard lock(mutex_);
  warnings_ += count;
}

void Metrics::encoded(const std::string& codec, std::size_t bytes) {
  std::lock_guard lock(mutex_);
  ++encoded_[codec].first;
  encoded_[codec].second += bytes;
}

void Metrics::fused(std::size_t bricks, std::size_t bytes, std::size_t evicted) {
  bricks_ = bricks;
  brick_bytes_ = bytes;
  evicted_bricks_ = evicted;
}

void Metrics::refused_connection() {
  std::lock_guard lock(mutex_);
  ++refused_;
}

void Metrics::decided(const std::string& key, int value, double left_out) {
  std::lock_guard lock(mutex_);
  decided_[key] = {value, left_out};
}

std::uint64_t Metrics::frames() const {
  std::lock_guard lock(mutex_);
  return frames_;
}

double Metrics::age_of_last_frame_s() const {
  std::lock_guard lock(mutex_);
  return frames_ == 0 ? -1.0 : std::chrono::duration<double>(Clock::now() - last_frame_).count();
}

double Metrics::age_of_last_pose_s() const {
  std::lock_guard lock(mutex_);
  return last_posed_ ? std::chrono::duration<double>(Clock::now() - *last_posed_).count() : -1.0;
}

double Metrics::since_rest_s() const {
  std::lock_guard lock(mutex_);
  if (!last_rested_) return -1.0;
  return rests_ ? 0.0 : std::chrono::duration<double>(Clock::now() - *last_rested_).count();
}

bool Metrics::rests() const {
  std::lock_guard lock(mutex_);
  return rests_;
}

double Metrics::not_grafted_s() const {
  std::lock_guard lock(mutex_);
  return std::chrono::duration<double>(Clock::now() - last_grafted_).count();
}

std::map<std::string, std::uint64_t> Metrics::drops() const {
  std::lock_guard lock(mutex_);
  return drops_;
}

Metrics::Interval Metrics::take_interval() {
  std::lock_guard lock(mutex_);
  Interval interval;
  const Clock::time_point now = Clock::now();
  interval.seconds = std::chrono::duration<double>(now - interval_start_).count();
  interval.frames = interval_frames_;
  interval_start_ = now;
  interval_frames_ = 0;
  for (auto& [name, stage] : stages_) {
    if (!stage.interval_ms.empty()) {
      interval.stages[name] = summarise(stage.interval_ms);
      stage.interval_ms.clear();
    }
  }
  return interval;
}

std::string Metrics::prometheus() const {
  const double age_s = age_of_last_frame_s(), posed_s = age_of_last_pose_s(), not_grafted = not_grafted_s();
  std::lock_guard lock(mutex_);
  std::ostringstream out;
  const auto head = [&out](const char* name, const char* kind, const char* help) {
    out << "# HELP " << name << ' ' << help << "\n# TYPE " << name << ' ' << kind << '\n';
  };
  const auto one = [&](const char* name, const char* kind, const char* help, auto value) {
    head(name, kind, help);
    out << name << ' ' << value << '\n';
  };
  const auto each = [&](const char* name, const char* kind, const char* help, const char* label, const auto& values,
                        const auto& part) {
    head(name, kind, help);
    for (const auto& [key, value] : values) {
      out << name << '{' << label << "=\"" << key << "\"} " << part(value) << '\n';
    }
  };
  const auto whole = [](auto value) { return value; };
  const auto first = [](const auto& pair) { return pair.first; };
  const auto second = [](const auto& pair) { return pair.second; };
  one("lumigraft_frames_total", "counter", "Pictures made.", frames_);
  one("lumigraft_last_frame_age_seconds", "gauge", "Age of the newest picture; -1 before the first.", age_s);
  one("lumigraft_resting", "gauge", "1 while nobody watches and pictures are made half a minute apart.",
      rests_ ? 1 : 0);
  one("lumigraft_last_pose_age_seconds", "gauge",
      "Since the pose of a camera frame was looked for, also while resting; -1 before the first.", posed_s);
  one("lumigraft_not_grafted_seconds", "gauge", "Since the last picture with all objects that should be shown.",
      not_grafted);
  one("lumigraft_resident_bytes", "gauge", "Memory of the process.", resident_bytes());
  one("lumigraft_viewers", "gauge", "Open streams.", viewers_.load());
  one("lumigraft_cameras_in_trouble", "gauge", "Cameras that deliver no frames at present.",
      cameras_with_faults_.load());
  one("lumigraft_connections_refused_total", "counter", "Connections and streams refused or cut short by a limit.",
      refused_);
  one("lumigraft_fusion_bricks", "gauge", "Bricks of the distance field.", bricks_.load());
  one("lumigraft_fusion_bytes", "gauge", "Memory of bricks, also of those that only readers still hold.",
      brick_bytes_.load());
  one("lumigraft_fusion_evicted_bricks_total", "counter", "Bricks evicted to bound the memory.",
      evicted_bricks_.load());
  one("lumigraft_kept_room_bytes", "gauge", "File of the kept room, as last written; 0 before.", kept_bytes_.load());
  one("lumigraft_published_pictures_total", "counter", "Pictures written to the media server.", published_.load());
  one("lumigraft_publish_connected", "gauge", "1 while there is a connection to the media server.",
      publish_connected_ ? 1 : 0);
  one("lumigraft_warnings_total", "counter", "Warnings that frames carried.", warnings_);
  each("lumigraft_dropped_total", "counter", "Items dropped because the named stage was busy.", "stage", drops_, whole);
  each("lumigraft_encoded_pictures_total", "counter", "Pictures encoded.", "codec", encoded_, first);
  each("lumigraft_encoded_bytes_total", "counter", "Bytes of encoded pictures.", "codec", encoded_, second);
  each("lumigraft_plan", "gauge", "Value chosen for a key of the plan.", "key", decided_, first);
  each("lumigraft_plan_left_out", "gauge", "Fraction of the irradiance that the decision leaves out.", "key", decided_,
       second);
  head("lumigraft_stage_seconds", "histogram", "Wall time of a stage.");
  for (const auto& [name, stage] : stages_) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < stage.buckets.size(); ++i) {
      count += stage.buckets[i];
      out << "lumigraft_stage_seconds_bucket{stage=\"" << name << "\",le=\"";
      if (i < kBuckets_s.size()) {
        out << kBuckets_s[i];
      } else {
        out << "+Inf";
      }
      out << "\"} " << count << '\n';
    }
    out << "lumigraft_stage_seconds_sum{stage=\"" << name << "\"} " << stage.sum_s << '\n';
    out << "lumigraft_stage_seconds_count{stage=\"" << name << "\"} " << count << '\n';
  }
  return out.str();
}

}  // namespace lumigraft::server
