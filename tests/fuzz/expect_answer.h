#pragma once
// What fuzz targets share.
#include <string_view>

#include "capture/error.h"
#include "tests/fuzz/targets.h"

namespace lumigraft::fuzz {

/// Runs the action; InputError is a correct result of it.
template <typename Action>
void expect_answer(const Action& action) {
  try {
    action();
  } catch (const capture::InputError&) {  // CameraFault is one
  }
}

inline std::string_view text_of(Bytes bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

}  // namespace lumigraft::fuzz
