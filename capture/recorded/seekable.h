#pragma once
// A recording that can be decoded from a given time on.
#include <cstdint>
#include <optional>

namespace lumigraft::capture {

class Seekable {
 public:
  virtual ~Seekable() = default;
  virtual std::int64_t first_time_ns() const = 0;
  /// Time of the last frame; empty if only reading the whole recording would show it.
  virtual std::optional<std::int64_t> last_time_ns() const = 0;
  /// Skips older frames without decoding them; never goes back. Sequence numbers stay those of the whole recording.
  virtual void skip_to(std::int64_t time_ns) = 0;
};

}  // namespace lumigraft::capture
