// Known glossy surfaces in the live view compared with the careful view, which evaluates every lamp and traces every
// pixel.
#include <cmath>
#include <cstdio>

#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {
namespace {

/// A block on a plate under a lamp and a sky, seen from above.
struct BlockOnPlate : ClosedScene {
  TemporaryFolder folder;
  capture::RealSurface plate;

  BlockOnPlate(float roughness, float metallic) {
    width = 128;
    height = 96;
    focal_px = 100;
    eye_m = {0, -0.6f, 0.4f};
    look_at_m = {0, 0, 0.03f};
    sky = 0.2f;
    radiance = [](const Eigen::Vector3f&) { return 0.25f; };
    lamps = {lamp_at({0.3f, 0.5f, 0.6f}, 0.05f, 0.3f)};
    exhibit.objects = {box_object({-0.06f, -0.06f, 0}, {0.06f, 0.06f, 0.12f}, 0.5f)};
    plate.roughness = roughness;
    plate.metallic = metallic;
    plate.specular = 1;
    plate.base_color.setConstant(metallic > 0 ? 0.9f : 0.3f);
  }

  capture::Session with_plate() const {
    capture::Session s = session();
    s.real_surfaces = {plate};
    s.real_surfaces[0].mesh =
        folder.write("plate.ply",
                     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                     "element face 2\nproperty list uchar int vertex_indices\nend_header\n-0.4 -0.4 0\n0.4 -0.4 0\n"
                     "0.4 0.4 0\n-0.4 0.4 0\n3 0 1 2\n3 0 2 3\n");
    s.tag.size_m = 0.01;
    return s;
  }
};

class LiveGloss : public ClosedTest {};
ON_BOTH_DEVICES(LiveGloss);

TEST_P(LiveGloss, ShowsWhatTheCarefulViewShows) {
  struct Case {
    const char* name;
    float roughness, metallic;
  };
  for (const Case& c : {Case{"polished metal", 0.1f, 1}, {"brushed metal", 0.4f, 1}, {"varnish", 0.2f, 0}}) {
    const BlockOnPlate scene(c.roughness, c.metallic);
    relight::Plan live = careful_plan(64);
    live.trace_scale = 4;
    relight::Relighter relighter(device_, scene.with_plate()), careful(device_, scene.with_plate());
    const capture::Image<std::uint8_t> shown =
        relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live).srgb;
    const relight::RelitPicture wanted = scene.relit(careful, careful_plan(64));
    relight::Relighter none(device_, scene.with_plate());
    const capture::Image<std::uint8_t> before = none.relight(scene.frame(), scene.scene(), {}, live).srgb;
    double off = 0, change = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        if (wanted.maps->mask.at(u, v) > 0) continue;
        const int codes = wanted.srgb.at(u, v), was = before.at(u, v), is = shown.at(u, v);
        off += std::abs(codes - is);
        change += std::abs(codes - was);
      }
    }
    std::printf("%s: live is off by %.3f of the change, which is %.2f codes a pixel\n", c.name, off / change,
                change / (scene.width * scene.height));
    EXPECT_GT(change / (scene.width * scene.height), 0.2) << c.name;
    EXPECT_LT(off / change, 0.12) << c.name;
  }
}

}  // namespace
}  // namespace lumigraft::test
