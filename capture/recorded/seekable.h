#pragma once
// A recording that need not be decoded from its beginning.
#include <cstdint>
#include <optional>

namespace lumigraft::capture {

class Seekable {
 public:
  virtual ~Seekable() = default;
  virtual std::int64_t first_time_ns() const = 0;
  /// Of the last picture; empty where only reading everything would tell.
  virtual std::optional<std::int64_t> last_time_ns() const = 0;
  /// Leaves out what is older than this, undecoded; never goes back. Pictures keep their numbers.
  virtual void skip_to(std::int64_t time_ns) = 0;
};

}  // namespace lumigraft::capture
