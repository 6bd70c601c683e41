#include "relight/compose/outline_matte.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using reconstruct::broadcast;
using reconstruct::Simd4;

constexpr int kSquare = 8;      // samples along the edge of a square that is sampled as one
constexpr int kNodeBlock = 64;  // nodes per thread at a time

/// Fraction of a Gaussian below x.
float normal_cdf(float x) { return 0.5f * std::erfc(-x / std::sqrt(2.0f)); }

/// How surely a pixel shows one side alone, by its distance from the outline over sigma: half a pixel inside a finger
/// counts only where nothing else does.
float certainty(float away) {
  const float sure = std::min(0.5f * std::abs(away), 1.0f);
  return sure * sure * sure;
}

Rgb channels(Simd4 sums) { return {sums[1], sums[2], sums[3]}; }

/// Means of one side.
struct MeansOfSide {
  Rgb color, variance;

  MeansOfSide(Simd4 colors, Simd4 squares)
      : color(channels(colors) / colors[0]), variance((channels(squares) / colors[0] - color.square()).max(0)) {}
};

/// Probability that a colour is of a side of which colours are known some pixels away: a Gaussian about their mean
/// along which it varies by shading. The other side may have any colour up to the brightest. `noise`: its variance.
float probability_of(const MeansOfSide& side, const Rgb& color, const Rgb& noise) {
  constexpr float kTwoPi = 6.2831853f;
  const Rgb variance = (side.variance + noise).max(std::numeric_limits<float>::min());
  const Rgb brightest = color.max(side.color).max(std::numeric_limits<float>::min());
  // By Sherman and Morrison 1950, and the determinant of the same sum.
  const Rgb off = color - side.color, shade = kCompose.matte_shade * side.color;
  const float shaded = 1 + (shade.square() / variance).sum(), along = (shade * off / variance).sum();
  const float distance2 = (off.square() / variance).sum() - along * along / shaded;
  const float log_ratio = ((brightest.square() / (kTwoPi * variance)).log().sum() - std::log(shaded) - distance2) / 2;
  return 1 / (1 + std::exp(-log_ratio));
}

int steps_down(int px, int step) { return px / step; }  // px is not negative
int steps_up(int px, int step) { return (px + step - 1) / step; }

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
      first_column_(steps_down(corner.x, step_)),
      first_row_(steps_down(corner.y, step_)),
      columns_(steps_up(corner.x + away.size().width - 1, step_) - first_column_ + 1),
      rows_(steps_up(corner.y + away.size().height - 1, step_) - first_row_ + 1),
      samples_(steps_up(reach_.samples_px, step_)) {
  const float spread = 0.5f * static_cast<float>(reach_.samples_px) / static_cast<float>(step_);
  for (int y = -samples_; y <= samples_; ++y) {
    for (int x = -samples_; x <= samples_; ++x) {
      const float near = 1 / (1 + static_cast<float>(x * x + y * y) / (spread * spread));
      kernel_.push_back(near * near);
    }
  }
  const std::size_t places = index(0, rows_);
  weights_.assign(places, 0.0f);
  sample_colors_ = std::make_unique_for_overwrite<Simd4[]>(places);
  if (values) sample_values_ = std::make_unique_for_overwrite<Simd4[]>(places);
  sampled_.assign(static_cast<std::size_t>(steps_up(columns_, kSquare) * steps_up(rows_, kSquare)), 0);
  node_of_.assign(places, -1);
}

OutlineMatte::Place OutlineMatte::place_of(int u, int v) const {
  const auto part = [&](int px) { return static_cast<float>(px % step_) / static_cast<float>(step_); };
  return {u / step_ - first_column_, v / step_ - first_row_, part(u), part(v)};
}

/// Calls act(column, row, weight) for the nodes that the sums at a pixel are interpolated from.
template <typename Act>
void OutlineMatte::for_each_node(int u, int v, Act act) const {
  const Place at = place_of(u, v);
  for (int j = 0; j <= (at.below > 0 ? 1 : 0); ++j) {
    for (int i = 0; i <= (at.right > 0 ? 1 : 0); ++i) {
      act(at.column + i, at.row + j, (i ? at.right : 1 - at.right) * (j ? at.below : 1 - at.below));
    }
  }
}

void OutlineMatte::prepare(const std::vector<cv::Point>& pixels) {
  std::vector<cv::Point> places;
  for (const cv::Point& pixel : pixels) {
    for_each_node(pixel.x, pixel.y, [&](int column, int row, float) {
      int& node = node_of_[index(column, row)];
      if (node >= 0) return;
      node = static_cast<int>(nodes_.size() + places.size());
      places.emplace_back(column, row);
    });
  }
  std::vector<cv::Point> squares;
  const int across = steps_up(columns_, kSquare);
  for (const cv::Point& place : places) {
    for (int y = std::max(place.y - samples_, 0) / kSquare; y <= std::min(place.y + samples_, rows_ - 1) / kSquare;
         ++y) {
      for (int x = std::max(place.x - samples_, 0) / kSquare; x <= std::min(place.x + samples_, columns_ - 1) / kSquare;
           ++x) {
        char& sampled = sampled_[static_cast<std::size_t>(y * across + x)];
        if (!sampled) squares.emplace_back(x, y);
        sampled = 1;
      }
    }
  }
  for_each_index(squares.size(), kNodeBlock, [&](std::size_t k) {
    const int left = squares[k].x * kSquare, top = squares[k].y * kSquare;
    for (int row = top; row < std::min(top + kSquare, rows_); ++row) {
      for (int column = left; column < std::min(left + kSquare, columns_); ++column) sample(column, row);
    }
  });
  const std::size_t before = nodes_.size();
  nodes_.resize(before + places.size());
  for_each_index(places.size(), kNodeBlock,
                 [&](std::size_t k) { nodes_[before + k] = gathered(places[k].x, places[k].y); });
}

