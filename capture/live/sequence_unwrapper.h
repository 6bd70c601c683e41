#pragma once
// 64-bit sequence numbers from the 32-bit frame counter of a driver.
#include <cstdint>
#include <optional>

#include "capture/live/parameters.h"

namespace lumigraft::capture {

class SequenceUnwrapper {
 public:
  /// `id` is the driver's counter. The result starts at 0 and has a gap where frames were lost.
  std::uint64_t sequence_of(std::uint32_t id) {
    const std::uint32_t steps = last_id_ ? id - *last_id_ : 1;
    last_id_ = id;
    next_ += steps >= 1 && steps <= kLiveParameters.max_sequence_gap ? steps - 1 : 0;
    return next_++;
  }
  /// For brackets, whose frames are numbered when the bracket is complete: the next number, without and with advancing.
  std::uint64_t next() const { return next_; }
  std::uint64_t take() { return next_++; }

 private:
  std::optional<std::uint32_t> last_id_;
  std::uint64_t next_ = 0;
};

}  // namespace lumigraft::capture
