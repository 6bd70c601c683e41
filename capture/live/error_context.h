#pragma once
// Adds a camera's source to its error messages.
#include <string>

#include "capture/error.h"

namespace lumigraft::capture {

/// Returns the result of `open`. An error that it throws is thrown again as the same type, with `source` prepended.
template <typename Open>
auto with_error_context(const std::string& source, const Open& open) {
  try {
    return open();
  } catch (const CameraFault& e) {
    throw CameraFault(source + ": " + e.what());
  } catch (const InputError& e) {
    throw InputError(source + ": " + e.what());
  }
}

}  // namespace lumigraft::capture
