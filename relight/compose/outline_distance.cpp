#include "relight/compose/outline_distance.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

constexpr int kMaxReach_px = 120;      // sums of two squares are below 2^15
constexpr std::int16_t kFar = 15'000;  // beyond any reach, squared

constexpr int kBand = 16;  // rows per thread at a time
constexpr int kLanes = 8;
using Lanes = std::int16_t __attribute__((vector_size(2 * kLanes)));
using Bytes = std::uint8_t __attribute__((vector_size(kLanes)));

bool any(Lanes where) {
  using Halves = std::int64_t __attribute__((vector_size(2 * kLanes)));
  const auto halves = reinterpret_cast<Halves>(where);
  return (halves[0] | halves[1]) != 0;
}
Lanes loaded(const std::int16_t* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
Lanes least(Lanes a, Lanes b) { return a < b ? a : b; }

/// Rows of whole lanes with a margin of one on both sides.
struct PaddedRows {
  std::size_t stride;
  std::vector<std::int16_t> values;

  PaddedRows(const cv::Size& size, std::int16_t value)
      : stride(static_cast<std::size_t>((size.width + kLanes - 1) / kLanes + 2) * kLanes),
        values(stride * static_cast<std::size_t>(size.height), value) {}
  std::int16_t* row(int y) { return &values[static_cast<std::size_t>(y) * stride + kLanes]; }
};

/// The mask as 0 and −1; beyond its left and right borders it continues.
PaddedRows sides_of(const cv::Mat1b& front) {
  PaddedRows sides(front.size(), 0);
  for (int y = 0; y < front.rows; ++y) {
    std::int16_t* row = sides.row(y);
    const std::uint8_t* from = front[y];
    int x = 0;
    for (; x + kLanes <= front.cols; x += kLanes) {
      Bytes bytes;
      std::memcpy(&bytes, from + x, sizeof(bytes));
      const Lanes lanes = __builtin_convertvector(bytes, Lanes) != 0;
      std::memcpy(row + x, &lanes, sizeof(lanes));
    }
    for (; x < front.cols; ++x) row[x] = from[x] ? -1 : 0;
    std::fill(row - kLanes, row, row[0]);
    std::fill(row + front.cols, row - kLanes + sides.stride, row[front.cols - 1]);
  }
  return sides;
}

/// Distance of each pixel to the nearest one of its column that is of the other side, at most `most`.
PaddedRows along_columns(PaddedRows& sides, const cv::Size& size, std::int16_t most) {
  PaddedRows distance(size, most);
  const auto sweep = [&](int y, int before) {
    const std::int16_t *own = sides.row(y), *other = sides.row(before), *from = distance.row(before);
    std::int16_t* to = distance.row(y);
    for (int x = 0; x < size.width; x += kLanes) {
      const Lanes reached = loaded(own + x) == loaded(other + x) ? loaded(from + x) + 1 : 1 - Lanes{};
      const Lanes nearest = least(loaded(to + x), reached);
      std::memcpy(to + x, &nearest, sizeof(nearest));
    }
  };
  for (int y = 1; y < size.height; ++y) sweep(y, y - 1);
  for (int y = size.height - 2; y >= 0; --y) sweep(y, y + 1);
  return distance;
}

/// Squared distances in a row, by those along columns: to what is in front and to what is behind, which are 0 there.
class RowSearch {
 public:
  RowSearch(int width, int reach_px)
      : width_(width),
        reach_px_(reach_px),
        margin_(static_cast<std::size_t>((reach_px + kLanes - 1) / kLanes) * kLanes),
        length_(2 * margin_ + static_cast<std::size_t>((width + kLanes - 1) / kLanes) * kLanes),
        squares_(2 * length_, kFar) {}

  /// False if no pixel is near the outline.
  bool take(const std::int16_t* side, const std::int16_t* along_column) {
    std::int16_t *front = to_front(), *behind = to_behind();
    first_ = width_;
    last_ = -1;
    for (int x = 0; x < width_; x += kLanes) {
      const Lanes in_front = loaded(side + x), px = loaded(along_column + x), far = px > static_cast<short>(reach_px_);
      const Lanes square = far ? kFar - Lanes{} : px * px;
      const Lanes of_front = square & ~in_front, of_behind = square & in_front;
      std::memcpy(front + x, &of_front, sizeof(of_front));
      std::memcpy(behind + x, &of_behind, sizeof(of_behind));
      if (!any(~far) && !any(in_front != loaded(side + x - 1))) continue;
      first_ = std::min(first_, x - kLanes);  // the other side may begin here
      last_ = x + kLanes - 1;
    }
    return last_ >= 0;
  }
  /// Calls act(x, squares) for whole lanes from x on, all that are near.
  template <typename Act>
  void for_each_near(Act act) const {
    const int begin = std::max(first_ - static_cast<int>(margin_), 0), end = std::min(last_ + reach_px_ + 1, width_);
    for (int x = begin; x < end; x += kLanes) act(x, nearest(x));
  }

 private:
  std::int16_t* to_front() { return &squares_[margin_]; }
  std::int16_t* to_behind() { return &squares_[length_ + margin_]; }

  Lanes nearest(int x) const {
    const std::int16_t *front = &squares_[margin_] + x, *behind = front + length_;
    Lanes front_square = loaded(front), behind_square = loaded(behind);
    const Lanes is_behind = front_square != 0;
    const bool some_behind = any(is_behind), some_in_front = any(~is_behind);
    const auto search = [](const std::int16_t* from, int dx, Lanes nearest) {
      return least(nearest, least(loaded(from - dx), loaded(from + dx)) + static_cast<std::int16_t>(dx * dx));
    };
    const auto nearest_of_both = [&] { return is_behind ? front_square : behind_square; };
    for (int dx = 1; dx <= reach_px_ && any(nearest_of_both() > static_cast<std::int16_t>(dx * dx)); ++dx) {
      if (some_behind) front_square = search(front, dx, front_square);
      if (some_in_front) behind_square = search(behind, dx, behind_square);
    }
    return nearest_of_both();
  }

  int width_, reach_px_;
  std::size_t margin_, length_;
  std::vector<std::int16_t> squares_;
  int first_ = 0, last_ = -1;  ///< pixels near the outline along their columns, or beside it
};

}  // namespace

