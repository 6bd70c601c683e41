// Reflections of lamps in flat known surfaces: light that reaches an object's underside via a plate below it.
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "relight/reference/reference_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {
namespace {

constexpr float kPlate_m = 0.45f;                   // half an edge
constexpr float kLow_m = 0.2f, kHalfSlab_m = 0.1f;  // the slab above the plate
constexpr float kSlab = 0.2f;                       // its albedo

/// A square plate on the floor and a slab above it that does not occlude the path from lamp to plate to slab; no other
/// light.
struct PlateScene : ClosedScene {
  TemporaryFolder folder;
  capture::RealSurface plate;

  PlateScene() {
    eye_m = {0, -0.6f, 0.03f};
    look_at_m = {0, 0, 0.17f};
    sky = albedo = 0;
    radiance = [](const Eigen::Vector3f&) { return 0.0f; };
    lamps = {lamp_at({0.5f, 0, 0.6f}, 0.06f, 9)};
    exhibit.objects = {
        box_object({-kHalfSlab_m, -kHalfSlab_m, kLow_m}, {kHalfSlab_m, kHalfSlab_m, kLow_m + 0.03f}, kSlab)};
    plate.metallic = plate.specular = 1;
    plate.base_color.setConstant(0.9f);
    plate.roughness = 0.05f;
  }

  capture::Session with_plate() const {
    const std::string h = std::to_string(kPlate_m);
    capture::Session s = session();
    s.real_surfaces = {plate};
    s.real_surfaces[0].mesh =
        folder.write("plate.ply",
                     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                     "element face 2\nproperty list uchar int vertex_indices\nend_header\n-" +
                         h + " -" + h + " 0\n" + h + " -" + h + " 0\n" + h + " " + h + " 0\n-" + h + " " + h +
                         " 0\n3 0 1 2\n3 0 2 3\n");
    s.tag.size_m = 0.01;
    return s;
  }
};

/// Calls `visit(u, v, p)` for pixels entirely on the slab's underside.
template <typename Visit>
int underside(const PlateScene& scene, const relight::RelitPicture& picture, Visit visit) {
  int count = 0;
  for (int v = 1; v + 1 < scene.height; ++v) {
    for (int u = 1; u + 1 < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v, kLow_m);
      const bool far = p.y() < scene.eye_m.y() || p.head<2>().cwiseAbs().maxCoeff() > 0.9f * kHalfSlab_m;
      if (far || picture.maps->mask.at(u, v) < 1) continue;
      visit(u, v, p);
      ++count;
    }
  }
  return count;
}

class ClosedMirror : public ClosedTest {};
ON_BOTH_DEVICES(ClosedMirror);

// A perfect mirror shows the lamp as far below it as it is above: E = F I cos θ / d², d the path length via the mirror.
TEST_P(ClosedMirror, ALampIsReflectedByAMirror) {
  const PlateScene scene;
  relight::Relighter relighter(device_, scene.with_plate());
  const relight::RelitPicture picture = scene.relit(relighter, careful_plan());
  ASSERT_TRUE(picture.maps);
  double worst = 0, sum = 0, expected_sum = 0;
  const Eigen::Vector3f image(scene.lamps[0].position_m.cwiseProduct(Eigen::Vector3f(1, 1, -1)));
  const int count = underside(scene, picture, [&](int u, int v, const Eigen::Vector3f& p) {
    const Eigen::Vector3f way = image - p;
    const float cosine = -way.normalized().z();
    const float fresnel = 0.9f + 0.1f * std::pow(1 - cosine, 5.0f);
    const float expected =
        kSlab / std::numbers::pi_v<float> * fresnel * scene.lamps[0].intensity.x() * cosine / way.squaredNorm();
    const float found = picture_radiance(picture, u, v);
    worst = std::max<double>(worst, std::abs(found / expected - 1));
    sum += found;
    expected_sum += expected;
  });
  std::printf("underside: %.4f of the closed form over %d pixels, worst off by %.3f\n", sum / expected_sum, count,
              worst);
  EXPECT_GT(count, 100);
  EXPECT_NEAR(sum / expected_sum, 1, 0.02);
  EXPECT_LT(worst, 0.05);
}

