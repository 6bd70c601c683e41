#pragma once
// The middle of some values: of an even number the upper one, 0 of none.
#include <algorithm>
#include <cstddef>
#include <vector>

namespace lumigraft::reconstruct {

/// Changes the values' order.
template <typename Value>
Value median(std::vector<Value>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace lumigraft::reconstruct
