// The renderer on both devices must give the same image of the first frame of the recorded table-top.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "capture/source.h"
#include "reconstruct/fusion/fusion.h"
#include "relight/relighter.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight {
namespace {

/// The first frame and the scene that is reconstructed from it.
struct TableTop {
  capture::Session session;
  capture::FrameSet frame;
  reconstruct::Scene scene;
  Exhibit exhibit;
};

TableTop table_top() {
  const std::filesystem::path folder = std::filesystem::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop";
  TableTop made;
  made.session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  made.exhibit = read_exhibit(capture::ConfigTable::load(folder / "exhibit.toml"));
  made.frame = capture::open_frames(made.session)->next(std::chrono::seconds(10)).value();

  reconstruct::Scene& scene = made.scene;
  scene.pose = reconstruct::PoseStage(made.session.tag, made.session.color.model).locate(made.frame).pose;
  scene.field = reconstruct::FusionStage(made.session, {}).fuse(made.frame, scene.pose.value());
  const auto light = reconstruct::LightStage(made.session).extract(made.frame).illumination;
  reconstruct::AlbedoStage::Result solution = reconstruct::AlbedoStage(made.session).solve(*scene.field, *light);
  scene.albedo = solution.albedo;
  scene.illumination = solution.illumination;
  return made;
}

/// A metal mirror on the table next to the tag, so that the passes for known surfaces run too.
capture::RealSurface mirror_in(const std::filesystem::path& folder) {
  const std::filesystem::path mesh = folder / "lumigraft-two-devices-mirror.obj";
  std::ofstream(mesh) << "v -0.3 0.1 0.004\nv 0.3 0.1 0.004\nv 0.3 0.4 0.004\nv -0.3 0.4 0.004\nf 1 2 3\nf 1 3 4\n";
  return {.name = "mirror",
          .mesh = mesh,
          .roughness = 0.2f,
          .metallic = 1,
          .specular = 1,
          .base_color = Eigen::Vector3f(0.9f, 0.8f, 0.7f)};
}

struct Agreement {
  double within_one = 0;  ///< fraction of pixels of which no channel differs by more than one pixel value
  int largest = 0;
};
Agreement compare(const capture::Image<std::uint8_t>& one, const capture::Image<std::uint8_t>& two) {
  Agreement agreement;
  const std::size_t pixels = one.data.size() / 3;
  std::size_t near = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    int apart = 0;
    for (std::size_t c = 0; c < 3; ++c) apart = std::max(apart, std::abs(one.data[3 * i + c] - two.data[3 * i + c]));
    near += apart <= 1;
    agreement.largest = std::max(agreement.largest, apart);
  }
  agreement.within_one = static_cast<double>(near) / static_cast<double>(pixels);
  return agreement;
}

TEST(DevicePictures, BothDevicesDrawTheSamePicture) {
  TableTop made = table_top();
  Plan plan;  // small, so that software rendering takes seconds; every pass runs
  plan.volume = 32;
  plan.trace_scale = 4;
  plan.rsm = 128;
  for (const bool with_mirror : {false, true}) {
    if (with_mirror) made.session.real_surfaces = {mirror_in(testing::TempDir())};
    // The object is elsewhere in the second frame, so that data cached from the first frame are used.
    std::vector<capture::Image<std::uint8_t>> first, second;
    for (const gpu::Backend backend : {gpu::Backend::vulkan, gpu::Backend::egl}) {
      Relighter relighter(gpu::create_device(backend, {.validation = true}), made.session);
      Exhibit exhibit = made.exhibit;
      const RelitPicture picture = relighter.relight(made.frame, made.scene, exhibit, plan);
      ASSERT_FALSE(picture.passes.empty()) << (picture.warnings.empty() ? "" : picture.warnings[0]);
      first.push_back(picture.srgb);
      exhibit.objects.at(0).position_m.x() += 0.02;
      second.push_back(relighter.relight(made.frame, made.scene, exhibit, plan).srgb);
    }
    EXPECT_LT(compare(first[0], second[0]).within_one, 0.995) << "the object is in the picture, and moves";
    for (const auto* pictures : {&first, &second}) {
      const Agreement agreement = compare((*pictures)[0], (*pictures)[1]);
      std::printf("within one code value: %.4f %% of pixels; largest difference %d\n", 100 * agreement.within_one,
                  agreement.largest);
      EXPECT_GE(agreement.within_one, 0.999);
    }
  }
}

}  // namespace
}  // namespace lumigraft::relight
