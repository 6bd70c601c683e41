#include "server/publish/parameter_sets.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace lumigraft::server {
namespace {

constexpr std::array<std::uint8_t, 3> kStart{0, 0, 1};
constexpr int kTypeMask = 0x1f, kSequenceSet = 7, kPictureSet = 8;

std::size_t find_start(std::span<const std::uint8_t> bytes, std::size_t from) {
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(from);
  return static_cast<std::size_t>(std::search(begin, bytes.end(), kStart.begin(), kStart.end()) - bytes.begin());
}

}  // namespace

std::vector<std::uint8_t> parameter_sets(std::span<const std::uint8_t> annex_b) {
  std::vector<std::uint8_t> sets;
  for (std::size_t start = find_start(annex_b, 0); start + kStart.size() < annex_b.size();) {
    const std::size_t unit = start + kStart.size();
    const int type = annex_b[unit] & kTypeMask;
    if (type != kSequenceSet && type != kPictureSet) {
      if (type >= 1 && type <= 5) break;  // the picture itself: what follows is large and has no sets
      start = find_start(annex_b, unit);
      continue;
    }
    start = find_start(annex_b, unit);
    std::size_t end = start;
    while (end > unit && annex_b[end - 1] == 0) --end;  // zeros belong to the next start code
    sets.insert(sets.end(), {0, 0, 0, 1});
    sets.insert(sets.end(), annex_b.begin() + static_cast<std::ptrdiff_t>(unit),
                annex_b.begin() + static_cast<std::ptrdiff_t>(end));
  }
  return sets;
}

}  // namespace lumigraft::server
