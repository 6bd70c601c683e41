// A glossy layer on a Lambertian body under a uniform sky.
#include <cmath>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

class ClosedGloss : public ClosedTest {};
ON_BOTH_DEVICES(ClosedGloss);

// Radiance of a polished box under a sky of radiance L: the layer's reflection, and the body's after two transmissions
// of the layer (Ashikhmin & Shirley 2000): L (F(n·v) + ρ (1 - F0 - (F90 - F0) / 21) (1 - F(n·v))), F by Schlick with F0
// = 0.04, F90 = 1.
TEST_P(ClosedGloss, AVarnishedBoxShowsItsLayerAndWhatPassesIt) {
  constexpr float sky = 0.6f, body = 0.5f, top_m = 0.1f, f0 = 0.04f;
  for (const float eye_z_m : {0.9f, 0.35f}) {
    SCOPED_TRACE(eye_z_m);
    ClosedScene scene;
    scene.sky = sky;
    scene.radiance = [](const Eigen::Vector3f&) { return 0.5f * sky; };
    scene.eye_m.z() = eye_z_m;
    scene.look_at_m.z() = top_m;
    scene.exhibit.objects = {box_object({-0.15f, -0.15f, 0}, {0.15f, 0.15f, top_m}, body)};
    relight::MaterialOverride& varnished = scene.exhibit.objects[0].material;
    varnished.specular = 1;
    varnished.roughness = 0.1f;
    const relight::RelitPicture picture = relit(scene, careful_plan(64, 1));
    int count = 0;
    double worst = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const Eigen::Vector3f p = scene.on_plane(u, v, top_m);
        if (p.head<2>().cwiseAbs().maxCoeff() > 0.12f) continue;
        const float cosine = (scene.eye_m - p).normalized().z(), f = f0 + (1 - f0) * std::pow(1 - cosine, 5.0f);
        const float want = sky * (f + body * (1 - f0 - (1 - f0) / 21) * (1 - f));
        worst = std::max<double>(worst, std::abs(picture_radiance(picture, u, v) / want - 1));
        ++count;
      }
    }
    EXPECT_GT(count, 100);
    EXPECT_LT(worst, 0.02);
  }
}

}  // namespace
}  // namespace lumigraft::test
