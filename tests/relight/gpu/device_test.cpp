// Buffers, parameters, atomics, lists and times of a device.
#include "relight/gpu/device.h"

#include <Eigen/Core>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight::gpu {
namespace {

/// As in device_params.comp.
struct alignas(16) Params {
  std::array<float, 16> matrix;
  std::array<float, 3> position;
  float scale;
  std::array<std::int32_t, 4> counts;
  std::array<float, 8> colors;
  std::uint32_t seed;
};

ON_BOTH_DEVICES(DeviceTest);

TEST_P(DeviceTest, ParametersArriveAsStd140) {
  Params params{};
  for (std::size_t i = 0; i < 16; ++i) params.matrix[i] = 0.5f + static_cast<float>(i);
  params.position = {100, 101, 102};
  params.scale = 103;
  params.counts = {-7, 8, 9, 10};
  for (std::size_t i = 0; i < 8; ++i) params.colors[i] = 200 + static_cast<float>(i);
  params.seed = 65536;

  const auto pipeline = device_->create_compute("device_params.comp");
  const auto result = device_->create_buffer(40 * sizeof(float), "result");
  const auto list = device_->begin();
  const Binding bindings[] = {storage(1, *result)};
  list->dispatch(*pipeline, bindings, bytes_of(params), 5);
  params = {};  // recording has copied them
  device_->submit(*list);

  const auto values = values_of<float>(device_->download(*result));
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(values[i], 0.5f + static_cast<float>(i));
  EXPECT_EQ(std::vector<float>(values.begin() + 16, values.begin() + 24),
            (std::vector<float>{100, 101, 102, 103, -7, 8, 9, 10}));
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(values[24 + i], 200 + static_cast<float>(i));
  EXPECT_EQ(values[32], 65536.0f);
  EXPECT_EQ(values[33], 0.0f);
}

TEST_P(DeviceTest, WhatIsHeldIsSummedByName) {
  const auto held = [&](const std::string& name) {
    for (const Holding& one : device_->holdings().list()) {
      if (one.name == name) return std::pair(one.count, one.bytes);
    }
    return std::pair<std::size_t, std::size_t>(0, 0);
  };
  const std::size_t before = device_->holdings().bytes();
  const TextureDesc volume{
      .name = "held volume", .width = 4, .height = 4, .depth = 8, .mips = 2, .format = Format::rgba16_float};
  const auto one = device_->create_texture(volume);
  auto other = device_->create_texture(volume);
  const auto buffer = device_->create_buffer(100, "held buffer");
  EXPECT_EQ(held("held volume"), std::pair(std::size_t{2}, std::size_t{2 * 8 * (128 + 16)}));
  EXPECT_EQ(held("held buffer"), std::pair(std::size_t{1}, std::size_t{100}));
  EXPECT_EQ(device_->holdings().bytes(), before + 2304 + 100);
  other.reset();
  EXPECT_EQ(held("held volume").second, 1152u);
  EXPECT_THROW(device_->create_texture({.name = "held giant", .width = 1 << 20}), GpuError);
  EXPECT_EQ(held("held giant").first, 0u);
  EXPECT_EQ(device_->holdings().bytes(), before + 1152 + 100);
  EXPECT_GE(device_->holdings().max_bytes(), before + 2304 + 100);
}

TEST_P(DeviceTest, EachDispatchOfAListHasItsOwnParameters) {
  const auto pipeline = device_->create_compute("device_params.comp");
  const auto list = device_->begin();
  std::vector<std::unique_ptr<Buffer>> results;
  const int count = 1500;  // more than a pool of descriptors or a chunk of parameters holds
  for (int i = 0; i < count; ++i) {
    if (i % 100 == 0) results.push_back(device_->create_buffer(40 * sizeof(float), "result"));
    Params params{};
    params.scale = static_cast<float>(i);
    const Binding bindings[] = {storage(1, *results.back())};
    list->dispatch(*pipeline, bindings, bytes_of(params), 5);
  }
  device_->submit(*list);
  for (std::size_t i = 0; i < results.size(); ++i) {
    EXPECT_EQ(values_of<float>(device_->download(*results[i]))[19], static_cast<float>(100 * i + 99));
  }
}

TEST_P(DeviceTest, IntegerAtomicsAddUpAndAreTheSameEachTime) {
  const auto pipeline = device_->create_compute("device_atomics.comp");
  std::vector<std::byte> first_bins, first_cells;
  for (int run = 0; run < 2; ++run) {
    const auto bins = device_->create_buffer(16 * 4, "bins");
    const auto cells = device_->create_buffer(8 * 4, "cells");
    const auto list = device_->begin();
    const Binding bindings[] = {storage(1, *bins), storage(2, *cells)};
    list->dispatch(*pipeline, bindings, {}, 64);
    list->dispatch(*pipeline, bindings, {}, 64);
    device_->submit(*list);

    const auto sums = values_of<std::uint32_t>(device_->download(*bins));
    // Sum of the numbers below 4096 that are b modulo 16: 16 (0 + … + 255) + 256 b, added twice.
    for (std::uint32_t b = 0; b < 16; ++b) EXPECT_EQ(sums[b], 2 * (16 * 255 * 256 / 2 + 256 * b));
    EXPECT_EQ(values_of<std::uint32_t>(device_->download(*cells)), std::vector<std::uint32_t>(8, 1024));
    if (run == 0) {
      first_bins = device_->download(*bins);
      first_cells = device_->download(*cells);
    } else {
      EXPECT_EQ(first_bins, device_->download(*bins));
      EXPECT_EQ(first_cells, device_->download(*cells));
    }
  }
}

TEST_P(DeviceTest, BuffersBeginAsZerosAndAreFilledAndUploadedInParts) {
  const auto buffer = device_->create_buffer(10, "ten bytes");
  EXPECT_EQ(device_->download(*buffer), std::vector<std::byte>(10));
  const auto list = device_->begin();
  list->fill(*buffer, 0x04030201);
  device_->submit(*list);
  const std::byte two[] = {std::byte{0xaa}, std::byte{0xbb}};
  device_->upload(*buffer, 3, two);
  const auto bytes = device_->download(*buffer);
  const std::vector<int> expected{1, 2, 3, 0xaa, 0xbb, 2, 3, 4, 1, 2};
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(std::to_integer<int>(bytes[i]), expected[i]);
}

TEST_P(DeviceTest, LaterUploadsReplaceEarlierOnes) {
  constexpr int kEdge = 2048;  // 32 MiB: more of them than wait for a submission together
  const auto large = device_->create_texture({.name = "large", .width = kEdge, .height = kEdge});
  const auto small = device_->create_texture({.name = "small", .width = 2, .height = 1, .format = Format::r32_float});
  std::vector<Eigen::half> texels(4 * kEdge * kEdge);
  for (int i = 1; i <= 3; ++i) {
    std::fill(texels.begin(), texels.end(), Eigen::half(static_cast<float>(i)));
    const std::vector<float> two{static_cast<float>(10 * i), static_cast<float>(10 * i + 1)};
    device_->upload(*small, 0, std::as_bytes(std::span(two)));
    device_->upload(*large, 0, std::as_bytes(std::span(texels)));
  }
  EXPECT_EQ(values_of<float>(device_->download(*small)), (std::vector<float>{30, 31}));
  EXPECT_EQ(values_of<Eigen::half>(device_->download(*large)), texels);
}

TEST_P(DeviceTest, WhatIsUploadedToMayBeDestroyedAtOnce) {
  const std::vector<float> texels{1, 2};
  auto gone = device_->create_texture({.name = "gone", .width = 2, .height = 1, .format = Format::r32_float});
  const auto kept = device_->create_texture({.name = "kept", .width = 2, .height = 1, .format = Format::r32_float});
  auto buffer = device_->create_buffer(8, "gone");
  device_->upload(*kept, 0, std::as_bytes(std::span(texels)));
  device_->upload(*gone, 0, std::as_bytes(std::span(texels)));
  device_->upload(*buffer, 0, std::as_bytes(std::span(texels)));
  gone.reset();
  buffer.reset();
  device_->submit(*device_->begin());
  EXPECT_EQ(values_of<float>(device_->download(*kept)), texels);
}

TEST_P(DeviceTest, PartsOfTexturesAreDownloadedTogether) {
  constexpr int kWidth = 7, kHeight = 5;
  const auto singles =
      device_->create_texture({.name = "singles", .width = kWidth, .height = kHeight, .format = Format::r32_float});
  const auto halves = device_->create_texture({.name = "halves", .width = kWidth, .height = kHeight});
  std::vector<float> values;
  std::vector<Eigen::half> fours;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    values.push_back(static_cast<float>(i));
    for (int c = 0; c < 4; ++c) fours.emplace_back(static_cast<float>(100 * c + i));
  }
  device_->upload(*singles, 0, std::as_bytes(std::span(values)));
  device_->upload(*halves, 0, std::as_bytes(std::span(fours)));
  const TexturePart parts[] = {
      {singles.get(), {6, 4, 1, 1}}, {halves.get(), {2, 1, 3, 2}}, {singles.get(), {0, 0, 7, 5}}};
  const std::vector<std::vector<std::byte>> texels = device_->download(parts);
  ASSERT_EQ(texels.size(), 3u);
  EXPECT_EQ(values_of<float>(texels[0]), std::vector<float>{34});
  std::vector<Eigen::half> expected;
  for (const int i : {9, 10, 11, 16, 17, 18}) {
    for (int c = 0; c < 4; ++c) expected.emplace_back(static_cast<float>(100 * c + i));
  }
  EXPECT_EQ(values_of<Eigen::half>(texels[1]), expected);
  EXPECT_EQ(values_of<float>(texels[2]), values);
  EXPECT_TRUE(device_->download(std::span<const TexturePart>()).empty());
}

