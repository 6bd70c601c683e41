// Objects that extend outside the lens's field of view: into its fold, to the side of the camera and behind it.
#include <algorithm>
#include <cmath>

#include "relight/objects/mesh_refine.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// A horizontal view over a floor.
struct LensScene : ClosedScene {
  capture::Session lens;

  LensScene() {
    width = 96;
    height = 72;
    focal_px = 100;
    eye_m = {0, -0.9f, 0.5f};
    look_at_m = {0, 0, 0.45f};
    sky = 0.3f;
    lens = session();
  }

  /// Takes a point in the camera's frame.
  Vector3f in_tag(const Vector3f& camera_m) const { return (T_tag_camera() * camera_m.cast<double>()).cast<float>(); }
};

/// Whether the ray intersects an object.
using RayHits = std::function<bool(const Vector3f& from, const Vector3f& w)>;

struct Compared {
  int inside = 0, outside = 0;  ///< number of pixels whose rays all hit objects, or all miss them
};

/// Checks the mask at pixels whose rays agree.
Compared expect_as_rays(const LensScene& scene, const capture::Image<float>& mask, const RayHits& hits) {
  Compared compared;
  const Vector3f eye = scene.eye_m;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      int met = 0;
      for (int i = 0; i < 9; ++i) {
        const auto ray = scene.lens.color.model.unproject({u + 0.8 * (i % 3 - 1), v + 0.8 * (i / 3 - 1)});
        if (!ray) {
          ADD_FAILURE() << "the lens shows the whole picture";
          return compared;
        }
        met += hits(eye, (scene.T_tag_camera().linear() * *ray).cast<float>());
      }
      if (met > 0 && met < 9) continue;
      EXPECT_EQ(mask.at(u, v), met > 0 ? 1 : 0) << u << ", " << v;
      ++(met > 0 ? compared.inside : compared.outside);
    }
  }
  return compared;
}

class CameraVertex : public ClosedTest {
 protected:
  capture::Image<float> mask_of(const LensScene& scene) {
    relight::Relighter relighter(device_, scene.lens);
    return scene.relit(relighter, careful_plan(32, 1)).maps->mask;
  }
};
ON_BOTH_DEVICES(CameraVertex);

// With k1 = -0.3 radii grow up to 1.05 only: 1.6 would show at 0.37, within the picture.
TEST_P(CameraVertex, WhatIsBeyondTheFoldOfALensShowsNowhere) {
  LensScene scene;
  scene.lens.color.model.distortion = {-0.3, 0, 0, 0, 0};
  for (const Vector3f& direction : {Vector3f(1.6f, 0, 1), Vector3f(-1.1f, -1.1f, 1), Vector3f(0.1f, -1.6f, 1)}) {
    scene.exhibit.objects = {sphere_object(0.05f, scene.in_tag(0.35f * direction), 0.7f)};
    const capture::Image<float> mask = mask_of(scene);
    EXPECT_EQ(std::count_if(mask.data.begin(), mask.data.end(), [](float covered) { return covered > 0; }), 0)
        << direction.transpose();
  }
}

TEST_P(CameraVertex, WhatCrossesTheFoldAppearsWhereRaysHitIt) {
  LensScene scene;
  scene.lens.color.model.distortion = {-0.3, 0, 0.002, -0.001, 0};
  constexpr float radius_m = 0.25f;
  const Vector3f centre = scene.in_tag(0.55f * Vector3f(0.8f, -0.1f, 1));
  scene.exhibit.objects = {sphere_object(radius_m, centre, 0.7f)};
  const Compared compared = expect_as_rays(scene, mask_of(scene), [&](const Vector3f& from, const Vector3f& w) {
    return (centre - from).cross(w.normalized()).norm() < radius_m && (centre - from).dot(w) > 0;
  });
  EXPECT_GT(compared.inside, 300);
  EXPECT_GT(compared.outside, 3000);
}

// A beam that passes the camera. Lens distortion bends straight edges in the image only if triangles are small.
TEST_P(CameraVertex, WhatReachesBehindTheCameraAppearsWhereRaysHitIt) {
  for (const double k1 : {0.0, -0.3}) {
    LensScene scene;
    scene.lens.color.model.distortion[0] = k1;
    const Eigen::AlignedBox3f beam(Vector3f(0.1f, -2.5f, 0.36f), Vector3f(0.2f, 0.3f, 0.46f));
    scene.exhibit.objects = {box_object(beam.min(), beam.max(), 0.7f)};
    if (k1 != 0) scene.exhibit.objects[0].model = relight::refine_model(*scene.exhibit.objects[0].model, 0.03f);
    const Compared compared = expect_as_rays(scene, mask_of(scene), [&](const Vector3f& from, const Vector3f& w) {
      const Eigen::Array3f a = (beam.min() - from).array() / w.array(), b = (beam.max() - from).array() / w.array();
      const float enter = a.min(b).maxCoeff(), leave = a.max(b).minCoeff();
      return enter < leave && leave > 0;
    });
    EXPECT_GT(compared.inside, 200) << k1;
    EXPECT_GT(compared.outside, 2000) << k1;
  }
}

}  // namespace
}  // namespace lumigraft::test
