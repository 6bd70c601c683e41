// Clears by shaders, which software devices do not use otherwise.
#include "relight/gpu/texture_clear.h"

#include "relight/gpu/formats.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight::gpu {
namespace {

class TextureClearTest : public DeviceTest {
 protected:
  bool clear(const Texture& texture, const std::array<float, 4>& value) {
    const TextureClear shaders(*device_);
    const auto list = device_->begin();
    const bool recorded = shaders.record(*list, texture, value);
    device_->submit(*list);
    return recorded;
  }
};
ON_BOTH_DEVICES(TextureClearTest);

// Edges that are no multiples of a group's.
TEST_P(TextureClearTest, EveryTexelIsZero) {
  for (const Format format : {Format::rgba16_float, Format::rgba32_float}) {
    for (const int depth : {1, 5}) {
      const auto texture =
          device_->create_texture({.name = "full", .width = 13, .height = 9, .depth = depth, .format = format});
      const std::vector<std::byte> ones(mip_bytes(texture->desc(), 0), std::byte{0x3c});
      device_->upload(*texture, 0, ones);
      ASSERT_EQ(device_->download(*texture), ones);
      EXPECT_TRUE(clear(*texture, {}));
      EXPECT_EQ(device_->download(*texture), std::vector<std::byte>(ones.size(), std::byte{0}));
    }
  }
}

TEST_P(TextureClearTest, OtherTexturesAndValuesAreLeftToTheDriver) {
  const auto colors = device_->create_texture({.name = "colors", .width = 4, .height = 4});
  EXPECT_FALSE(clear(*colors, {0, 0, 0, 1}));
  const auto levels = device_->create_texture({.name = "levels", .width = 4, .height = 4, .mips = 2});
  EXPECT_FALSE(clear(*levels, {}));
  const auto single = device_->create_texture({.name = "single", .width = 4, .height = 4, .format = Format::r32_float});
  EXPECT_FALSE(clear(*single, {}));
}

}  // namespace
}  // namespace lumigraft::relight::gpu
