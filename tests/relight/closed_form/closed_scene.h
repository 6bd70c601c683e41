#pragma once
// Rooms with closed-form solutions: analytic distance fields with known radiance and albedo, known lamps, a uniform
// sky.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>

#include "reconstruct/scene.h"
#include "relight/relighter.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::test {

struct ClosedScene {
  int width = 96, height = 72;
  double focal_px = 80;
  Eigen::Vector3f eye_m{0, -0.9f, 0.7f}, look_at_m{0, 0, 0};

  /// Distance to the room's surfaces, positive in free space; needs a unit gradient only near its zero.
  std::function<float(const Eigen::Vector3f&)> distance = [](const Eigen::Vector3f& p) { return p.z(); };
  Eigen::AlignedBox3f extent{Eigen::Vector3f(-0.9f, -0.9f, -0.1f), Eigen::Vector3f(0.9f, 0.9f, 0.1f)};  ///< known
  float voxel_m = 0.008f;
  float albedo = 0.5f;
  /// Radiance of a surface point: lamps, sky and all bounces; equals the camera's picture.
  std::function<float(const Eigen::Vector3f&)> radiance = [](const Eigen::Vector3f&) { return 0.5f; };
  float sky = 1.0f;  ///< radiance where there is no geometry
  std::vector<reconstruct::PointLight> lamps;
  relight::Exhibit exhibit;

  capture::Session session() const;
  capture::FrameSet frame() const;  ///< depth by sphere tracing from the eye
  reconstruct::Scene scene() const;
  Eigen::Isometry3d T_tag_camera() const;
  /// Intersection of the pixel's ray with the plane z = height.
  Eigen::Vector3f on_plane(int u, int v, float height_m = 0) const;
  relight::RelitPicture relit(relight::Renderer& renderer, const relight::Plan& plan) const;  ///< with its maps
};

/// Of a camera alone, for tests without a room.
capture::Session session_of(int width, int height, double focal_px);

/// A plan with the most accurate derived settings, with small volumes.
relight::Plan careful_plan(int volume = 64, int bounces = 2);

/// careful_plan for one of 16 pixels, as in live settings.
relight::Plan live_plan(int volume = 32);

/// careful_plan with few cones, for one of four pixels: fast, for what does not depend on accuracy.
relight::Plan coarse_plan();

/// A plan that gathers by rays, at one of trace_scale² pixels.
relight::Plan rays_plan(int trace_scale = 2, int rays = 20, int bounces = 2);

/// A lamp at a known position.
reconstruct::PointLight lamp_at(const Eigen::Vector3f& position_m, float radius_m, float intensity);
/// Irradiance on a surface: E = I cos θ / d², times a flat lamp's emission profile.
float irradiance(const reconstruct::PointLight& lamp, const Eigen::Vector3f& at_m, const Eigen::Vector3f& normal);

/// A Lambertian sphere of 40 × 80 facets with smooth normals.
relight::VirtualObject sphere_object(float radius_m, const Eigen::Vector3f& centre_m, float albedo);
relight::VirtualObject box_object(const Eigen::Vector3f& low_m, const Eigen::Vector3f& high_m, float albedo);

/// A white box on a grey floor next to a lamp: it reflects light to the floor, elsewhere as it rotates.
ClosedScene box_on_floor();

ClosedScene ball_under_lamp();

/// The same seen by a small camera, with the light of the lamp and of an even sky on the floor.
ClosedScene ball_under_lamp_and_sky();

/// A floor with the light that a lamp and an even sky give it, seen from near by a small camera; no object.
ClosedScene floor_under_lamp();

/// Signed distance to a box, negative inside.
float box_distance(const Eigen::AlignedBox3f& box, const Eigen::Vector3f& p_m);

/// Radiance of channel 0 of the picture, W/sr/m², with a resolution of half a pixel value.
float picture_radiance(const relight::RelitPicture& picture, int u, int v);

/// Its mean over the pixels that objects fill.
double mean_of_objects(const relight::RelitPicture& picture);

/// By the path tracer, with so many samples per pixel.
relight::RelitPicture traced(const ClosedScene& scene, int samples);

/// Tests of a suite run on both devices, one of each kind for all of them, with the validation layer or debug output
/// on. A suite declares ON_BOTH_DEVICES (device_fixture.h) and its tests are TEST_P.
class ClosedTest : public testing::TestWithParam<relight::gpu::Backend> {
 protected:
  ClosedTest() : device_(devices_[GetParam()]) {
    if (!device_) device_ = relight::gpu::create_device(GetParam(), {.validation = true});
  }
  static void TearDownTestSuite() { devices_.clear(); }
  relight::RelitPicture relit(const ClosedScene& scene, const relight::Plan& plan) const {
    relight::Relighter relighter(device_, scene.session());
    return scene.relit(relighter, plan);
  }
  std::shared_ptr<relight::gpu::Device>& device_;

 private:
  inline static std::map<relight::gpu::Backend, std::shared_ptr<relight::gpu::Device>> devices_;
};

}  // namespace lumigraft::test
