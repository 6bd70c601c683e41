#include "reconstruct/field/seen_space.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "reconstruct/field/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const FieldParameters::SeenSpace& kSeenSpace = kFieldParameters.seen_space;

}  // namespace

SeenSpace::SeenSpace(std::span<const Eigen::Vector2f> rays, std::span<const float> inverse_depth, int width,
                     const Eigen::Isometry3f& T_tag_camera, float voxel_m)
    : T_camera_tag_(T_tag_camera.inverse()),
      margin_m_(kSeenSpace.margin_voxels * voxel_m),
      columns_(std::max(1, width / kSeenSpace.cell_px)) {
  Eigen::AlignedBox2f box;
  for (const Eigen::Vector2f& ray : rays)
    if (ray.allFinite()) box.extend(ray);
  if (box.isEmpty()) return;
  rows_ = std::max(1, static_cast<int>(rays.size()) / width / kSeenSpace.cell_px);
  low_ = box.min();
  // The largest ray belongs to the last cell.
  const Eigen::Vector2f size = box.sizes().cwiseMax(1e-6f) * 1.0001f;
  per_tangent_ = Eigen::Vector2f(static_cast<float>(columns_), static_cast<float>(rows_)).cwiseQuotient(size);
  depth_m_.assign(static_cast<std::size_t>(columns_ * rows_), 0.0f);
  measure(rays, inverse_depth);
  fill_unmeasured();
  spread_near_surfaces();
}

void SeenSpace::measure(std::span<const Eigen::Vector2f> rays, std::span<const float> inverse_depth) {
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!rays[i].allFinite() || !(inverse_depth[i] > 0)) continue;
    const Eigen::Vector2i cell = (rays[i] - low_).cwiseProduct(per_tangent_).cast<int>();
    float& nearest = depth_m_[static_cast<std::size_t>(cell.y() * columns_ + cell.x())];
    const float depth_m = 1 / inverse_depth[i];
    nearest = nearest > 0 ? std::min(nearest, depth_m) : depth_m;
  }
}

std::vector<float> SeenSpace::nearest_around() const {
  std::vector<float> nearest_m = depth_m_;
  std::replace(nearest_m.begin(), nearest_m.end(), 0.0f, std::numeric_limits<float>::infinity());
  const cv::Mat cells(rows_, columns_, CV_32F, nearest_m.data());
  cv::erode(cells, cells, cv::Mat());
  return nearest_m;
}

/// Holes of one cell take the nearest depth around them.
void SeenSpace::fill_unmeasured() {
  const std::vector<float> nearest_m = nearest_around();
  for (std::size_t i = 0; i < depth_m_.size(); ++i)
    if (depth_m_[i] == 0 && std::isfinite(nearest_m[i])) depth_m_[i] = nearest_m[i];
}

/// A cell next to the outline of a nearer surface takes its depth; a slope is no outline.
void SeenSpace::spread_near_surfaces() {
  const std::vector<float> nearest_m = nearest_around();
  for (std::size_t i = 0; i < depth_m_.size(); ++i)
    if (nearest_m[i] < (1 - kSeenSpace.min_jump) * depth_m_[i] - margin_m_) depth_m_[i] = nearest_m[i];
}

std::optional<bool> SeenSpace::hides(const Eigen::Vector3f& position_m) const {
  const Eigen::Vector3f p = T_camera_tag_ * position_m;
  if (rows_ == 0 || !(p.z() > 0)) return std::nullopt;
  const Eigen::Vector2f cell = (p.head<2>() / p.z() - low_).cwiseProduct(per_tangent_);
  if (!(cell.x() >= 0 && cell.y() >= 0 && cell.x() < static_cast<float>(columns_) &&
        cell.y() < static_cast<float>(rows_)))
    return std::nullopt;
  const float nearest_m =
      depth_m_[static_cast<std::size_t>(static_cast<int>(cell.y()) * columns_ + static_cast<int>(cell.x()))];
  if (!(nearest_m > 0)) return std::nullopt;
  return p.z() > nearest_m - margin_m_;
}

bool hidden_from_all(const std::vector<std::shared_ptr<const SeenSpace>>& views, const Eigen::Vector3f& position_m) {
  bool hidden = false;
  for (const std::shared_ptr<const SeenSpace>& view : views) {
    const std::optional<bool> here = view->hides(position_m);
    if (here && !*here) return false;
    hidden |= here.has_value();
  }
  return hidden;
}

}  // namespace lumigraft::reconstruct
