// Devices that hang: waits end, and another device works.
#include <algorithm>
#include <ctime>
#include <thread>

#include "relight/gpu/hang.h"
#include "tests/relight/gpu/device_fixture.h"
#include "tests/relight/gpu/lost_device/lose.h"

namespace lumigraft::relight::gpu {
namespace {

using std::chrono::milliseconds;

// Longer than anything takes on a busy machine, as the compilation of shaders. What hangs in tests times out at once.
constexpr milliseconds kLimit{300'000};

TEST(EndsWithin, CountsSlicesAndNotTheTimeThatPasses) {
  int slices = 0;
  const auto never = [&](std::chrono::nanoseconds slice) {
    EXPECT_EQ(slice, kWait_slice);
    ++slices;
    return false;
  };
  EXPECT_FALSE(ends_within(4 * kWait_slice, never));
  EXPECT_EQ(slices, 4);
  // A process that was stopped: each of these slices takes longer than the limit.
  EXPECT_TRUE(ends_within(milliseconds(300), [count = 0](std::chrono::nanoseconds) mutable {
    std::this_thread::sleep_for(milliseconds(350));
    return ++count == 2;
  }));
  EXPECT_TRUE(ends_within(kNever_hangs, [&](std::chrono::nanoseconds) { return ++slices == 10000; }));
}

class DeviceHangOn : public testing::TestWithParam<Backend> {
 protected:
  static std::unique_ptr<Device> make(Backend backend, std::optional<milliseconds> hangs_after) {
    return create_device(backend,
                         {.validation = true, .more_shaders = device_test_shaders(), .hangs_after = hangs_after});
  }
};
ON_BOTH_DEVICES(DeviceHangOn);

TEST_P(DeviceHangOn, SaysSoAndIsReplaced) {
  const LosableDevices losable(GetParam());
  const std::vector<std::uint32_t> words{1, 2, 3, 4};
  const auto works = [&](Device& device) {
    const auto buffer = device.create_buffer(16, "words");
    device.upload(*buffer, 0, std::as_bytes(std::span(words)));
    return values_of<std::uint32_t>(device.download(*buffer)) == words;
  };
  std::unique_ptr<Device> next;
  {
    const auto device = make(GetParam(), kLimit);
    EXPECT_TRUE(works(*device));
    const auto texture = device->create_texture({.name = "grid", .width = 2, .height = 2, .format = Format::r32_float});
    const auto buffer = device->create_buffer(16, "words");
    const auto pipeline = device->create_compute("device_ramp.comp");
    const auto list = device->begin(), later = device->begin();
    list->fill(*buffer, 7);
    losable.hang();
    EXPECT_THROW(device->submit(*list), DeviceHung);
    EXPECT_THROW(device->submit(*later), DeviceHung);
    const auto upload_and_download = [&] {
      device->upload(*texture, 0, std::as_bytes(std::span(words)));
      device->download(*texture);
    };
    EXPECT_THROW(upload_and_download(), DeviceHung);
    EXPECT_THROW(device->download(*buffer), DeviceHung);
    EXPECT_THROW(device->create_texture({.name = "late", .format = Format::r32_float}), DeviceHung);
    EXPECT_THROW(device->create_buffer(16, "late"), DeviceHung);
    next = make(GetParam(), kLimit);
    EXPECT_TRUE(works(*next)) << "while objects of the one that hangs exist";
  }
  EXPECT_TRUE(works(*next)) << "after they were destroyed";
}

/// Until the process does nothing any more.
void wait_for_rest() {
  const auto used_ns = [] {
    timespec used{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return used.tv_sec * 1'000'000'000 + used.tv_nsec;
  };
  for (std::int64_t before = -1'000'000'000; used_ns() - before > 1'000'000;) {
    before = used_ns();
    std::this_thread::sleep_for(milliseconds(300));
  }
}

TEST(DeviceHang, WorkThatTakesTooLongGoesOnWhileAnotherDeviceWorks) {
  const int groups_of_seconds = 1500 * static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
  const auto make = [](std::optional<milliseconds> hangs_after) {
    return create_vulkan_device({.more_shaders = device_test_shaders(), .hangs_after = hangs_after});
  };
  const auto first_number = [](Device& device, int groups) {
    const auto numbers = device.create_buffer(static_cast<std::size_t>(groups) * 64 * 4, "numbers");
    const auto pipeline = device.create_compute("device_long.comp");
    const auto list = device.begin();
    const std::array bindings{storage(1, *numbers)};
    list->dispatch(*pipeline, bindings, {}, groups);
    device.submit(*list);
    return values_of<std::uint32_t>(device.download(*numbers)).front();
  };
  auto device = make(milliseconds(1000));
  if (!device->is_software()) GTEST_SKIP() << device->name() << " would not need long";
  EXPECT_THROW(first_number(*device, groups_of_seconds), DeviceHung) << "work of some seconds";
  device = nullptr;
  std::uint32_t expected = 1;
  for (int turn = 0; turn < 60000; ++turn) {
    expected ^= expected << 13;
    expected ^= expected >> 17;
    expected ^= expected << 5;
  }
  EXPECT_EQ(first_number(*make({}), 1), expected);
  wait_for_rest();
}

}  // namespace
}  // namespace lumigraft::relight::gpu
