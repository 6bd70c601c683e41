#include "relight/views/upsample_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "reconstruct/math/simd4.h"
#include "relight/gather/parameters.h"
#include "relight/tracing/fast_exp.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using reconstruct::broadcast;
using reconstruct::Simd4;

Simd4 simd_of(const Rgb& light) { return Simd4{light[0], light[1], light[2], 0}; }

/// A change of light, three channels and 0: a part of the radiance, and what is added to that.
struct Change {
  Simd4 ratio, added;
};

class Upsampler {
 public:
  Upsampler(const RoomInView& low, const CameraRays& eye, const CurrentDepth& depth, const ObjectLayer& objects,
            const CameraUpload& picture, FullChange& full)
      : low_(low),
        seen_(low.surfaces),
        scale_(low.scale),
        width_(low.camera.width),
        height_(low.camera.height),
        eye_(eye),
        depth_(depth),
        objects_(objects),
        picture_(picture),
        full_(full),
        eye_m_(eye.camera.T_tag_camera.translation()),
        step_(1 / (255 * picture.exposure().maxCoeff())),
        right_(width_ > 1 ? 1 : 0),
        below_(height_ > 1 ? static_cast<std::size_t>(width_) : 0),
        changes_(low.surfaces.size()),
        cells_(low.surfaces.size()),
        covered_(low.surfaces.size()) {
    for_each_pixel(low.tiles, width_, height_, kRows, [&](int x, int y) {
      const auto i = static_cast<std::size_t>(y * width_ + x);
      changes_[i] = change_at(i);
      covered_[i] = is_covered(x, y, seen_[i]);
    });
    for_each_index(cells_.size(), kRows * width_, [&](std::size_t first) { cells_[first] = cell_at(first); });
    for (int u = 0; u < eye.camera.model.width; ++u) columns_.push_back(between(u, width_));
  }

  void row(int v) const {
    const int edge = scale_ * TileMask::kEdge, width = eye_.camera.model.width;
    const Between rows = between(v, height_);
    for (int x = 0; x < low_.tiles.across(); ++x) {
      if (!low_.tiles.tile(x, v / edge)) continue;
      for (int u = x * edge; u < std::min((x + 1) * edge, width); ++u) pixel(u, v, rows);
    }
  }

 private:
  /// Where a pixel is between two of the view.
  struct Between {
    std::size_t first;
    float next;  ///< weight of the one after it
  };
  /// Between four pixels of the view.
  struct Cell {
    Change apart;          ///< by which they differ at most
    bool changes = false;  ///< visibly
    bool even = false;     ///< they show one plane: none explains a pixel's depth better than another
  };
  using Weights = std::array<float, 4>;  ///< of upper left, upper right, lower left and lower right

  Between between(int pixel, int count) const {
    const float to_middle = 0.5f * static_cast<float>(scale_ - 1);
    const float at = (static_cast<float>(pixel) - to_middle) / static_cast<float>(scale_);
    const int first = std::clamp(static_cast<int>(std::floor(at)), 0, std::max(count - 2, 0));
    return {static_cast<std::size_t>(first), std::clamp(at - static_cast<float>(first), 0.0f, 1.0f)};
  }

  Change change_at(std::size_t i) const {
    const Simd4 change = simd_of(radiance_at(low_.change, i)), under = simd_of(radiance_at(low_.radiance, i));
    const bool glossy = seen_[i].glossy;
    const reconstruct::Simd4Int in_proportion =
        under > broadcast(glossy ? std::numeric_limits<float>::infinity() : step_);
    return {reconstruct::select(in_proportion, change / under, Simd4{}),
            reconstruct::select(in_proportion, Simd4{}, change)};
  }

  /// Whether an object hides the surface of a pixel of the view.
  bool is_covered(int x, int y, const ViewSurface& p) const {
    const capture::CameraModel& camera = eye_.camera.model;
    const auto i = objects_.index(std::min(x * scale_ + central_offset(scale_), camera.width - 1),
                                  std::min(y * scale_ + central_offset(scale_), camera.height - 1));
    return i && objects_.coverage.data[*i] >= 0.5f && !(p.known && p.depth_m < objects_.distance_m.data[*i]);
  }

  /// By the upper left one.
  std::array<std::size_t, 4> corners_of(std::size_t first) const {
    return {first, first + right_, first + below_, first + right_ + below_};
  }

  Cell cell_at(std::size_t first) const {
    if (first + right_ + below_ >= changes_.size()) return Cell();  // beyond the last row
    Change least = changes_[first], most = least;
    for (const std::size_t k : corners_of(first)) {
      least = {reconstruct::min(least.ratio, changes_[k].ratio), reconstruct::min(least.added, changes_[k].added)};
      most = {reconstruct::max(most.ratio, changes_[k].ratio), reconstruct::max(most.added, changes_[k].added)};
    }
    const Simd4 part = reconstruct::max(most.ratio, -least.ratio);
    const reconstruct::Simd4Int changes =
        (part > broadcast(kGather.visible_part)) | (least.added != Simd4{}) | (most.added != Simd4{}) | (part != part);
    Cell cell;
    cell.apart = {most.ratio - least.ratio, most.added - least.added};
    cell.changes = reconstruct::any(changes);
    cell.even = is_even(first);
    return cell;
  }

