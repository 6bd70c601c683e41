#include "relight/compose/outline_matte.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using reconstruct::broadcast;
using reconstruct::Simd4;

constexpr int kCellBlock = 64;  // cells or nodes per thread at a time
/// Scale of the kernel over its reach. With the width of cells and what lies between nodes, samples around a pixel have
/// the variance that 0.5 gives where each pixel sums them by itself.
constexpr float kSpread = 0.4f;

/// Fraction of a Gaussian below x.
class NormalCdf {
 public:
  NormalCdf() {
    for (std::size_t k = 0; k < values_.size(); ++k) {
      const float x = static_cast<float>(k) / kSteps - kEnd;
      values_[k] = 0.5f * std::erfc(-x / std::sqrt(2.0f));
    }
  }
  /// To 3e-5: linear between steps of which the square is at most 1/8 · 0.25 of it off.
  float operator()(float x) const {
    const float at = (std::clamp(x, -kEnd, kEnd) + kEnd) * kSteps;
    const auto k = std::min(static_cast<std::size_t>(at), values_.size() - 2);
    return values_[k] + (at - static_cast<float>(k)) * (values_[k + 1] - values_[k]);
  }

 private:
  static constexpr float kEnd = 5, kSteps = 32;
  std::array<float, static_cast<std::size_t>(2 * kEnd * kSteps) + 1> values_;
};

/// How surely a pixel shows one side alone, by its distance from the outline over sigma: half a pixel inside a finger
/// counts only where nothing else does.
float certainty(float away) {
  const float sure = std::min(0.5f * std::abs(away), 1.0f);
  return sure * sure * sure;
}

Rgb channels(Simd4 sums) { return {sums[0], sums[1], sums[2]}; }

/// Means of one side; last 1 and 0.
struct MeansOfSide {
  Simd4 part;  ///< one over the sum of weights
  Simd4 color, variance;

  MeansOfSide(Simd4 colors, Simd4 squares) : part(broadcast(1 / colors[3])), color(part * colors) {
    variance = reconstruct::max(part * squares - color * color, Simd4{});
  }
};

/// Radiance over which the encoded value of a channel grows by 1 at the rate that it has at this radiance.
Rgb spread_of(const Rgb& radiance, const Rgb& exposure) {
  const Rgb light = (exposure * radiance).max(0.0f).min(1.0f);
  return (light < 0.0031308f).select(Rgb::Constant(1 / 12.92f), 2.4f / 1.055f * light.pow(1 - 1 / 2.4f)) / exposure;
}

/// Probability that a colour is of a side of which colours are known some pixels away, `prior` before it was seen: a
/// Gaussian about their mean along which it varies by shading. The other side may have any pixel values, all alike.
/// `noise`: the colour's variance; `spread`: one over the density of those pixel values at the colour.
float probability_of(const MeansOfSide& side, float prior, const Rgb& color, const Rgb& noise, const Rgb& spread) {
  constexpr float kTwoPi = 6.2831853f;
  const Rgb mean = channels(side.color);
  const Rgb variance = (channels(side.variance) + noise).max(std::numeric_limits<float>::min());
  // By Sherman and Morrison 1950, and the determinant of the same sum.
  const Rgb off = color - mean, shade = kCompose.matte_shade * mean;
  const float shaded = 1 + (shade.square() / variance).sum(), along = (shade * off / variance).sum();
  const float distance2 = (off.square() / variance).sum() - along * along / shaded;
  const float log_ratio = ((spread.square() / (kTwoPi * variance)).log().sum() - std::log(shaded) - distance2) / 2;
  return prior / (prior + (1 - prior) * std::exp(-log_ratio));
}

}  // namespace

MatteReach::MatteReach(int width)
    : sigma_px(kCompose.matte_sigma_px * std::max(static_cast<float>(width) / 320, 1.0f)),
      matte_px(static_cast<int>(std::ceil(kCompose.matte_reach * sigma_px))),
      samples_px(static_cast<int>(std::ceil((kCompose.matte_reach + kCompose.matte_samples) * sigma_px))) {}

