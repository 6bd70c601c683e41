// Errors of a caller are reported with the names of the shader.
#include "relight/gpu/egl/choose_device.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight::gpu {
namespace {

class DeviceMisuseTest : public DeviceTest {
 protected:
  void SetUp() override {
    tap_ = device_->create_compute("device_tap.comp");
    volume_ = device_->create_texture({.name = "volume", .width = 4, .height = 4, .depth = 4, .mips = 2});
    flat_ = device_->create_texture({.name = "flat", .width = 4, .height = 4, .attachment = true});
    places_ = device_->create_buffer(16, "places");
  }

  std::string dispatch(const ComputePipeline& pipeline, const std::vector<Binding>& bindings,
                       std::span<const std::byte> params = {}, int rows = 1) {
    return error_of<std::logic_error>([&] { device_->begin()->dispatch(pipeline, bindings, params, 1, rows); });
  }

  std::unique_ptr<ComputePipeline> tap_;
  std::unique_ptr<Texture> volume_, flat_;
  std::unique_ptr<Buffer> places_;
};

ON_BOTH_DEVICES(DeviceMisuseTest);

TEST_P(DeviceMisuseTest, WrongBindingsAreNamed) {
  const Binding places = storage(2, *places_), results = storage(3, *places_);
  EXPECT_EQ(dispatch(*tap_, {sampled(1, *volume_), places}),
            "shader device_tap.comp: slot 3 \"Results\" has nothing bound");
  EXPECT_EQ(dispatch(*tap_, {sampled(1, *volume_), places, results, storage(4, *places_)}),
            "shader device_tap.comp: slot 4 is bound but not declared");
  EXPECT_EQ(dispatch(*tap_, {sampled(1, *volume_), places, places, results}),
            "shader device_tap.comp: slot 2 \"Places\" is bound twice");
  EXPECT_EQ(dispatch(*tap_, {image(1, *volume_), places, results}),
            "shader device_tap.comp: slot 1 \"volume\" wants a sampled texture, not a storage image");
  EXPECT_EQ(dispatch(*tap_, {sampled(1, *flat_), places, results}),
            "shader device_tap.comp: slot 1 \"volume\" wants a 3D image, not texture \"flat\" (4x4 rgba16_float)");
  EXPECT_EQ(dispatch(*tap_, {sampled(1, *volume_), places, results}, bytes_of(1.0f)),
            "shader device_tap.comp: params has 4 bytes, its uniform block 0");
  EXPECT_EQ(dispatch(*tap_, {sampled(1, *volume_), places, results}, {}, 1 << 30).substr(0, 41),
            "shader device_tap.comp: 1073741824 groups");

  const auto halve = device_->create_compute("device_halve.comp");
  EXPECT_EQ(dispatch(*halve, {image(1, *volume_), image(2, *volume_)}),
            "shader device_halve.comp: slot 1 \"fine\" declares rgba32_float, not the format of texture \"volume\" "
            "(4x4x4 rgba16_float)");
  const auto ramp = device_->create_compute("device_ramp.comp");
  EXPECT_EQ(dispatch(*ramp, {image(1, *volume_)}, bytes_of(1.0f)),
            "shader device_ramp.comp: params has 4 bytes, its uniform block 16");
}

TEST_P(DeviceMisuseTest, WhatIsDeclaredButNotUsedNeedsNoBinding) {
  const auto unused = device_->create_compute("device_unused.comp");
  const auto result = device_->create_buffer(32, "result");
  const Binding bindings[] = {storage(1, *result)};
  const auto list = device_->begin();
  list->dispatch(*unused, bindings, {}, 1);
  device_->submit(*list);
  EXPECT_EQ(values_of<std::uint32_t>(device_->download(*result))[7], 7u);
}

TEST_P(DeviceMisuseTest, WrongTexturesBuffersAndTransfersAreNamed) {
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->create_texture({.name = "t", .width = 8, .mips = 5}); }),
            "texture \"t\" (8x1 rgba16_float): 5 mips; allowed are 1 to 4");
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->create_texture({.name = "t", .width = 0}); }),
            "texture \"t\" (0x1 rgba16_float): every edge must be at least 1");
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->create_buffer(0, "b"); }), "buffer \"b\" has no bytes");
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->create_compute("absent.comp"); }),
            "shader absent.comp: not built into this program; relight/shaders lists them");
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->upload(*places_, 8, std::vector<std::byte>(9)); }),
            "upload of 9 bytes at 8 to buffer \"places\", which has 16");
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->upload(*volume_, 1, std::vector<std::byte>(9)); }),
            "upload of 9 bytes to mip 1 of texture \"volume\" (4x4x4 rgba16_float), which has 64");
  const auto picture = device_->create_texture({.name = "picture", .width = 4, .height = 4});
  for (const Area& outside : {Area{2, 0, 3, 1}, Area{0, -1, 1, 1}, Area{0, 0, 0, 1}}) {
    const TexturePart part[] = {{picture.get(), outside}};
    EXPECT_NE(error_of<std::logic_error>([&] { device_->download(part); }).find("within a 2D texture"),
              std::string::npos);
  }
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->download(*volume_, 2); }),
            "there is no mip 2 of texture \"volume\" (4x4x4 rgba16_float)");
  const auto other = create_device(GetParam(), {});
  const auto theirs = other->create_texture({.name = "theirs"});
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->download(*theirs); }),
            "texture \"theirs\" belongs to another device");
}