  bool is_even(std::size_t first) const {
    const ViewSurface& own = seen_[first];
    const float allowed_m = kGather.even_part * depth_.allowed_m(own.depth_m);
    return std::ranges::all_of(corners_of(first), [&](std::size_t k) {
      const ViewSurface& other = seen_[k];
      return own.known && other.known && !covered_[k] &&
             std::abs(own.normal.dot(other.position_m - own.position_m)) < allowed_m &&
             std::abs(other.normal.dot(own.position_m - other.position_m)) < allowed_m;
    });
  }

  void pixel(int u, int v, const Between& rows) const {
    const Between& columns = columns_[static_cast<std::size_t>(u)];
    const std::size_t first = rows.first * static_cast<std::size_t>(width_) + columns.first;
    const auto i = static_cast<std::size_t>(v * eye_.camera.model.width + u);
    const bool clips = picture_.clipped(i);
    const Cell& cell = cells_[first];
    if (!clips && !cell.changes) return;
    const std::array<std::size_t, 4> corners = corners_of(first);
    Rgb radiance = picture_.radiance(i);
    const Simd4 apart = cell.apart.ratio * simd_of(radiance) + cell.apart.added;
    const bool alike = cell.even || (!clips && !reconstruct::any(apart > broadcast(kGather.visible_codes * step_)));
    const Weights weight = weights(u, v, corners, columns.next, rows.next, alike);
    if (clips) restore(i, corners, weight, &radiance);
    Change mixed{};
    for (std::size_t k = 0; k < 4; ++k) {
      mixed.ratio += weight[k] * changes_[corners[k]].ratio;
      mixed.added += weight[k] * changes_[corners[k]].added;
    }
    const Simd4 change = mixed.ratio * simd_of(radiance) + mixed.added;
    set_at(full_.radiance, i, radiance);
    set_at(full_.change, i, {change[0], change[1], change[2]});
  }

  void restore(std::size_t i, const std::array<std::size_t, 4>& corners, const Weights& weight, Rgb* radiance) const {
    Rgb restored = Rgb::Zero();
    for (std::size_t k = 0; k < 4; ++k) restored += weight[k] * radiance_at(low_.radiance, corners[k]);
    for (std::size_t c = 0; c < 3; ++c) {
      float& channel = (*radiance)[static_cast<Eigen::Index>(c)];
      if (picture_.clipped(i, c)) channel = std::max(channel, restored[static_cast<Eigen::Index>(c)]);
    }
  }

  /// Their sum is 1. `alike`: it makes no visible difference which surfaces count.
  Weights weights(int u, int v, const std::array<std::size_t, 4>& corners, float right, float down, bool alike) const {
    Weights weight{(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down};
    if (alike) return weight;
    const float depth_m = depth_.at(u, v);
    const Eigen::Vector3f point_m = eye_m_ + depth_m * eye_.ray(u, v);
    float sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      weight[k] += kGather.block_unlike;
      if (depth_m > 0)
        weight[k] *= goes_through(point_m, depth_.allowed_m(depth_m), seen_[corners[k]]) + kGather.block_unlike;
      if (covered_[corners[k]]) weight[k] *= kGather.block_unlike;
      sum += weight[k];
    }
    for (float& w : weight) w /= sum;
    return weight;
  }

  /// How well the plane of a surface explains a point.
  static float goes_through(const Eigen::Vector3f& point_m, float allowed_m, const ViewSurface& p) {
    if (!p.known) return 0;
    const float off = p.normal.dot(point_m - p.position_m) / allowed_m;
    return fast_exp(off * off);
  }

  const RoomInView& low_;
  const std::vector<ViewSurface>& seen_;  ///< by pixel of the view, and so are all arrays unless noted
  int scale_, width_, height_;            ///< of the view
  const CameraRays& eye_;
  const CurrentDepth& depth_;
  const ObjectLayer& objects_;
  const CameraUpload& picture_;
  FullChange& full_;
  Eigen::Vector3f eye_m_;
  float step_;                 ///< radiance of one of 255 equal steps to the white of the picture, W/sr/m²
  std::size_t right_, below_;  ///< from a pixel of the view to its right and lower neighbour, 0 if there is none
  std::vector<Change> changes_;
  std::vector<Cell> cells_;  ///< by its upper left pixel
  std::vector<std::uint8_t> covered_;
  std::vector<Between> columns_;
};

}  // namespace

void upsample(const RoomInView& low, const CameraRays& eye, const CurrentDepth& depth, const ObjectLayer& objects,
              const CameraUpload& picture, FullChange& full) {
  const capture::CameraModel& model = eye.camera.model;
  for (capture::Image<float>* image : {&full.change, &full.radiance}) {
    if (image->width != model.width || image->height != model.height)
      *image = capture::Image<float>(model.width, model.height, 3);
    else
      std::fill(image->data.begin(), image->data.end(), 0.0f);
  }
  const Upsampler upsampler(low, eye, depth, objects, picture, full);
  for_each_index(model.height, kRows, [&](int v) { upsampler.row(v); });
}

}  // namespace lumigraft::relight
