#pragma once
// A quantity measured over what makes a method fail, beside the answer.
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {

struct Curve {
  std::string name;
  std::vector<double> y = {};  ///< one for each x
  bool answer = false;         ///< drawn dashed: a closed form or the reference
};

struct Sweep {
  std::string stem;  ///< of its files
  std::string title, x_label, y_label;
  std::vector<double> x;
  std::vector<Curve> curves = {};
  bool logarithmic = false;  ///< x
  /// What the measured curves may reach, drawn as lines across; NaN: none.
  double least = std::numeric_limits<double>::quiet_NaN(), most = std::numeric_limits<double>::quiet_NaN();
};

/// How the renderer is asked to work: what the plan calls careful (1) and live (4), and propagation.
struct Method {
  std::string name;
  relight::Plan plan;
};
std::vector<Method> methods(int volume, int bounces);

/// What the path tracer makes of the same scene, with its maps.
relight::RelitPicture reference(const ClosedScene& scene, int samples);

/// Points of the plane z = 0 that the picture shows, with the change of their radiance and the plane's area that a
/// pixel covers: visit(p, delta (RGB), area_m2).
template <typename Visit>
void for_each_floor_pixel(const ClosedScene& scene, const relight::RelitPicture& picture, const Visit& visit) {
  const relight::RelightMaps& maps = *picture.maps;
  const Eigen::Vector3f forward = (scene.look_at_m - scene.eye_m).normalized();
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      if (maps.mask.at(u, v) > 0) continue;
      const Eigen::Vector3f p = scene.on_plane(u, v), to = p - scene.eye_m;
      if ((to.z() > 0) == (scene.eye_m.z() > 0) || !scene.extent.contains(p)) continue;
      const float z = forward.dot(to), f = static_cast<float>(scene.focal_px);
      const Eigen::Vector3f delta(maps.delta.at(u, v, 0), maps.delta.at(u, v, 1), maps.delta.at(u, v, 2));
      visit(p, delta, z * z * z / (f * f * std::abs(to.z())));
    }
  }
}

/// STEM.csv and a chart, STEM.svg and STEM.png, in the folder that LUMIGRAFT_SWEEPS names; nothing without it.
void write_sweep(const Sweep& sweep);

/// Sweeps run on both devices, with the same bounds. What is written is Vulkan's.
class SweepTest : public ClosedTest {
 protected:
  /// As ClosedTest's, by a relighter that is kept from picture to picture: to make one takes longer than a picture.
  relight::RelitPicture relit(const ClosedScene& scene, const relight::Plan& plan);
  /// The same, but of live settings the change is that of the picture as it is served, which is made without maps: its
  /// lamps' shadows are others.
  relight::RelitPicture served(const ClosedScene& scene, const relight::Plan& plan);
  void write(const Sweep& sweep) const {
    if (GetParam() == relight::gpu::Backend::vulkan) write_sweep(sweep);
  }
  /// Expects every value of the curves that are no answer within the sweep's bounds, and writes it.
  void expect_within_bounds(const Sweep& sweep) const;

 private:
  std::unique_ptr<relight::Relighter> relighter_;
  capture::CameraModel model_;  ///< its
};

}  // namespace lumigraft::test
