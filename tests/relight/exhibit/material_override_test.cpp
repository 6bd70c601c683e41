// Properties that [object.material] does not set are those of each of the model's parts, in every renderer.
#include <sstream>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {
namespace {

const Points kBlock = box({-0.08f, -0.08f, 0.005f}, {0.08f, 0.08f, 0.15f});

/// A block with vertex colours, red on one side and green on the other.
std::string colored_block() {
  std::ostringstream ply;
  ply << "ply\nformat ascii 1.0\nelement vertex " << kBlock.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
         "property uchar blue\nelement face "
      << kBlock.size() / 3 << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Eigen::Vector3f& p : kBlock) ply << p.transpose() << (p.x() > 0 ? " 230 20 20\n" : " 20 230 20\n");
  for (std::size_t i = 0; i < kBlock.size(); i += 3) ply << "3 " << i << ' ' << i + 1 << ' ' << i + 2 << '\n';
  return ply.str();
}

/// A matt block of two materials: a red and grey texture, and blue without texture.
std::string textured_block() {
  std::ostringstream obj;
  obj << "mtllib block.mtl\nvt 0.25 0.5\nvt 0.75 0.5\n";
  for (const Eigen::Vector3f& p : kBlock) obj << "v " << p.transpose() << '\n';
  for (std::size_t i = 0; i < kBlock.size(); i += 3) {
    obj << (i == 0 ? "usemtl painted\n" : i == kBlock.size() / 2 ? "usemtl blue\n" : "") << "f";
    for (std::size_t k = i + 1; k < i + 4; ++k) obj << ' ' << k << '/' << 1 + k % 2;
    obj << '\n';
  }
  return obj.str();
}

class MaterialOverrides : public ClosedTest {
 protected:
  MaterialOverrides() {
    folder_.write("block.ply", colored_block());
    folder_.write("texture.png", from_base64(red_grey_png));
    folder_.write("block.mtl", "newmtl painted\nmap_Kd texture.png\nKs 0 0 0\nnewmtl blue\nKd 0.1 0.1 0.7\nKs 0 0 0\n");
    folder_.write("block.obj", textured_block());
  }

  /// The block with these lines in [object.material].
  void exhibit(const std::string& model, const std::string& material) {
    const std::string lines = material.empty() ? "" : "[object.material]\n" + material + "\n";
    const capture::ConfigTable root = capture::ConfigTable::load(
        folder_.write("exhibit.toml", "[[object]]\nmodel = \"" + model + "\"\nup = \"z\"\n" + lines));
    scene_.exhibit = relight::read_exhibit(root);
    root.finish();
  }

  template <typename MakeRenderer>
  void expect_own_colors(const std::string& model, const relight::Plan& plan, MakeRenderer make_renderer) {
    const auto picture = [&](const std::string& material) {
      exhibit(model, material);
      const auto renderer = make_renderer();
      return scene_.relit(*renderer, plan).srgb.data;
    };
    // No model is metallic, and the override sets nothing else.
    EXPECT_EQ(picture("metallic = 0.0"), picture("")) << model;
  }

  TemporaryFolder folder_;
  ClosedScene scene_ = floor_under_lamp();
};
ON_BOTH_DEVICES(MaterialOverrides);

TEST_P(MaterialOverrides, KeepTextureAndColorsByCones) {
  relight::Plan live = careful_plan(32, 1);
  live.trace_scale = 4;
  const auto relighter = [&] { return std::make_unique<relight::Relighter>(device_, scene_.session()); };
  expect_own_colors("block.ply", careful_plan(32, 1), relighter);  // varnished
  expect_own_colors("block.obj", live, relighter);                 // matt: irradiance per vertex
}

class MaterialOverridesByRays : public MaterialOverrides {};
INSTANTIATE_TEST_SUITE_P(On, MaterialOverridesByRays, testing::Values(relight::gpu::Backend::vulkan),
                         relight::gpu::backend_label);

TEST_P(MaterialOverridesByRays, KeepTextureAndColors) {
  relight::Plan paths;
  paths.method = "reference";
  paths.samples = 4;
  for (const char* model : {"block.ply", "block.obj"}) {
    expect_own_colors(model, rays_plan(4), [&] { return std::make_unique<relight::RayRenderer>(scene_.session()); });
    expect_own_colors(model, paths, [&] { return std::make_unique<relight::ReferenceRenderer>(scene_.session()); });
  }
}

}  // namespace
}  // namespace lumigraft::test
