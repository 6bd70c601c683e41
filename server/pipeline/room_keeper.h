#pragma once
// When the room is kept for the next start: soon at first, at last rarely, since each time writes all of it.
#include <algorithm>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "reconstruct/scene_builder.h"
#include "server/metrics/metrics.h"
#include "server/pipeline/pacing.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {

class RoomKeeper {
 public:
  /// Writes the room; returns the size of the file.
  using Keep = std::function<std::uintmax_t(const reconstruct::RoomToKeep&)>;

  /// `keep` may be empty: then no room is kept.
  RoomKeeper(Keep keep, reconstruct::SceneBuilder& builder, Metrics& metrics)
      : keep_(std::move(keep)), builder_(builder), metrics_(metrics) {}

  bool keeps() const { return keep_ != nullptr; }
  PaceClock::time_point due() const { return due_; }
  /// To be called when it is due, by one thread.
  void keep_due() {
    due_ = PaceClock::now() + wait_;
    if (keep()) wait_ = std::min<PaceClock::duration>(2 * wait_, kPipeline.longest_keep);
  }
  /// False if it is not worth it. The room is shared with the stages until it is written, and copied in chunks; no
  /// stage waits for it. Any thread; waits while it is being kept.
  bool keep() {
    std::lock_guard lock(mutex_);
    const std::optional<reconstruct::RoomToKeep> room = keep_ ? builder_.room_to_keep() : std::nullopt;
    if (!room) return false;
    const StageTimer timer(metrics_, "keep room");
    metrics_.kept(keep_(*room));
    return true;
  }

 private:
  const Keep keep_;
  reconstruct::SceneBuilder& builder_;
  Metrics& metrics_;
  std::mutex mutex_;
  PaceClock::duration wait_ = kPipeline.first_keep;
  PaceClock::time_point due_ = PaceClock::now() + wait_;
};

}  // namespace lumigraft::server
