#pragma once
// The memory that a V4L2 driver fills and this process reads: mapped, so that nothing is copied on the way. Included by
// .cpp files alone.
#include <array>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/live/v4l2/device.h"

namespace lumigraft::capture::v4l2 {

/// A picture as the driver gave it, valid until its index is given back.
struct Filled {
  std::uint32_t index = 0;
  std::uint32_t sequence = 0;
  std::int64_t time_ns = 0;
  bool monotonic = false;  ///< the time is CLOCK_MONOTONIC's
  bool damaged = false;
  std::array<std::span<const std::uint8_t>, 2> planes;
};

/// Runs until it is destroyed or the camera is gone. What was lent may outlive it.
class Stream {
 public:
  Stream(std::unique_ptr<Device> device, int planes);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  const Device& device() const;
  /// Empty: nothing came, or trouble() says why nothing will.
  std::optional<Filled> next(std::chrono::milliseconds timeout);
  const std::string& fault() const { return trouble_; }

  /// The driver may fill it again.
  void give_back(std::uint32_t index);
  /// Gives it back when the last copy of the result goes; null where the driver would have too few left.
  std::shared_ptr<const void> lend(std::uint32_t index);

 private:
  struct Buffer;
  struct Shared;
  bool hear_events();
  std::optional<Filled> take();

  std::shared_ptr<Shared> shared_;
  int planes_;
  std::string trouble_;
  bool unplugged_ = false;
};

}  // namespace lumigraft::capture::v4l2
