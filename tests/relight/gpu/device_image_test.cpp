// Textures of a device: copies, storage, filtering, mips.
#include <cmath>

#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight::gpu {
namespace {

class DeviceImageTest : public DeviceTest {
 protected:
  /// textureLod at xyz (texture coordinates) and level w.
  std::vector<std::array<float, 4>> tap(const Texture& texture, const std::vector<std::array<float, 4>>& places,
                                        Filter filter, Wrap wrap_u = Wrap::clamp_to_edge,
                                        Wrap wrap_v = Wrap::clamp_to_edge) {
    const auto pipeline = device_->create_compute("device_tap.comp");
    const auto where = buffer_with(places, "places");
    const auto results = device_->create_buffer(where->size_bytes(), "results");
    const Binding bindings[] = {sampled(1, texture, filter, wrap_u, wrap_v), storage(2, *where), storage(3, *results)};
    const auto list = device_->begin();
    list->dispatch(*pipeline, bindings, {}, static_cast<int>(places.size() + 7) / 8);
    device_->submit(*list);
    return values_of<std::array<float, 4>>(device_->download(*results));
  }

  /// A volume that holds a linear ramp in its first mip and averages of eight below.
  std::unique_ptr<Texture> ramp(int edge, int mips, std::array<float, 4> slope) {
    auto volume = device_->create_texture(
        {.name = "ramp", .width = edge, .height = edge, .depth = edge, .mips = mips, .format = Format::rgba32_float});
    const auto write = device_->create_compute("device_ramp.comp");
    const auto list = device_->begin();
    const Binding fine[] = {image(1, *volume)};
    list->dispatch(*write, fine, bytes_of(slope), (edge + 7) / 8, (edge + 1) / 2, (edge + 1) / 2);
    device_->submit(*list);
    for (int mip = 1; mip < mips; ++mip) {
      const auto above = values_of<std::array<float, 4>>(device_->download(*volume, mip - 1));
      const std::size_t e = static_cast<std::size_t>(edge) >> mip;
      std::vector<std::array<float, 4>> texels(e * e * e);
      for (std::size_t i = 0; i < 8 * texels.size(); ++i) {
        const std::size_t x = i % (2 * e), y = i / (2 * e) % (2 * e), z = i / (4 * e * e);
        for (std::size_t c = 0; c < 4; ++c) texels[x / 2 + e * (y / 2 + e * (z / 2))][c] += above[i][c] / 8;
      }
      device_->upload(*volume, mip, std::as_bytes(std::span(texels)));
    }
    return volume;
  }
};

ON_BOTH_DEVICES(DeviceImageTest);

TEST_P(DeviceImageTest, RgbIsExpandedOnItsWay) {
  for (const bool host_written : {false, true}) {
    for (const int width : {13, 64}) {
      const auto texture = device_->create_texture(
          {.name = "camera", .width = width, .height = 6, .format = Format::rgba8_unorm, .host_written = host_written});
      std::vector<std::uint8_t> rgb(static_cast<std::size_t>(3 * width * 6));
      for (const int start : {7, 90}) {  // a second image replaces the first
        for (std::size_t i = 0; i < rgb.size(); ++i)
          rgb[i] = static_cast<std::uint8_t>(start + 11 * static_cast<int>(i));
        device_->upload_rgb(*texture, rgb);
        const auto texels = values_of<std::array<std::uint8_t, 4>>(device_->download(*texture));
        ASSERT_EQ(3 * texels.size(), rgb.size());
        for (std::size_t i = 0; i < texels.size(); ++i) {
          EXPECT_EQ(texels[i], (std::array<std::uint8_t, 4>{rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], 255})) << i;
        }
      }
    }
  }
}

TEST_P(DeviceImageTest, EveryFormatComesBackAsItWasSent) {
  for (const Format format :
       {Format::r8_unorm, Format::rgba8_unorm, Format::rgba8_srgb, Format::r16_float, Format::rgba16_float,
        Format::r32_float, Format::rg32_float, Format::rgba32_float, Format::depth32_float}) {
    for (const bool volume : {false, true}) {
      if (volume && format == Format::depth32_float) continue;
      const auto texture = device_->create_texture({.name = "round trip",
                                                    .width = 13,
                                                    .height = 6,
                                                    .depth = volume ? 5 : 1,
                                                    .volume = volume,
                                                    .mips = 3,
                                                    .format = format});
      for (int mip = 0; mip < 3; ++mip) {
        const std::size_t texels = static_cast<std::size_t>((13 >> mip) * (6 >> mip) * (volume ? 5 >> mip : 1));
        std::vector<std::byte> sent(texels * bytes_per_texel(format));
        EXPECT_EQ(device_->download(*texture, mip), sent) << "textures begin as zeros";
        // Bytes below 0x3c make finite numbers, 0 to 1, in every format.
        for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::byte>((i * 7 + 1) % 0x3c);
        device_->upload(*texture, mip, sent);
        EXPECT_EQ(device_->download(*texture, mip), sent) << static_cast<int>(format) << " mip " << mip;
      }
    }
  }
}

