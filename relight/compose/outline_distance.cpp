#include "relight/compose/outline_distance.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace lumigraft::relight {
namespace {

constexpr int kMaxReach_px = 120;  // squares of distances in a stamp's corners are below 2^15

/// Calls act(x, y) for each pixel of `mask` that differs from the one right of it or below it in whether it is 0.
template <typename Act>
void for_each_step(const cv::Mat1b& mask, Act act) {
  constexpr int kWord = 8;  // bytes that are compared at once
  const auto word = [](const std::uint8_t* from) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, from, kWord);
    return bytes;
  };
  for (int y = 0; y < mask.rows; ++y) {
    const std::uint8_t* row = mask[y];
    const std::uint8_t* below = y + 1 < mask.rows ? mask[y + 1] : row;
    int x = 0;
    while (x < mask.cols) {
      if (x + kWord < mask.cols && word(row + x) == word(row + x + 1) && word(row + x) == word(below + x)) {
        x += kWord;
        continue;
      }
      for (const int end = std::min(x + kWord, mask.cols); x < end; ++x) {
        const bool own = row[x] != 0;
        if (x + 1 < mask.cols && (row[x + 1] != 0) != own) act(x, y, 1, 0);
        if ((below[x] != 0) != own) act(x, y, 0, 1);
      }
    }
  }
}

}  // namespace

OutlineDistance::OutlineDistance(const cv::Mat1b& front, int reach_px)
    : front_(front),
      reach_px_(std::min(reach_px, kMaxReach_px)),
      beyond_(static_cast<std::int16_t>(reach_px_ * reach_px_ + 2 * reach_px_ + 1)),
      stamp_columns_((2 * reach_px_ + kLanes) / kLanes * kLanes) {
  stride_ = static_cast<std::size_t>(front.cols + reach_px_ + stamp_columns_);
  for (int square = 0; square <= beyond_; ++square) roots_.push_back(std::sqrt(static_cast<float>(square)));
  for (int y = -reach_px_; y <= reach_px_; ++y) {
    for (int x = -reach_px_; x < stamp_columns_ - reach_px_; ++x)
      stamp_.push_back(x <= reach_px_ ? static_cast<std::int16_t>(x * x + y * y) : INT16_MAX);
  }
  for (auto& squares : squares_)
    squares.assign(stride_ * static_cast<std::size_t>(front.rows + 2 * reach_px_), INT16_MAX);
  // The nearest pixel of the other side has one of this side next to it.
  cv::Mat1b done(front.size(), std::uint8_t{0});
  const auto add = [&](int x, int y) {
    if (std::exchange(done(y, x), std::uint8_t{1})) return;
    stamp(x, y, squares_[front_(y, x) ? 1 : 0]);
  };
  for_each_step(front_, [&](int x, int y, int right, int below) {
    add(x, y);
    add(x + right, y + below);
  });
}

bool OutlineDistance::any_near(int left, int y) const {
  Lanes in_front, behind;
  std::memcpy(&in_front, &squares_[0][index(left, y)], sizeof(Lanes));
  std::memcpy(&behind, &squares_[1][index(left, y)], sizeof(Lanes));
  using Halves = std::int64_t __attribute__((vector_size(2 * kLanes)));
  const auto near = reinterpret_cast<Halves>((in_front <= beyond_) | (behind <= beyond_));
  return (near[0] | near[1]) != 0;
}

void OutlineDistance::stamp(int x, int y, std::vector<std::int16_t>& squares) const {
  const std::int16_t* from = stamp_.data();
  for (int dy = -reach_px_; dy <= reach_px_; ++dy) {
    std::int16_t* to = &squares[index(x - reach_px_, y + dy)];
    for (int k = 0; k < stamp_columns_; k += kLanes, from += kLanes) {
      Lanes a, b;
      std::memcpy(&a, from, sizeof(Lanes));
      std::memcpy(&b, to + k, sizeof(Lanes));
      const Lanes nearer = a < b ? a : b;
      std::memcpy(to + k, &nearer, sizeof(Lanes));
    }
  }
}

}  // namespace lumigraft::relight
