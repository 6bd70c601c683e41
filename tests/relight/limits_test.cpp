// How much of a session a device holds.
#include <algorithm>

#include "relight/shaders/common/interop.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {
namespace {

/// A block on a polished plate, which is one known surface of several; the others are matt and lie out of sight.
struct BlockOnPlate : ClosedScene {
  TemporaryFolder folder;

  BlockOnPlate() {
    width = 48;
    height = 36;
    focal_px = 45;
    eye_m = {0, -0.6f, 0.4f};
    look_at_m = {0, 0, 0.03f};
    sky = 0.2f;
    radiance = [](const Eigen::Vector3f&) { return 0.25f; };
    lamps = {lamp_at({0.3f, 0.5f, 0.6f}, 0.05f, 0.3f)};
    exhibit.objects = {box_object({-0.06f, -0.06f, 0}, {0.06f, 0.06f, 0.12f}, 0.5f)};
  }

  capture::RealSurface surface(const std::string& name, float middle_m, float half_m) const {
    const std::string low = std::to_string(middle_m - half_m), high = std::to_string(middle_m + half_m);
    const std::string x[2] = {low, high}, y[2] = {std::to_string(-half_m), std::to_string(half_m)};
    capture::RealSurface s;
    s.name = name;
    s.roughness = 0.2f;
    s.specular = 0;
    s.base_color.setConstant(0.5f);
    s.mesh = folder.write(name + ".ply",
                          "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
                          "z\nelement face 2\n"
                          "property list uchar int vertex_indices\nend_header\n" +
                              x[0] + " " + y[0] + " 0\n" + x[1] + " " + y[0] + " 0\n" + x[1] + " " + y[1] + " 0\n" +
                              x[0] + " " + y[1] + " 0\n3 0 1 2\n3 0 2 3\n");
    return s;
  }

  /// The plate comes last.
  capture::Session with_surfaces(int count) const {
    capture::Session s = session();
    s.tag.size_m = 0.01;
    for (int i = 1; i < count; ++i) s.real_surfaces.push_back(surface("card" + std::to_string(i), 20.0f + i, 0.1f));
    s.real_surfaces.push_back(surface("plate", 0, 0.4f));
    s.real_surfaces.back().metallic = s.real_surfaces.back().specular = 1;
    return s;
  }
};

class Limits : public ClosedTest {
 protected:
  relight::RelitPicture relit(const BlockOnPlate& scene, int surfaces) const {
    relight::Relighter relighter(device_, scene.with_surfaces(surfaces));
    return relighter.relight(scene.frame(), scene.scene(), scene.exhibit, careful_plan(32, 1));
  }
};
ON_BOTH_DEVICES(Limits);

TEST_P(Limits, TheNinthKnownSurfaceMirrorsAsTheFirst) {
  const BlockOnPlate scene;
  const relight::RelitPicture first = relit(scene, 1), ninth = relit(scene, 9);
  EXPECT_EQ(ninth.srgb.data, first.srgb.data);
  EXPECT_TRUE(ninth.warnings.empty());
  EXPECT_NE(relit(scene, relight::shader::kMaxSurfaces + 1).srgb.data, first.srgb.data) << "the plate shows";
}

TEST_P(Limits, SurfacesThatAreTooManyAreSaid) {
  const BlockOnPlate scene;
  EXPECT_TRUE(relit(scene, relight::shader::kMaxSurfaces).warnings.empty());
  const std::vector<std::string> warnings = relit(scene, relight::shader::kMaxSurfaces + 2).warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("34"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("32"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace lumigraft::test
