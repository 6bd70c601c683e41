// The tag's paper on a known surface, with the size given by the tag's family.
#include <algorithm>
#include <cmath>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {
namespace {

/// A box on a mirror on a grey floor, with the tag's paper at the centre in front of it.
struct PaperScene : ClosedScene {
  TemporaryFolder folder;

  PaperScene() {
    width = 64;
    height = 48;
    focal_px = 70;
    eye_m = {0, -0.45f, 0.4f};
    sky = 0.3f;
    radiance = [](const Eigen::Vector3f&) { return 0.15f; };
    exhibit.objects = {box_object({-0.15f, 0.12f, 0.02f}, {0.15f, 0.2f, 0.25f}, 0.9f)};
  }

  capture::Session with_tag(const char* family, double size_m) const {
    capture::Session s = session();
    s.tag.family = family;
    s.tag.size_m = size_m;
    capture::RealSurface mirror;
    mirror.metallic = mirror.specular = 1;
    mirror.base_color.setConstant(0.9f);
    mirror.roughness = 0.1f;
    mirror.mesh =
        folder.write("mirror.ply",
                     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                     "element face 2\nproperty list uchar int vertex_indices\nend_header\n-0.4 -0.4 0\n0.4 -0.4 0\n"
                     "0.4 0.4 0\n-0.4 0.4 0\n3 0 1 2\n3 0 2 3\n");
    s.real_surfaces = {mirror};
    return s;
  }
};

float largest_difference(const capture::Image<float>& a, const capture::Image<float>& b) {
  float largest = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) largest = std::max(largest, std::abs(a.data[i] - b.data[i]));
  return largest;
}

/// A tag whose print is 0.18 m wide in each family; the black square is 8 of 10 cells of it in tag36h11.
template <typename Change>
void expect_paper_of_the_family(Change change) {
  const capture::Image<float> wanted = change("tag36h11", 0.144);
  EXPECT_LT(largest_difference(change("tag25h9", 0.14), wanted), 1e-3f) << "7 of 9 cells";
  EXPECT_LT(largest_difference(change("tag16h5", 0.135), wanted), 1e-3f) << "6 of 8 cells";
  EXPECT_GT(largest_difference(change("tag36h11", 0.135), wanted), 0.02f) << "it shows";
}

class TagPaper : public ClosedTest {};
ON_BOTH_DEVICES(TagPaper);

TEST_P(TagPaper, IsAsLargeAsTheFamilySays) {
  const PaperScene scene;
  expect_paper_of_the_family([&](const char* family, double size_m) {
    relight::Relighter relighter(device_, scene.with_tag(family, size_m));
    return scene.relit(relighter, careful_plan(32, 1)).maps->delta;
  });
}

TEST(TagPaperByRays, IsAsLargeAsTheFamilySays) {
  const PaperScene scene;
  expect_paper_of_the_family([&](const char* family, double size_m) {
    relight::RayRenderer renderer(scene.with_tag(family, size_m));
    return scene.relit(renderer, rays_plan(1, 20, 1)).maps->delta;
  });
}

}  // namespace
}  // namespace lumigraft::test
