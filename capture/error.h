#pragma once
// Errors that a user can cause: bad files, bad configuration, a bad command line, a camera that is absent.
#include <stdexcept>
#include <string>

namespace lumigraft::capture {

/// Input that cannot be used. `what()` is one line: where (file:line: key), what was found, what is allowed.
/// Thrown at start-up only; `main` prints it and exits with code 2. No exception crosses a stage of the frame loop.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// For checks of input: throws it where `wrong`.
inline void refuse_if(bool wrong, const std::string& found_and_allowed) {
  if (wrong) throw InputError(found_and_allowed);
}

/// A camera that cannot be opened now but may be later: absent, in use, or without permission.
class CameraFault : public InputError {
 public:
  using InputError::InputError;
};

/// Returns the result of `action`. An error that it throws is thrown again as the same type, with `context` and ": "
/// before its text: the file or the camera that it is about.
template <typename Action>
auto with_error_context(const std::string& context, const Action& action) {
  try {
    return action();
  } catch (const CameraFault& e) {
    throw CameraFault(context + ": " + e.what());
  } catch (const InputError& e) {
    throw InputError(context + ": " + e.what());
  }
}

}  // namespace lumigraft::capture
