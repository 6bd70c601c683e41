#pragma once
// The one error a person can cause: bad files, bad configuration, a bad command line.
#include <stdexcept>
#include <string>

namespace lumigraft::capture {

/// Input that cannot be used. `what()` is one line: where (file:line: key), what was found, what is allowed.
/// Thrown at start-up only; `main` prints it and exits with code 2. The frame loop never throws across a stage.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A camera that cannot be opened now and may be later: absent, busy, or not ours to open.
class CameraFault : public InputError {
 public:
  using InputError::InputError;
};

}  // namespace lumigraft::capture