TEST_P(DeviceImageTest, ATrilinearTapOfALinearFieldIsExact) {
  const std::array<float, 4> slope{2, -3, 5, 7};
  const auto volume = ramp(16, 1, slope);
  std::vector<std::array<float, 4>> places;
  for (int i = 0; i < 64; ++i) {
    const auto at = [&](int k) { return (0.5f + 15.0f * static_cast<float>((i * k) % 64) / 63.0f) / 16.0f; };
    places.push_back({at(1), at(5), at(11), 0});
  }
  const auto results = tap(*volume, places, Filter::linear);
  for (std::size_t i = 0; i < places.size(); ++i) {
    float expected = slope[3];
    for (std::size_t k = 0; k < 3; ++k) expected += 16 * places[i][k] * slope[k];
    EXPECT_NEAR(results[i][0], expected, 16.0f / 256) << i;  // GPUs must have at least 8 bits of weight
  }
  const auto nearest = tap(*volume, {{0.26f, 0.51f, 0.76f, 0}}, Filter::nearest);
  EXPECT_EQ(nearest[0][1], 4.5f);
  EXPECT_EQ(nearest[0][2], 8.5f);
  EXPECT_EQ(nearest[0][3], 12.5f);
}

TEST_P(DeviceImageTest, EdgesAreClamped) {
  const auto volume = ramp(8, 1, {1, 0, 0, 0});
  const auto results = tap(*volume, {{-3, 0.5f, 0.5f, 0}, {4, 0.5f, 0.5f, 0}}, Filter::linear);
  EXPECT_EQ(results[0][0], 0.5f);
  EXPECT_EQ(results[1][0], 7.5f);
}

// Texel centres of a volume of 8 texels along an edge, outside it.
TEST_P(DeviceImageTest, WrapModes) {
  const auto volume = ramp(8, 1, {});  // y and z of a texel are x and y of its centre
  const std::vector<std::array<float, 4>> places{{-1.5f / 8, 0.5f, 0.5f, 0}, {0.5f, 9.5f / 8, 0.5f, 0}};
  const struct {
    Wrap wrap;
    float below, above;
  } cases[] = {{Wrap::repeat, 6.5f, 1.5f}, {Wrap::clamp_to_edge, 0.5f, 7.5f}, {Wrap::mirrored_repeat, 1.5f, 6.5f}};
  for (const auto& c : cases) {
    for (const Filter filter : {Filter::nearest, Filter::linear, Filter::linear_mip_linear}) {
      EXPECT_NEAR(tap(*volume, places, filter, c.wrap, Wrap::clamp_to_edge)[0][1], c.below, 1.0f / 32);
      EXPECT_NEAR(tap(*volume, places, filter, Wrap::clamp_to_edge, c.wrap)[1][2], c.above, 1.0f / 32);
    }
  }
}

TEST_P(DeviceImageTest, MipsAreTheAveragesAndLevelsAreChosenByLod) {
  // The average of a linear field over a coarse cell is its value at the cell's centre, so all mips agree there.
  const auto volume = ramp(16, 5, {1, 10, 100, 0});
  for (int mip = 0; mip < 5; ++mip) {
    const auto texels = values_of<std::array<float, 4>>(device_->download(*volume, mip));
    const int edge = 16 >> mip;
    const float cell = static_cast<float>(1 << mip);
    for (int z = 0; z < edge; ++z) {
      for (int x = 0; x < edge; ++x) {
        const auto& texel = texels[static_cast<std::size_t>(x + edge * (0 + edge * z))];
        const float expected = cell * (static_cast<float>(x) + 0.5f + 5.0f + 100 * (static_cast<float>(z) + 0.5f));
        EXPECT_FLOAT_EQ(texel[0], expected);
      }
    }
  }

  // Near the corner, nearest taps show which level was read: its first cell's centre.
  const std::vector<std::array<float, 4>> lods{{0, 0, 0, 0}, {0, 0, 0, 1.2f}, {0, 0, 0, 3}, {0, 0, 0, 9}};
  const auto nearest = tap(*volume, lods, Filter::nearest);
  EXPECT_EQ(nearest[0][1], 0.5f);
  EXPECT_EQ(nearest[1][1], 1.0f);
  EXPECT_EQ(nearest[2][1], 4.0f);
  EXPECT_EQ(nearest[3][1], 8.0f) << "the last mip is as far as it goes";
  const auto between = tap(*volume, {{0, 0, 0, 1.5f}}, Filter::linear_mip_linear);
  EXPECT_NEAR(between[0][1], 1.5f, 1.0f / 256);
  EXPECT_EQ(tap(*volume, {{0, 0, 0, 1.4f}}, Filter::linear)[0][1], 1.0f) << "linear takes the nearest mip";
}

TEST_P(DeviceImageTest, ClearSetsAllMips) {
  const auto color =
      device_->create_texture({.name = "color", .width = 8, .height = 8, .mips = 4, .format = Format::rgba32_float});
  const auto depth =
      device_->create_texture({.name = "depth", .width = 4, .height = 4, .format = Format::depth32_float});
  const auto list = device_->begin();
  list->clear(*color, {1, -2, 3e9f, 0.25f});
  list->clear(*depth, {0.75f, 0, 0, 0});
  device_->submit(*list);
  for (int mip = 0; mip < 4; ++mip) {
    for (const auto& texel : values_of<std::array<float, 4>>(device_->download(*color, mip))) {
      EXPECT_EQ(texel, (std::array<float, 4>{1, -2, 3e9f, 0.25f}));
    }
  }
  EXPECT_EQ(values_of<float>(device_->download(*depth)), std::vector<float>(16, 0.75f));
}

TEST_P(DeviceImageTest, TheSameWorkGivesTheSameBytes) {
  const auto first = ramp(16, 5, {0.1f, 0.2f, 0.3f, 0.4f}), second = ramp(16, 5, {0.1f, 0.2f, 0.3f, 0.4f});
  for (int mip = 0; mip < 5; ++mip) EXPECT_EQ(device_->download(*first, mip), device_->download(*second, mip));
}

}  // namespace
}  // namespace lumigraft::relight::gpu
