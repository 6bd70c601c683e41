#include "server/pipeline/offline_pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <string>

#include "capture/source.h"
#include "server/pipeline/service_config.h"
#include "tests/relight/gpu/lost_device/lose.h"

namespace lumigraft::server {
namespace {

class LockStepOn : public testing::TestWithParam<relight::gpu::Backend> {};
INSTANTIATE_TEST_SUITE_P(BothDevices, LockStepOn,
                         testing::Values(relight::gpu::Backend::vulkan, relight::gpu::Backend::egl),
                         [](const auto& test) { return std::string(relight::gpu::name_of(test.param)); });

constexpr std::size_t kFrames = 3;

/// `make` is called before a device is created, with the number of devices created before.
std::vector<FrameRecord> replayed(
    const std::function<void(std::size_t)>& before_frame, const std::function<void(int)>& make = [](int) {}) {
  relight::Plan plan;
  plan.volume = 32;
  plan.rsm = 64;
  plan.trace_scale = 4;
  ServiceFiles files;
  files.session = LUMIGRAFT_SOURCE_DIR "/recordings/tabletop";
  ServiceInput input = read_service(files, plan);
  const std::unique_ptr<capture::FrameReader> frames = capture::open_paired_frames(input.session);
  OfflinePipeline pipeline(
      input.session, std::move(input.exhibit), input.plan,
      [&, made = 0]() mutable {
        make(made++);
        return relight::gpu::create_device(LockStepOn::GetParam(), {});
      },
      nullptr);
  std::vector<FrameRecord> records;
  while (records.size() < kFrames) {
    const std::optional<capture::FrameSet> frame = frames->next(std::chrono::seconds(10));
    if (!frame) break;
    before_frame(records.size());
    records.push_back(pipeline.step(*frame, false));
  }
  return records;
}

int farthest_apart(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
  if (a.data.size() != b.data.size()) return 256;
  int max_difference = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i)
    max_difference = std::max(max_difference, std::abs(a.data[i] - b.data[i]));
  return max_difference;
}

// A lost device does not change the images of a replay, only its records; but a pixel value may be rounded differently,
// because a new device is given the newest scene, and an old one receives slight changes some frames later.
TEST_P(LockStepOn, ALostDeviceCostsNoPicture) {
  const relight::gpu::LosableDevices losable(GetParam());
  const std::vector<FrameRecord> wanted = replayed([](std::size_t) {});
  const std::vector<FrameRecord> got = replayed([&](std::size_t i) {
    if (i == 1) losable.lose();
  });
  ASSERT_EQ(wanted.size(), kFrames);
  ASSERT_EQ(got.size(), kFrames);
  for (std::size_t i = 0; i < kFrames; ++i) {
    EXPECT_FALSE(got[i].picture.passes.empty()) << "nothing was drawn";
    EXPECT_LE(farthest_apart(got[i].picture.srgb, wanted[i].picture.srgb), 1) << i;
    const bool warned = std::any_of(got[i].warnings.begin(), got[i].warnings.end(),
                                    [](const std::string& w) { return w.find("the GPU device was lost") == 0; });
    EXPECT_EQ(warned, i == 1) << i;
  }
}

TEST_P(LockStepOn, WithoutAnotherDeviceTheNextFrameAsksAgain) {
  const relight::gpu::LosableDevices losable(GetParam());
  const std::vector<FrameRecord> got = replayed(
      [&](std::size_t i) {
        if (i == 1) losable.lose();
      },
      [](int made) {
        if (made == 1) throw std::runtime_error("no room");
      });
  ASSERT_EQ(got.size(), kFrames);
  EXPECT_TRUE(got[1].picture.passes.empty());
  EXPECT_FALSE(got[1].picture.srgb.empty()) << "the camera's own picture";
  EXPECT_EQ(std::count(got[1].warnings.begin(), got[1].warnings.end(), "relight: no room"), 1);
  EXPECT_FALSE(got[2].picture.passes.empty());
}

TEST(OfflinePipeline, MemoryOfTheFieldIsSet) {
  relight::Plan plan;
  plan.method = "rays";  // needs no GPU
  plan.trace_scale = 8;
  ServiceFiles files;
  files.session = LUMIGRAFT_SOURCE_DIR "/recordings/tabletop";
  const ServiceInput input = read_service(files, plan);
  const std::optional<capture::FrameSet> frame =
      capture::open_paired_frames(input.session)->next(std::chrono::seconds(10));
  ASSERT_TRUE(frame);
  // The scene's field also has inferred occluders, which this does not bound.
  const auto bricks = [&](const reconstruct::FusionSettings& settings) {
    OfflinePipeline pipeline(
        input.session, {}, input.plan, [] { return nullptr; }, nullptr, settings);
    const FrameRecord record = pipeline.step(*frame, false);
    return record.scene.field ? record.scene.field->bricks.size() : 0;
  };
  reconstruct::FusionSettings small;
  small.max_memory_mb = 1;
  const std::size_t few = bricks(small), all = bricks({});
  EXPECT_GT(few, 0u);
  EXPECT_LT(few, all / 4) << all << " bricks by default";
}

}  // namespace
}  // namespace lumigraft::server
