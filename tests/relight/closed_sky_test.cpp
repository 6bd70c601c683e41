// Under an even sky: what a surface sees has the same radiance everywhere, so form factors are all there is.
#include <cmath>

#include "closed_scene.h"

namespace lumigraft::test {
namespace {

class ClosedSky : public ClosedTest {};

/// Mean and largest magnitude over pixels of a picture.
struct Spread {
  double sum = 0, most = 0;
  int count = 0;
  void add(double x) {
    sum += x;
    most = std::max(most, std::abs(x));
    ++count;
  }
  double mean() const { return sum / count; }
};

// Furnace: where sky and floor send out L everywhere and nothing absorbs, an object sends out L too, and nothing
// changes. Bounces are gathered in rounds, each from the last one's light: in the first the object is dark to the
// floor, so that with two the object misses what the floor misses of it, with three the floor what the object did. Each
// round the rest shrinks by the form factor between the two, F = (r/h)² = 0.44 right below the ball and 0.1 on the
// mean.
TEST_F(ClosedSky, FurnaceStaysEven) {
  constexpr float radiance = 0.5f;
  ClosedScene scene;
  scene.albedo = 1;
  scene.sky = radiance;
  scene.radiance = [](const Eigen::Vector3f&) { return radiance; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.15f}, 1)};
  for (const int bounces : {2, 3}) {
    SCOPED_TRACE(bounces);
    const RelitPicture picture = relit(scene, careful_plan(32, bounces));
    Spread object, floor;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const float covered = picture.maps->mask.at(u, v);
        if (covered == 1) object.add(picture_radiance(picture, u, v) / radiance - 1);
        if (covered == 0) floor.add(picture.maps->delta.at(u, v) / radiance);
      }
    }
    EXPECT_GT(object.count, 150);
    EXPECT_LT(object.most, bounces == 2 ? 0.05 : 0.015);  // a code value is 0.9 % here
    EXPECT_LT(std::abs(object.mean()), 0.01);
    EXPECT_LT(floor.most, bounces == 2 ? 0.001 : 0.06);
    EXPECT_LT(std::abs(floor.mean()), 0.002);
  }
}

// A black ball hides its form factor of the sky from the floor: E = π L F with F = cos θ (r/d)², as long as it lies
// above the floor's horizon (Nusselt 1928: the cap's projection on the unit circle). Nothing else changes.
TEST_F(ClosedSky, BlackBallTakesItsFormFactor) {
  constexpr float albedo = 0.5f, sky = 1.0f, radius = 0.1f, height = 0.15f;
  ClosedScene scene;
  scene.albedo = albedo;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return albedo * sky; };
  scene.exhibit.objects = {sphere_object(radius, {0, 0, height}, 0)};
  for (const int volume : {32, 64}) {
    SCOPED_TRACE(volume);
    const RelitPicture picture = relit(scene, careful_plan(volume, 2));
    Spread relative, absolute;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const float covered = picture.maps->mask.at(u, v);
        if (covered == 1) {
          EXPECT_EQ(picture.srgb.at(u, v, 0), 0);
        }
        if (covered > 0) continue;
        const float d = (scene.on_plane(u, v) - Eigen::Vector3f(0, 0, height)).norm();
        const double want = -albedo * sky * height / d * (radius / d) * (radius / d);
        const double got = picture.maps->delta.at(u, v);
        absolute.add(got - want);
        // Changes of less than a code value, 0.004 at this radiance, fade out by intent.
        if (want < -0.01) relative.add(got / want - 1);
      }
    }
    EXPECT_GT(relative.count, 800);

    EXPECT_LT(std::abs(relative.mean()), 0.01);
    EXPECT_LT(relative.most, 0.06);  // right below the ball, where a share of the sky is wide
    EXPECT_LT(absolute.most, 0.015);
  }
}

}  // namespace
}  // namespace lumigraft::test