// The exact transform of Felzenszwalb and Huttenlocher 2012, one dimension after the other. Within a short reach the
// second is a search outwards instead of an envelope of parabolas.
OutlineDistance::OutlineDistance(const cv::Mat1b& front, int reach_px)
    : front_(front),
      reach_px_(std::min(reach_px, kMaxReach_px)),
      stride_(static_cast<std::size_t>((front.cols + kLanes - 1) / kLanes * kLanes)),
      beyond_(static_cast<std::int16_t>(reach_px_ * reach_px_ + 2 * reach_px_ + 1)),
      squares_(stride_ * static_cast<std::size_t>(front.rows), beyond_) {
  for (int square = 0; square <= beyond_; ++square) roots_.push_back(std::sqrt(static_cast<float>(square)));
  PaddedRows sides = sides_of(front_);
  PaddedRows along_column = along_columns(sides, front_.size(), static_cast<std::int16_t>(reach_px_ + 1));
  for_each_block(front_.rows, kBand, [&](int first, int last) {
    RowSearch search(front_.cols, reach_px_);
    for (int y = first; y < last; ++y) {
      if (!search.take(sides.row(y), along_column.row(y))) continue;
      search.for_each_near([&](int x, Lanes squares) {
        const Lanes bounded = least(squares, beyond_ - Lanes{});
        std::memcpy(&squares_[index(x, y)], &bounded, sizeof(bounded));
      });
    }
  });
}

bool OutlineDistance::any_near(int left, int y) const { return any(loaded(&squares_[index(left, y)]) < beyond_); }

}  // namespace lumigraft::relight
