#pragma once
// Points between vertices of an animated model, numbered while it is being read.
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

class SourceMixes {
 public:
  SourceMixes() = default;
  /// `first`: the number of the first mix, that of the rig's vertices.
  explicit SourceMixes(std::uint32_t first) : first_(first) {}

  /// The number of a + t (b - a); the same for the same point.
  std::uint32_t between(std::uint32_t a, std::uint32_t b, float t) {
    if (t == 0.5f && b < a) std::swap(a, b);
    const auto [found, is_new] = numbers_.try_emplace({a, b, t}, first_ + static_cast<std::uint32_t>(mixes_.size()));
    if (is_new) mixes_.push_back({a, b, t});
    return found->second;
  }
  std::vector<Model::Mix> take() { return std::move(mixes_); }

 private:
  std::uint32_t first_ = 0;
  std::vector<Model::Mix> mixes_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, float>, std::uint32_t> numbers_;
};

}  // namespace lumigraft::relight