TEST_P(DeviceTest, TwoListsRunInTheOrderTheyAreSubmitted) {
  const auto buffer = device_->create_buffer(4, "word");
  const auto first = device_->begin(), second = device_->begin();
  first->fill(*buffer, 1);
  second->fill(*buffer, 2);
  device_->submit(*second);
  EXPECT_EQ(values_of<std::uint32_t>(device_->download(*buffer))[0], 2u);
  device_->submit(*first);
  EXPECT_EQ(values_of<std::uint32_t>(device_->download(*buffer))[0], 1u);
}

TEST_P(DeviceTest, EveryPassHasATime) {
  const auto pipeline = device_->create_compute("device_atomics.comp");
  const auto bins = device_->create_buffer(16 * 4, "bins");
  const auto cells = device_->create_buffer(8 * 4, "cells");
  const Binding bindings[] = {storage(1, *bins), storage(2, *cells)};
  const auto list = device_->begin();
  for (int pass = 0; pass < 70; ++pass) {  // more than one pool of timestamps
    list->begin_pass("pass " + std::to_string(pass));
    list->dispatch(*pipeline, bindings, {}, pass == 69 ? 4096 : 1);
  }
  const auto times = device_->submit(*list);
  ASSERT_EQ(times.size(), 70u);
  for (const PassTime& time : times) EXPECT_GE(time.gpu_ms, 0.0);
  EXPECT_EQ(times[69].name, "pass 69");
  EXPECT_GT(times[69].gpu_ms, 0.0);  // a quarter of a million atomics on eight cells
  EXPECT_LT(times[69].gpu_ms, 60e3);
  EXPECT_TRUE(device_->submit(*device_->begin()).empty());
}

