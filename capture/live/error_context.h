#pragma once
// Errors of a camera, with its source before them.
#include <string>

#include "capture/error.h"

namespace lumigraft::capture {

/// What `open` returns; what it throws is of the same kind and begins with `source`.
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