TEST_P(ClosedMirror, APlateThatReflectsNothingGivesNone) {
  PlateScene scene;
  scene.plate.metallic = scene.plate.specular = 0;
  scene.plate.base_color.setZero();
  relight::Relighter relighter(device_, scene.with_plate());
  const relight::RelitPicture picture = scene.relit(relighter, careful_plan());
  const int count = underside(
      scene, picture, [&](int u, int v, const Eigen::Vector3f&) { EXPECT_LT(picture_radiance(picture, u, v), 2e-3f); });
  EXPECT_GT(count, 100);
}

// A plate too small to show the lamp's reflection gives no light.
TEST_P(ClosedMirror, TheImageEndsWithThePlate) {
  PlateScene scene;
  scene.lamps[0].position_m = {3, 0, 0.6f};  // seen from the slab, it is mirrored 0.7 m from the middle
  scene.lamps[0].intensity *= 8;
  relight::Relighter relighter(device_, scene.with_plate());
  const relight::RelitPicture picture = scene.relit(relighter, careful_plan());
  EXPECT_GT(underside(scene, picture,
                      [&](int u, int v, const Eigen::Vector3f&) { EXPECT_LT(picture_radiance(picture, u, v), 5e-3f); }),
            100);
}

class ClosedMirrorPaths : public ClosedTest {};
INSTANTIATE_TEST_SUITE_P(On, ClosedMirrorPaths, testing::Values(relight::gpu::Backend::vulkan),
                         relight::gpu::backend_label);

// At every roughness of the plate, the underside is as bright as with path tracing; also for a panel and a distant
// lamp.
TEST_P(ClosedMirrorPaths, LightAsMuchAtEveryRoughness) {
  struct Case {
    const char* name;
    float roughness, metallic;
    int lamp;
  };
  constexpr std::array<Case, 9> cases{{{"bulb, metal", 0.05f, 1, 0},
                                       {"bulb, metal", 0.2f, 1, 0},
                                       {"bulb, metal", 0.4f, 1, 0},
                                       {"bulb, metal", 0.6f, 1, 0},
                                       {"bulb, metal", 1.0f, 1, 0},
                                       {"panel, metal", 0.3f, 1, 1},
                                       {"distant, metal", 0.3f, 1, 2},
                                       {"bulb, varnish", 0.1f, 0, 0},
                                       {"bulb, varnish", 0.5f, 0, 0}}};
  for (const Case& c : cases) {
    PlateScene scene;
    scene.width = 48;
    scene.height = 36;
    scene.focal_px = 40;
    scene.plate.roughness = c.roughness;
    scene.plate.metallic = c.metallic;
    if (c.metallic == 0) scene.plate.base_color.setZero();
    reconstruct::PointLight& lamp = scene.lamps[0];
    lamp.radius_m = 0.12f;
    if (c.metallic == 0) lamp.intensity *= 12;
    if (c.lamp > 0) {
      const Eigen::Vector3f probe(0, 0, 0.3f), to = lamp.position_m - probe;
      lamp.direction = to.normalized();
      lamp.flat = c.lamp == 1;
      lamp.normal = Eigen::Vector3f(-0.5f, 0, -1).normalized();
      lamp.distance_known = c.lamp == 1;
      lamp.angular_radius_rad = 0.2f;
      lamp.irradiance.setConstant(lamp.intensity.x() / to.squaredNorm());
    }
    relight::Relighter relighter(device_, scene.with_plate());
    const relight::RelitPicture picture = scene.relit(relighter, careful_plan(32));
    relight::ReferenceRenderer reference(scene.with_plate());
    relight::Plan paths;
    paths.method = "reference";
    paths.samples = 128;
    const relight::RelitPicture truth = reference.relight(scene.frame(), scene.scene(), scene.exhibit, paths, true);
    double found = 0, wanted = 0;
    const int count = underside(scene, picture, [&](int u, int v, const Eigen::Vector3f&) {
      found += picture_radiance(picture, u, v);
      wanted += picture_radiance(truth, u, v);
    });
    std::printf("%s of roughness %.2f: %.3f of the reference (%.3f) over %d pixels\n", c.name, c.roughness,
                found / wanted, wanted / count, count);
    EXPECT_GT(count, 30);
    // The roughest lobe is as wide as the hemisphere: slopes drawn as if in proportion to places fit it least.
    EXPECT_NEAR(found / wanted, 1, c.roughness < 1 ? 0.06 : 0.1) << c.name << " " << c.roughness;
  }
}

}  // namespace
}  // namespace lumigraft::test