OutlineMatte::OutlineMatte(const DisplacedDepth& depth, const CameraUpload& picture, const cv::Point& corner,
                           const OutlineDistance& away, const capture::Image<float>* values)
    : depth_(depth),
      picture_(picture),
      width_(picture.coded()->width),
      reach_(width_),
      corner_(corner),
      away_(away),
      values_(values),
      // Every other pixel of fine images is enough.
      step_(std::max(static_cast<int>(std::lround(reach_.sigma_px)), 1)),
      cell_px_(kCell * step_),
      first_column_(corner.x / cell_px_ - 1),
      first_row_(corner.y / cell_px_ - 1),
      columns_((corner.x + away.size().width - 1) / cell_px_ - first_column_ + 2),
      rows_((corner.y + away.size().height - 1) / cell_px_ - first_row_ + 2),
      cells_per_px_(1 / static_cast<float>(cell_px_)) {
  const float spread = kSpread * static_cast<float>(reach_.samples_px) / static_cast<float>(cell_px_);
  for (int y = -kReach; y <= kReach; ++y) {
    for (int x = -kReach; x <= kReach; ++x) {
      const float near = 1 / (1 + static_cast<float>(x * x + y * y) / (spread * spread));
      kernel_[static_cast<std::size_t>((y + kReach) * (2 * kReach + 1) + x + kReach)] = near * near;
    }
  }
  const std::size_t cells = index(0, rows_);
  cells_.assign(cells, Cell::unknown);
  sums_ = std::make_unique_for_overwrite<Sides[]>(cells);
  node_of_.assign(cells, -1);
}

OutlineMatte::Place OutlineMatte::place_of(int u, int v) const {
  // A node is in the middle of the samples of its cell.
  const float middle = 0.5f * static_cast<float>(step_ * (kCell - 1));
  const float x = (static_cast<float>(u - first_column_ * cell_px_) - middle) * cells_per_px_,
              y = (static_cast<float>(v - first_row_ * cell_px_) - middle) * cells_per_px_;
  const auto column = static_cast<int>(x), row = static_cast<int>(y);
  return {column, row, x - static_cast<float>(column), y - static_cast<float>(row)};
}

void OutlineMatte::prepare(const std::vector<cv::Point>& pixels) {
  std::vector<cv::Point> nodes;
  cv::Point last(-1, -1);
  for (const cv::Point& pixel : pixels) {
    if (is_front(pixel.x, pixel.y)) continue;
    const Place at = place_of(pixel.x, pixel.y);
    if (std::exchange(last, cv::Point(at.column, at.row)) == cv::Point(at.column, at.row)) continue;
    for (const cv::Point& place : {last, last + cv::Point(1, 0), last + cv::Point(0, 1), last + cv::Point(1, 1)}) {
      int& node = node_of_[index(place.x, place.y)];
      if (node >= 0) continue;
      node = static_cast<int>(nodes_.size() + nodes.size());
      nodes.push_back(place);
    }
  }
  cv::Mat1b wanted(rows_, columns_, std::uint8_t{0});
  for (const cv::Point& node : nodes) wanted(node) = 1;
  cv::dilate(wanted, wanted, cv::Mat1b::ones(2 * kReach + 1, 2 * kReach + 1));
  std::vector<cv::Point> cells;
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      if (wanted(row, column) && cells_[index(column, row)] == Cell::unknown) cells.emplace_back(column, row);
    }
  }
  for_each_index(cells.size(), kCellBlock, [&](std::size_t k) { sum_samples(cells[k].x, cells[k].y); });
  const std::size_t before = nodes_.size();
  nodes_.resize(before + nodes.size());
  for_each_index(nodes.size(), kCellBlock, [&](std::size_t k) {
    nodes_[before + k] = values_ ? gathered<true>(nodes[k].x, nodes[k].y) : gathered<false>(nodes[k].x, nodes[k].y);
  });
}

void OutlineMatte::sum_samples(int column, int row) {
  Sides sums;
  for (int j = 0; j < kCell; ++j) {
    for (int i = 0; i < kCell; ++i) {
      const int u = (first_column_ + column) * cell_px_ + i * step_, v = (first_row_ + row) * cell_px_ + j * step_;
      const int x = u - corner_.x, y = v - corner_.y;
      if (x < 0 || y < 0 || x >= away_.size().width || y >= away_.size().height || !depth_.known(u, v)) continue;
      const float away_px = away_.at(x, y);
      const Simd4 sure = broadcast(certainty(away_px / reach_.sigma_px));
      const auto pixel = static_cast<std::size_t>(v * width_ + u);
      const Rgb own = picture_.radiance(pixel);
      const Simd4 color{own[0], own[1], own[2], 1};
      Side& side = away_px < 0 ? sums.front : sums.behind;
      side.colors += sure * color;
      side.squares += sure * color * color;
      if (!values_) continue;
      const Rgb value = radiance_at(*values_, pixel);
      side.values += sure * Simd4{value[0], value[1], value[2], 0};
    }
  }
  const std::size_t i = index(column, row);
  const bool front = sums.front.colors[3] > 0, behind = sums.behind.colors[3] > 0;
  cells_[i] = front ? (behind ? Cell::both : Cell::front) : behind ? Cell::behind : Cell::empty;
  sums_[i] = sums;
}

