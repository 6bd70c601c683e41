#pragma once
// A hand drawn of capsules, for mattes.
#include <Eigen/Core>
#include <algorithm>
#include <array>

namespace lumigraft::test {

struct Capsule {
  Eigen::Vector2f from_px, to_px;
  float radius_px;

  float distance_px(const Eigen::Vector2f& p) const {
    const Eigen::Vector2f along = to_px - from_px;
    const float t = std::clamp((p - from_px).dot(along) / along.squaredNorm(), 0.0f, 1.0f);
    return (p - from_px - t * along).norm() - radius_px;
  }
};

/// A forearm from the right, a palm and four fingers, for an image of 320 × 240 pixels times `scale`.
class DrawnHand {
 public:
  explicit DrawnHand(const Eigen::Vector2f& by_px, float scale = 1) {
    for (Capsule& part : parts_) {
      part.from_px = scale * (part.from_px + by_px);
      part.to_px = scale * (part.to_px + by_px);
      part.radius_px *= scale;
    }
  }

  /// From its outline, negative inside.
  float distance_px(const Eigen::Vector2f& p) const {
    float nearest = parts_[0].distance_px(p);
    for (const Capsule& part : parts_) nearest = std::min(nearest, part.distance_px(p));
    return nearest;
  }

 private:
  std::array<Capsule, 6> parts_{{{{190, 120}, {330, 100}, 16},
                                 {{150, 122}, {185, 120}, 18},
                                 {{105, 100}, {145, 112}, 3.5f},
                                 {{95, 114}, {145, 118}, 3.5f},
                                 {{98, 130}, {145, 126}, 3.5f},
                                 {{110, 146}, {145, 133}, 3}}};
};

}  // namespace lumigraft::test