class DeviceLife : public testing::TestWithParam<Backend> {};
ON_BOTH_DEVICES(DeviceLife);

TEST_P(DeviceLife, DestructionOrderIsFree) {
  testing::internal::CaptureStderr();
  {
    auto device = create_device(GetParam(), {.validation = true, .more_shaders = device_test_shaders()});
    auto pipeline = device->create_compute("device_params.comp");
    auto buffer = device->create_buffer(64, "buffer");
    auto texture = device->create_texture({.name = "texture", .width = 4, .height = 4});
    auto list = device->begin();
    list->fill(*buffer, 1);
    device.reset();
    buffer.reset();
    list.reset();
    pipeline.reset();
    texture.reset();
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");  // the layer would name objects that were not destroyed
}

TEST_P(DeviceLife, AnUnknownDeviceIsNamedWithTheReason) {
  const bool vulkan = GetParam() == Backend::vulkan;
  const std::string variable = vulkan ? "LUMIGRAFT_VULKAN_DEVICE" : "LUMIGRAFT_EGL_DEVICE";
  setenv(variable.c_str(), "no such device", 1);
  const std::string text = error_of<GpuError>([] { create_device(GetParam(), {}); });
  unsetenv(variable.c_str());
  EXPECT_NE(text.find(vulkan ? "no usable Vulkan device; " : "no usable EGL device; "), std::string::npos) << text;
  EXPECT_NE(text.find(variable + " asks for \"no such device\""), std::string::npos) << text;
}

TEST_P(DeviceLife, WhatIsTooLargeIsRefusedAndTheDeviceGoesOn) {
  const auto device = create_device(GetParam(), {});
  const auto refused = [&](const TextureDesc& desc) {
    return error_of<GpuError>([&] { device->create_texture(desc); });
  };
  const std::string flat = refused({.name = "flat", .width = 1 << 20, .height = 2});
  EXPECT_EQ(flat.find("texture \"flat\" (1048576x2 rgba16_float): the longest edge of " + device->name() + " is "), 0u)
      << flat;
  const std::string deep = refused({.name = "deep", .width = 1 << 20, .height = 2, .depth = 2});
  EXPECT_NE(deep.find("the longest edge"), std::string::npos) << deep;
  if (GetParam() == Backend::egl) {  // EGL's limit is checked before memory is used; software Vulkan would use it
    const auto cube = [&](int edge) {
      return refused({.name = "much", .width = edge, .height = edge, .depth = edge, .format = Format::rgba32_float});
    };
    const bool small_edges = cube(8192).find("the longest edge") != std::string::npos;
    const std::string size = small_edges ? "2048x2048x2048" : "8192x8192x8192";  // 137 GB fit on some cards
    EXPECT_EQ(cube(small_edges ? 2048 : 8192),
              "creating texture \"much\" (" + size + " rgba32_float): out of device memory");
  }
  const std::string buffer = error_of<GpuError>([&] { device->create_buffer(std::size_t{1} << 40, "tera"); });
  EXPECT_EQ(buffer.find("buffer \"tera\" has 1099511627776 bytes; the maximum of "), 0u) << buffer;

  const auto small = device->create_texture({.name = "small", .width = 4, .height = 4, .format = Format::r32_float});
  EXPECT_EQ(values_of<float>(device->download(*small)), std::vector<float>(16, 0.0f));
}

TEST_P(DeviceLife, AnotherThreadMayGoOn) {
  const auto device = create_device(GetParam(), {.validation = true, .more_shaders = device_test_shaders()});
  const auto buffer = device->create_buffer(4, "word");
  const auto fill_with = [&](std::uint32_t value) {
    const auto list = device->begin();
    list->fill(*buffer, value);
    device->submit(*list);
  };
  fill_with(1);
  std::thread([&] {
    EXPECT_EQ(values_of<std::uint32_t>(device->download(*buffer))[0], 1u);
    fill_with(2);
  }).join();
  EXPECT_EQ(values_of<std::uint32_t>(device->download(*buffer))[0], 2u);
}

TEST_P(DeviceLife, OneThreadHoldsSeveralDevices) {
  const auto first = create_device(GetParam(), {}), second = create_device(GetParam(), {});
  const auto one = first->create_buffer(4, "one"), two = second->create_buffer(4, "two");
  const auto list = first->begin(), other = second->begin();
  list->fill(*one, 1);
  other->fill(*two, 2);
  first->submit(*list);
  second->submit(*other);
  EXPECT_EQ(values_of<std::uint32_t>(first->download(*one))[0], 1u);
  EXPECT_EQ(values_of<std::uint32_t>(second->download(*two))[0], 2u);
}

TEST(DeviceChoice, NamesAreReadBack) {
  for (const Backend backend : {Backend::best, Backend::vulkan, Backend::egl}) {
    EXPECT_EQ(backend_named(name_of(backend)), backend);
  }
  EXPECT_EQ(backend_named("metal"), std::nullopt);
}

TEST(DeviceChoice, TheBestIsHardwareFirstThenVulkan) {
  const std::vector<DeviceListing> listings = list_devices();
  const auto first = [&](bool software) {
    for (const DeviceListing& listing : listings) {
      if (listing.rejection_reason.empty() && listing.software == software) return listing.name;
    }
    return std::string();
  };
  EXPECT_EQ(create_device(Backend::best, {})->name(), first(false).empty() ? first(true) : first(false));
}

TEST(DeviceChoice, AnAbsentDriverIsListedWithTheReason) {
  // Both loaders read these variables at their first use, so this needs a new process.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        setenv("VK_ICD_FILENAMES", "/nonexistent.json", 1);
        setenv("VK_DRIVER_FILES", "/nonexistent.json", 1);
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json", 1);
        std::string text;
        for (const DeviceListing& listing : list_devices()) {
          text += std::string(name_of(listing.backend)) + ": " + listing.rejection_reason + "\n";
        }
        text += error_of<GpuError>([] { create_device(Backend::best, {}); });
        std::fputs(text.c_str(), stderr);
        std::exit(0);
      },
      testing::ExitedWithCode(0),
      "vulkan: no Vulkan device: no driver is installed.*\negl: no EGL device: no driver.*\nno usable "
      "GPU");
}

}  // namespace
}  // namespace lumigraft::relight::gpu
