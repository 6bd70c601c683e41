#pragma once
// Median of a set of values.
#include <algorithm>
#include <cstddef>
#include <vector>

namespace lumigraft::reconstruct {

/// The upper median for an even count; 0 for no values. Reorders `values`.
template <typename Value>
Value median(std::vector<Value>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace lumigraft::reconstruct
