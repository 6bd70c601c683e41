#pragma once
// Density of photons on surfaces (Jensen 1996, "Global Illumination using Photon Maps"). Each photon spreads its power
// over a disc whose radius is the distance to its k-th neighbour, with a kernel of unit integral (Silverman 1986, §5.3,
// adaptive kernels): on a plane the power is that of the photons exactly, wherever they are dense or sparse. At edges
// of a surface, what the discs spread beyond it is lost.
#include <array>
#include <cstdint>
#include <vector>

#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

struct Photon {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, geometric, of the surface, on the side that it hit
  Eigen::Vector3f w = -Eigen::Vector3f::UnitZ();      ///< unit, in which it travels
  Rgb power_W = Rgb::Zero();
};

class PhotonMap {
 public:
  PhotonMap() = default;
  explicit PhotonMap(std::vector<Photon> photons);

  bool empty() const { return photons_.empty(); }

  /// Calls `visit(photon, density)` for photons that reach a point of a surface on the side of its normal; density: of
  /// their power, 1/m².
  template <typename Visit>
  void for_each_near(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal, Visit visit) const {
    if (nodes_.empty()) return;
    std::array<std::uint32_t, kMaxDepth> stack;
    std::size_t size = 0;
    stack[size++] = 0;
    while (size > 0) {
      const Node& node = nodes_[stack[--size]];
      if ((p_m.array() < node.low_m.array()).any() || (p_m.array() > node.high_m.array()).any()) continue;
      if (node.second != 0) {
        stack[size++] = node.first;
        stack[size++] = node.second;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const float r2 = radii2_m2_[i], d2 = (photons_[i].position_m - p_m).squaredNorm();
        if (!(d2 < r2) || !(photons_[i].normal.dot(normal) > 0) || !(photons_[i].w.dot(normal) < 0)) continue;
        visit(photons_[i], kernel(d2 / r2) / r2);
      }
    }
  }

  /// W/m²
  Rgb irradiance(const Eigen::Vector3f& p_m, const Eigen::Vector3f& normal) const {
    Rgb sum = Rgb::Zero();
    for_each_near(p_m, normal, [&](const Photon& photon, float density) { sum += density * photon.power_W; });
    return sum;
  }

 private:
  static constexpr std::size_t kMaxDepth = 64;
  /// Of Epanechnikov, in two dimensions, on the unit disc (Silverman 1986, eq. 4.4).
  static float kernel(float d2) { return 2 / 3.14159265f * (1 - d2); }

  /// Of a tree of boxes around discs; a leaf has no second child, and photons from `first` on.
  struct Node {
    Eigen::Vector3f low_m = Eigen::Vector3f::Zero(), high_m = Eigen::Vector3f::Zero();
    std::uint32_t first = 0, second = 0, count = 0;
  };
  std::uint32_t divide(std::uint32_t first, std::uint32_t count);
  void bound(std::uint32_t node);
  float neighbour2_m2(std::uint32_t photon) const;

  std::vector<Photon> photons_;
  std::vector<float> radii2_m2_;
  std::vector<Node> nodes_;
};

}  // namespace lumigraft::relight
