#pragma once
// The print of a tag as a function of position, for alignment with pixels.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

/// Exact means of the print over axis-parallel boxes, from its summed-area table: the integral is bilinear in a cell.
class PrintIntegral {
 public:
  explicit PrintIntegral(const TagPattern& pattern) : pattern_(pattern) {
    // A margin of paper around the print, since boxes may extend beyond it.
    edge_ = pattern.cells + 2 * kMargin;
    sums_.assign(static_cast<std::size_t>(edge_ + 1) * (edge_ + 1), 0.0);
    for (int row = 0; row < edge_; ++row)
      for (int column = 0; column < edge_; ++column)
        at(column + 1, row + 1) = at(column, row + 1) + at(column + 1, row) - at(column, row) +
                                  (pattern.white_at(column - kMargin, row - kMargin) ? 1.0 : 0.0);
  }

  struct Mean {
    double white = 0;
    bool flat = false;                                    ///< the box is inside one cell: all derivatives are 0
    Eigen::Vector2d by_centre = Eigen::Vector2d::Zero();  ///< derivative by the box's centre
    double by_scale = 0;                                  ///< derivative by a common factor on width and height
  };
  /// Mean over a box with centre (x, y). Units are cells; x right, y down, from the print's corner.
  Mean mean(double x, double y, double width, double height) const {
    const double x0 = x - width / 2, x1 = x + width / 2, y0 = y - height / 2, y1 = y + height / 2;
    Mean mean;
    const double column_of = std::floor(x0), row_of = std::floor(y0);
    if (x1 < column_of + 1 && y1 < row_of + 1) {
      mean.flat = true;
      mean.white = pattern_.white_at(static_cast<int>(column_of), static_cast<int>(row_of)) ? 1 : 0;
      return mean;
    }
    const double area = width * height;
    if (x1 < column_of + 2 && y1 < row_of + 2) {
      // The most frequent case: the box covers at most 2 × 2 cells.
      const int i = static_cast<int>(column_of), j = static_cast<int>(row_of);
      const bool wide = x1 >= column_of + 1, high = y1 >= row_of + 1;
      const double left = wide ? column_of + 1 - x0 : width, right = width - left;
      const double top = high ? row_of + 1 - y0 : height, low = height - top;
      const auto white = [&](int column, int row) { return pattern_.white_at(column, row) ? 1.0 : 0.0; };
      const double c00 = white(i, j), c10 = wide ? white(i + 1, j) : c00;
      const double c01 = high ? white(i, j + 1) : c00, c11 = high ? (wide ? white(i + 1, j + 1) : c01) : c10;
      const double at_left = top * c00 + low * c01, at_right = top * c10 + low * c11;
      const double at_top = left * c00 + right * c10, at_low = left * c01 + right * c11;
      mean.white = (left * at_left + right * at_right) / area;
      mean.by_centre = {(at_right - at_left) / area, (at_low - at_top) / area};
      mean.by_scale = (width * (at_left + at_right) + height * (at_top + at_low)) / (2 * area) - 2 * mean.white;
      return mean;
    }
    const double left = column(x0, y0, y1), right = column(x1, y0, y1), top = row(y0, x0, x1), low = row(y1, x0, x1);
    mean.white = (integral(x1, y1) - integral(x0, y1) - integral(x1, y0) + integral(x0, y0)) / area;
    mean.by_centre = {(right - left) / area, (low - top) / area};
    mean.by_scale = (width * (left + right) + height * (top + low)) / (2 * area) - 2 * mean.white;
    return mean;
  }

  /// Mean of two such boxes, `wide` and `narrow` times the given size; derivatives are 0 where the wide one is flat.
  Mean mean_of_two(double x, double y, double width, double height, double wide, double narrow) const {
    const Mean a = mean(x, y, wide * width, wide * height);
    if (a.flat || wide == narrow) return a;
    const Mean b = mean(x, y, narrow * width, narrow * height);
    return {(a.white + b.white) / 2, false, (a.by_centre + b.by_centre) / 2, (a.by_scale + b.by_scale) / 2};
  }

 private:
  static constexpr int kMargin = 2;
  double& at(int x, int y) { return sums_[static_cast<std::size_t>(y) * (edge_ + 1) + x]; }
  double at(int x, int y) const { return sums_[static_cast<std::size_t>(y) * (edge_ + 1) + x]; }

  double integral(double x, double y) const {
    x = std::clamp(x + kMargin, 0.0, static_cast<double>(edge_));
    y = std::clamp(y + kMargin, 0.0, static_cast<double>(edge_));
    const int i = std::min(static_cast<int>(x), edge_ - 1), j = std::min(static_cast<int>(y), edge_ - 1);
    const double a = x - i, b = y - j;
    return (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) + b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
  }
  /// ∫ print(x, y) dy from y0 to y1, the derivative of the integral by x; `row` likewise by y.
  double column(double x, double y0, double y1) const {
    const int i = std::clamp(static_cast<int>(std::floor(x)), -kMargin, edge_ - kMargin - 1);
    return integral(i + 1, y1) - integral(i, y1) - integral(i + 1, y0) + integral(i, y0);
  }
  double row(double y, double x0, double x1) const {
    const int j = std::clamp(static_cast<int>(std::floor(y)), -kMargin, edge_ - kMargin - 1);
    return integral(x1, j + 1) - integral(x1, j) - integral(x0, j + 1) + integral(x0, j);
  }

  const TagPattern& pattern_;
  int edge_ = 0;
  std::vector<double> sums_;
};

/// First values of a print's ink and paper: the 10th and 90th percentile of the light on it.
inline std::pair<double, double> ink_and_paper(std::vector<double> light) {
  const auto tenth = static_cast<std::ptrdiff_t>(light.size() / 10);
  std::nth_element(light.begin(), light.begin() + tenth, light.end());
  const double ink = light[static_cast<std::size_t>(tenth)];
  std::nth_element(light.begin(), light.end() - tenth, light.end());
  return {ink, *(light.end() - tenth)};
}

}  // namespace lumigraft::reconstruct