template <bool kValues>
OutlineMatte::Sides OutlineMatte::gathered(int column, int row) const {
  Sides sums;
  const auto add = [](Simd4 weight, const Side& from, Side& to) {
    to.colors += weight * from.colors;
    to.squares += weight * from.squares;
    if (kValues) to.values += weight * from.values;
  };
  const int left = std::max(column - kReach, 0), right = std::min(column + kReach, columns_ - 1);
  for (int y = std::max(row - kReach, 0); y <= std::min(row + kReach, rows_ - 1); ++y) {
    const float* kernel = &kernel_[static_cast<std::size_t>((y - row + kReach) * (2 * kReach + 1))];
    for (int x = left; x <= right; ++x) {
      const std::size_t i = index(x, y);
      const Cell cell = cells_[i];
      if (cell == Cell::empty) continue;
      const Simd4 weight = broadcast(kernel[x - column + kReach]);
      if (cell != Cell::behind) add(weight, sums_[i].front, sums.front);
      if (cell != Cell::front) add(weight, sums_[i].behind, sums.behind);
    }
  }
  return sums;
}

inline OutlineMatte::Sides OutlineMatte::between(const Sides& a, const Sides& b, float towards_b) const {
  const Simd4 of_a = broadcast(1 - towards_b), of_b = broadcast(towards_b);
  const auto of_side = [&](const Side& x, const Side& y) {
    return Side{of_a * x.colors + of_b * y.colors, of_a * x.squares + of_b * y.squares,
                values_ ? of_a * x.values + of_b * y.values : Simd4{}};
  };
  return {of_side(a.front, b.front), of_side(a.behind, b.behind)};
}

OutlineMatte::Mixture OutlineMatte::Reader::at(int u, int v) {
  const OutlineMatte& m = matte_;
  if (m.is_front(u, v)) {
    const Rgb own = m.picture_.radiance(static_cast<std::size_t>(v * m.width_ + u));
    const Simd4 color{own[0], own[1], own[2], 1};
    return {1, color, color, color, false, true};
  }
  const Place place = m.place_of(u, v);
  if (place.column != column_ || place.row != row_ || v != v_) {
    column_ = place.column;
    row_ = place.row;
    v_ = v;
    const auto node = [&](int right, int below) -> const Sides& {
      return m.nodes_[static_cast<std::size_t>(m.node_of_[m.index(place.column + right, place.row + below)])];
    };
    left_ = m.between(node(0, 0), node(0, 1), place.below);
    right_ = m.between(node(1, 0), node(1, 1), place.below);
  }
  return m.mixture(u, v, m.between(left_, right_, place.right));
}

OutlineMatte::Mixture OutlineMatte::mixture(int u, int v, const Sides& sums) const {
  const bool unknown = !depth_.known(u, v);
  const float outside_px = away_.at(u - corner_.x, v - corner_.y);
  const Rgb own = picture_.radiance(static_cast<std::size_t>(v * width_ + u));
  const Simd4 color{own[0], own[1], own[2], 1};
  static const NormalCdf normal_cdf;
  const float prior = unknown ? 0.5f : normal_cdf(-outside_px / reach_.sigma_px);
  const bool any_front = sums.front.colors[3] > 0, any_behind = sums.behind.colors[3] > 0;
  if (!any_front || !any_behind) {
    // As in the shadow that a hand throws in the light of a depth camera's projector.
    const Rgb own_noise = kCompose.matte_noise * kCompose.matte_noise * own.square();
    const Rgb spread = spread_of(own, picture_.exposure());
    const auto probability = [&](const Side& side, float before) {
      return probability_of({side.colors, side.squares}, before, own, own_noise, spread);
    };
    const float alpha = any_front    ? probability(sums.front, prior)
                        : any_behind ? 1 - probability(sums.behind, 1 - prior)
                                     : prior;
    return {alpha, color, color, color, false, outside_px < 0};
  }
  const MeansOfSide front(sums.front.colors, sums.front.squares), behind(sums.behind.colors, sums.behind.squares);
  const Simd4 apart = front.color - behind.color;
  // The precision of α by colour, channels being independent, and by depth.
  const Simd4 noise = broadcast(prior) * front.variance + broadcast(1 - prior) * behind.variance +
                      broadcast(kCompose.matte_noise * kCompose.matte_noise) * color * color;
  const Simd4 over_noise = apart / reconstruct::max(noise, broadcast(std::numeric_limits<float>::min()));
  const float by_color = reconstruct::sum_of(over_noise * apart);
  const float by_depth = 1 / std::max(prior * (1 - prior), 1e-4f);
  const float sum = reconstruct::sum_of(over_noise * (color - behind.color));
  const float alpha = std::clamp((sum + by_depth * prior) / (by_color + by_depth), 0.0f, 1.0f);
  Mixture mixture{alpha, color, front.color, behind.color, true, outside_px < 0};
  if (values_) {
    mixture.values_front = front.part * sums.front.values;
    mixture.values_behind = behind.part * sums.behind.values;
  }
  return mixture;
}

}  // namespace lumigraft::relight
