#pragma once
// Space in which something moved a moment ago. Fusion may hold surface there that is gone, while what moved hides that
// from the camera; and parts of what came.
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>

#include "capture/camera/depth_noise.h"
#include "capture/image.h"
#include "reconstruct/field/distance_field.h"
#include "relight/compose/free_space.h"
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

class RecentlyMoved {
 public:
  /// `moved`: a frame's; `fused`: the room's pixels that they replace, in the same order. `settled`: whether fusion
  /// holds such a pixel's surface in full.
  void add(const MovedPixels& moved, const MovedPixels& fused,
           const std::function<bool(const GBufferPixel& fused)>& settled, std::int64_t time_ns);
  bool contains(const Eigen::Vector3f& p_m) const;         ///< or is next to it
  const Eigen::AlignedBox3f& box() const { return box_; }  ///< encloses all of it; empty: nothing moved
  /// Whether something came there: it moved in front of settled surface. At the beginning of a session nothing is
  /// settled, and noise shows what is being fused as moved.
  bool came_to(const Eigen::Vector3f& p_m) const;  ///< or is next to it
  bool any_came() const { return !came_box_.isEmpty(); }

 private:
  struct Cell {
    std::int64_t last_ns;
    std::optional<std::int64_t> came_ns;
  };
  using Cells = std::unordered_map<reconstruct::BrickKey, Cell, reconstruct::BrickKeyHash>;

  Cells cells_;
  Eigen::AlignedBox3f box_, came_box_;
};

/// Fused surface of what came a moment ago, of which fusion holds a part: this frame's depth shows all of it, and its
/// colour is that of the picture.
class ArrivedSurface {
 public:
  /// `field`: the room's.
  ArrivedSurface(const RecentlyMoved& recent, std::shared_ptr<const reconstruct::DistanceField> field,
                 const capture::DepthNoise& noise)
      : recent_(recent), field_(std::move(field)), noise_(noise) {}

  const RecentlyMoved& recent() const { return recent_; }
  bool any() const { return recent_.any_came() && field_; }
  /// `p_m`: on fused surface, tag frame; `depth_m`: of this camera.
  bool contains(const Eigen::Vector3f& p_m, float depth_m) const {
    return recent_.came_to(p_m) && updates(*field_, noise_, p_m, depth_m) == Updates::some;
  }
  /// Whether fusion holds surface in full.
  static bool is_settled(const reconstruct::DistanceField& field, const capture::DepthNoise& noise,
                         const Eigen::Vector3f& p_m, float depth_m) {
    return updates(field, noise, p_m, depth_m) == Updates::enough;
  }

 private:
  enum class Updates { none, some, enough };
  static Updates updates(const reconstruct::DistanceField& field, const capture::DepthNoise& noise,
                         const Eigen::Vector3f& p_m, float depth_m);

  RecentlyMoved recent_;
  std::shared_ptr<const reconstruct::DistanceField> field_;
  capture::DepthNoise noise_;
};

/// Where fused surface is not there now: this frame's camera sees through it, or something moved there a moment ago
/// that this frame does not show, or it is what fusion holds of what has arrived, which this frame's depth replaces.
class GoneSpace {
 public:
  /// `camera`: whose pixels `depth` has; it must have some. `arrived`: until this frame.
  GoneSpace(const PosedCamera& camera, const CurrentDepth& depth, ArrivedSurface arrived);

  /// Of a point on fused surface, tag frame.
  bool contains(const Eigen::Vector3f& p_m) const;
  /// Encloses where something moved a moment ago; empty: nothing did.
  const Eigen::AlignedBox3f& recent_box() const { return arrived_.recent().box(); }

 private:
  ArrivedSurface arrived_;
  FreeSpace free_;
  /// Nothing is nearer than the first of these depths along z, and nothing behind the second is seen; 0: unknown.
  capture::Image<float> free_z_m_, hidden_z_m_;
};

}  // namespace lumigraft::relight
