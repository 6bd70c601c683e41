// Devices that are lost while they are in use.
#include "tests/relight/gpu/device_fixture.h"
#include "tests/relight/gpu/lost_device/lose.h"

namespace lumigraft::relight::gpu {
namespace {

class DeviceLostOn : public testing::TestWithParam<Backend> {
 protected:
  std::unique_ptr<Device> make() const {
    return create_device(GetParam(), {.validation = true, .more_shaders = device_test_shaders()});
  }
};
ON_BOTH_DEVICES(DeviceLostOn);

TEST_P(DeviceLostOn, SaysSoAndIsReplaced) {
  const LosableDevices losable(GetParam());
  const std::vector<std::uint32_t> words{1, 2, 3, 4};
  {
    const auto device = make();
    const auto texture = device->create_texture({.name = "grid", .width = 2, .height = 2, .format = Format::r32_float});
    const auto buffer = device->create_buffer(16, "words");
    const auto pipeline = device->create_compute("device_ramp.comp");
    device->upload(*texture, 0, std::as_bytes(std::span(words)));
    const auto list = device->begin();
    list->fill(*buffer, 7);
    losable.lose();
    EXPECT_THROW(device->submit(*list), DeviceLost);
    EXPECT_THROW(device->submit(*device->begin()), DeviceLost);
    const auto upload_and_download = [&] {
      device->upload(*texture, 0, std::as_bytes(std::span(words)));
      device->download(*texture);
    };
    EXPECT_THROW(upload_and_download(), DeviceLost);
    EXPECT_THROW(device->download(*buffer), DeviceLost);
    EXPECT_THROW(device->create_texture({.name = "late", .format = Format::r32_float}), DeviceLost);
    EXPECT_THROW(device->create_buffer(16, "late"), DeviceLost);
    // Another device works while objects of the lost one still exist.
    const auto next = make();
    const auto again = next->create_buffer(16, "words");
    next->upload(*again, 0, std::as_bytes(std::span(words)));
    EXPECT_EQ(values_of<std::uint32_t>(next->download(*again)), words);
  }
  const auto device = make();
  const auto buffer = device->create_buffer(16, "words");
  device->upload(*buffer, 0, std::as_bytes(std::span(words)));
  EXPECT_EQ(values_of<std::uint32_t>(device->download(*buffer)), words);
}

}  // namespace
}  // namespace lumigraft::relight::gpu
