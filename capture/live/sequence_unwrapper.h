#pragma once
// Numbers of pictures from a driver that counts them with 32 bits, those among them that it could not deliver.
#include <cstdint>
#include <optional>

namespace lumigraft::capture {

class SequenceUnwrapper {
 public:
  /// `id` as the driver counts; from 0 on, with a gap for every picture that was lost before this one.
  std::uint64_t sequence_of(std::uint32_t id) {
    constexpr std::uint32_t kCredible = 1000;  // a longer gap is a counter that was set anew
    const std::uint32_t steps = last_id_ ? id - *last_id_ : 1;
    last_id_ = id;
    next_ += steps >= 1 && steps <= kCredible ? steps - 1 : 0;
    return next_++;
  }
  /// The next number, for pictures that become one; and taken, so that it is the next no more.
  std::uint64_t next() const { return next_; }
  std::uint64_t take() { return next_++; }

 private:
  std::optional<std::uint32_t> last_id_;
  std::uint64_t next_ = 0;
};

}  // namespace lumigraft::capture
