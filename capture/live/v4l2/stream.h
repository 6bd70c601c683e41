#pragma once
// Buffers that a V4L2 driver fills and this process reads. They are mapped, so no frame is copied. Included by .cpp
// files alone.
#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "capture/live/v4l2/device.h"

namespace lumigraft::capture::v4l2 {

/// A buffer with a frame, valid until give_back().
struct FilledBuffer {
  std::uint32_t index = 0;
  std::uint32_t sequence = 0;
  std::int64_t time_ns = 0;
  bool monotonic = false;  ///< time_ns is on CLOCK_MONOTONIC
  bool damaged = false;
  std::array<std::span<const std::uint8_t>, 2> planes;
};

/// Streams until it is destroyed or the camera is gone. Lent buffers may outlive it.
class Stream {
 public:
  Stream(std::unique_ptr<Device> device, int planes);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  const Device& device() const;
  /// Empty: timeout, or the stream has ended because of fault().
  std::optional<FilledBuffer> next(std::chrono::milliseconds timeout);
  const std::string& fault() const { return fault_; }

  /// Returns the buffer to the driver.
  void give_back(std::uint32_t index);
  /// The buffer returns to the driver with the last copy of the result; null if the driver would have too few buffers.
  std::shared_ptr<const void> lend(std::uint32_t index);

 private:
  struct Buffer;
  struct Shared;
  bool source_changed();
  std::optional<FilledBuffer> dequeue();

  std::shared_ptr<Shared> shared_;
  int planes_;
  std::string fault_;
  bool unplugged_ = false;
};

}  // namespace lumigraft::capture::v4l2