TEST_P(DeviceMisuseTest, AListIsSubmittedOnce) {
  const auto list = device_->begin();
  device_->submit(*list);
  EXPECT_THROW(device_->submit(*list), std::logic_error);
  EXPECT_THROW(list->fill(*places_, 0), std::logic_error);
}

TEST_P(DeviceMisuseTest, WrongDrawsAreNamed) {
  RasterDesc desc{.vertex_shader = "device_triangles.vert",
                  .fragment_shader = "device_triangles.frag",
                  .vertex_stride_bytes = 28,
                  .attributes = {{0, 4, 0}},
                  .color_formats = {Format::rgba16_float, Format::r32_float}};
  const std::string shaders = "shader device_triangles.vert + device_triangles.frag: ";
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->create_raster(desc); }),
            shaders + "no attribute for location 1 \"color\"");
  desc.attributes.push_back({1, 3, 16});
  desc.color_formats.pop_back();
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->create_raster(desc); }),
            shaders + "no colour format for output 1 \"facing\"");
  desc.color_formats = {Format::rgba16_float, Format::r32_float, Format::r8_unorm};
  EXPECT_EQ(error_of<std::logic_error>([&] { device_->create_raster(desc); }), shaders + "colour 2 is never written");
  desc.color_formats.pop_back();

  const auto pipeline = device_->create_raster(desc);
  const auto facing = device_->create_texture(
      {.name = "facing", .width = 4, .height = 4, .format = Format::r32_float, .attachment = true});
  const auto depth = device_->create_texture(
      {.name = "depth", .width = 4, .height = 4, .format = Format::depth32_float, .attachment = true});
  const auto small = device_->create_texture({.name = "small", .format = Format::r32_float, .attachment = true});
  const auto draw = [&](const std::vector<const Texture*>& colors, const Texture& z,
                        const std::vector<DrawCall>& calls) {
    return error_of<std::logic_error>([&] { device_->begin()->draw(*pipeline, colors, z, calls); });
  };
  EXPECT_EQ(draw({flat_.get()}, *depth, {}), shaders + "1 colour attachments; it has 2 colour formats");
  EXPECT_EQ(draw({flat_.get(), small.get()}, *depth, {}),
            shaders + "colour 1, texture \"small\" (1x1 r32_float), has another size than \"flat\"");
  EXPECT_EQ(draw({flat_.get(), facing.get()}, *facing, {}),
            shaders + "depth, texture \"facing\" (4x4 r32_float), is not depth32_float");
  const std::array<float, 4> tint{};
  DrawCall call{.bindings = {sampled(1, *flat_)}, .params = bytes_of(tint)};
  EXPECT_EQ(draw({flat_.get(), facing.get()}, *depth, {call}),
            shaders + "texture \"flat\" is bound while it is drawn to");
  const auto one = device_->create_texture({.name = "one"});
  call.bindings = {sampled(1, *one)};
  EXPECT_EQ(draw({flat_.get(), facing.get()}, *depth, {call}), shaders + "a draw call without vertices or indices");
}

TEST(DeviceMessages, TheVulkanValidationLayerIsHeard) {
  const auto device = create_vulkan_device({.validation = true, .more_shaders = device_test_shaders()});
  const auto doubles = device->create_compute("device_doubles.comp");  // compiled when it is first used
  const auto numbers = device->create_buffer(64, "numbers");
  const std::string text = error_of<GpuError>([&] {
    auto list = device->begin();
    list->dispatch(*doubles, std::vector<Binding>{storage(1, *numbers)}, {}, 1);
    device->submit(*list);
  });
  EXPECT_NE(text.find("Float64"), std::string::npos) << text;
  device->submit(*device->begin());  // and only once
}

TEST(DeviceMessages, OpenGlIsHeard) {
  for (const bool validation : {false, true}) {
    const auto context =
        std::make_shared<egl::Context>(egl::open_best(validation), DeviceOptions{.validation = validation});
    const egl::Current current = context->enter();
    context->check("nothing");
    glUseProgram(12345);
    const std::string text = error_of<GpuError>([&] { context->check("using a program that is not there"); });
    EXPECT_EQ(text.find("using a program that is not there: GL_INVALID_VALUE"), 0u) << text;
    EXPECT_EQ(text.find("OpenGL debug output:") != std::string::npos, validation) << text;
    context->check("and only once");
  }
}

}  // namespace
}  // namespace lumigraft::relight::gpu