void OutlineMatte::sample(int column, int row) {
  const int u = (first_column_ + column) * step_, v = (first_row_ + row) * step_;
  const int x = u - corner_.x, y = v - corner_.y;
  if (x < 0 || y < 0 || x >= away_.size().width || y >= away_.size().height || !depth_.known(u, v)) return;
  const float away_px = away_.at(x, y), sure = certainty(away_px / reach_.sigma_px);
  const auto pixel = static_cast<std::size_t>(v * width_ + u);
  const Rgb color = picture_.radiance(pixel);
  const std::size_t i = index(column, row);
  weights_[i] = away_px < 0 ? -sure : sure;
  sample_colors_[i] = Simd4{1, color[0], color[1], color[2]};
  if (!values_) return;
  const Rgb value = radiance_at(*values_, pixel);
  sample_values_[i] = Simd4{0, value[0], value[1], value[2]};
}

OutlineMatte::Node OutlineMatte::gathered(int column, int row) const {
  Node node;
  const int left = std::max(column - samples_, 0), right = std::min(column + samples_, columns_ - 1);
  for (int y = std::max(row - samples_, 0); y <= std::min(row + samples_, rows_ - 1); ++y) {
    const float* kernel = &kernel_[static_cast<std::size_t>((y - row + samples_) * (2 * samples_ + 1))];
    for (int x = left; x <= right; ++x) {
      const std::size_t i = index(x, y);
      const float side = weights_[i];
      if (side == 0) continue;
      const Simd4 color = sample_colors_[i], weight = broadcast(std::abs(side) * kernel[x - column + samples_]);
      const Simd4 weighted = weight * color;
      Side& of = side < 0 ? node.front : node.behind;
      of.colors += weighted;
      of.squares += weighted * color;
      if (values_) of.values += weight * sample_values_[i];
    }
  }
  return node;
}

OutlineMatte::Mixture OutlineMatte::at(int u, int v) const {
  const Rgb own = picture_.radiance(static_cast<std::size_t>(v * width_ + u));
  const bool unknown = !depth_.known(u, v);
  const float outside_px = away_.at(u - corner_.x, v - corner_.y);
  if (!unknown && outside_px < -static_cast<float>(reach_.matte_px)) return {1, own, own, own, false, true};
  const float prior = unknown ? 0.5f : normal_cdf(-outside_px / reach_.sigma_px);
  Node sums;
  for_each_node(u, v, [&](int column, int row, float weight) {
    const Node& node = nodes_[static_cast<std::size_t>(node_of_[index(column, row)])];
    const Simd4 w = broadcast(weight);
    const auto add = [&](const Side& from, Side& to) {
      to.colors += w * from.colors;
      to.squares += w * from.squares;
      to.values += w * from.values;
    };
    add(node.front, sums.front);
    add(node.behind, sums.behind);
  });
  const Rgb own_noise = kCompose.matte_noise * kCompose.matte_noise * own.square();
  const bool any_front = sums.front.colors[0] > 0, any_behind = sums.behind.colors[0] > 0;
  if (!any_front || !any_behind) {
    // As in the shadow that a hand throws in the light of a depth camera's projector.
    float alpha = prior;
    if (unknown && any_front) alpha = probability_of({sums.front.colors, sums.front.squares}, own, own_noise);
    if (unknown && any_behind) alpha = 1 - probability_of({sums.behind.colors, sums.behind.squares}, own, own_noise);
    return {alpha, own, own, own, false, outside_px < 0};
  }
  const MeansOfSide front(sums.front.colors, sums.front.squares), behind(sums.behind.colors, sums.behind.squares);
  const Rgb apart = front.color - behind.color;
  // The precision of α by colour, channels being independent, and by depth.
  const Rgb noise = prior * front.variance + (1 - prior) * behind.variance + own_noise;
  const Rgb precision = apart.square() / noise.max(std::numeric_limits<float>::min());
  const float by_color = precision.sum();
  const float by_depth = 1 / std::max(prior * (1 - prior), 1e-4f);
  const float sum = (precision * (own - behind.color) / (apart.abs() > 0).select(apart, Rgb::Ones())).sum();
  const float alpha = std::clamp((sum + by_depth * prior) / (by_color + by_depth), 0.0f, 1.0f);
  return {alpha,
          own,
          front.color,
          behind.color,
          true,
          outside_px < 0,
          channels(sums.front.values) / sums.front.colors[0],
          channels(sums.behind.values) / sums.behind.colors[0]};
}

}  // namespace lumigraft::relight
