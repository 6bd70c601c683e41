#pragma once
// A quantity measured over a parameter that makes a method fail, with the reference curve.
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {

struct Curve {
  std::string name;
  std::vector<double> y = {};  ///< one for each x
  bool answer = false;         ///< drawn dashed: closed form or path tracer
};

struct Sweep {
  std::string stem;  ///< base name of its files
  std::string title, x_label, y_label;
  std::vector<double> x;
  std::vector<Curve> curves = {};
  bool logarithmic = false;  ///< x
  /// Bounds of the measured curves, drawn as horizontal lines; NaN: none.
  double min = std::numeric_limits<double>::quiet_NaN(), max = std::numeric_limits<double>::quiet_NaN();
};

/// Settings of the renderer: the plan's careful (1) and live (4) settings, and propagation.
struct Method {
  std::string name;
  relight::Plan plan;
};
std::vector<Method> methods(int volume, int bounces);

/// The path tracer's picture of the same scene, with its maps.
relight::RelitPicture reference(const ClosedScene& scene, int samples);

/// Visits the points of the plane z = 0 in the picture, with the change of radiance and the area of the plane per
/// pixel: visit(p, delta (RGB), area_m2).
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

/// Writes STEM.csv and a chart, STEM.svg and STEM.png, to the folder named by LUMIGRAFT_SWEEPS; does nothing if unset.
void write_sweep(const Sweep& sweep);

/// Sweeps run on Vulkan. That both devices draw the same is for the closed forms and DevicePictures to show.
#define ON_VULKAN(suite)                                                                           \
  INSTANTIATE_TEST_SUITE_P(On, suite, testing::Values(::lumigraft::relight::gpu::Backend::vulkan), \
                           ::lumigraft::relight::gpu::backend_label)

class SweepTest : public ClosedTest {
 protected:
  /// As in ClosedTest, with a relighter that is kept between pictures: creating one takes longer than a picture.
  relight::RelitPicture relit(const ClosedScene& scene, const relight::Plan& plan);
  /// The same, but with live settings the change is that of the served picture, which is rendered without maps and so
  /// with different lamp shadows.
  relight::RelitPicture served(const ClosedScene& scene, const relight::Plan& plan);
  /// Expects all measured curves within the sweep's bounds, and writes the sweep.
  void expect_within_bounds(const Sweep& sweep) const;

 private:
  std::unique_ptr<relight::Relighter> relighter_;
  capture::CameraModel model_;  ///< camera model of relighter_
};

}  // namespace lumigraft::test
