// Conversion of SPIR-V to OpenGL: bindings are mapped to units, and the product stays within OpenGL drivers' limits.
#include <gtest/gtest.h>

#include "relight/gpu/egl/glsl.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight::gpu {

std::span<const ShaderCode> product_shaders();

namespace {

TEST(DeviceGlsl, SlotsAreNumberedByKindAndWhatIsUnusedIsLeftOut) {
  const ShaderCode& tap = find_shader("device_tap.comp", device_test_shaders());
  const std::map<int, int> units = egl::assign_units(reflect_shader(tap));
  EXPECT_EQ(units, (std::map<int, int>{{1, 0}, {2, 0}, {3, 1}}));
  const std::string text = egl::glsl_of(tap, units);
  EXPECT_NE(text.find("layout(binding = 0) uniform sampler3D volume"), std::string::npos) << text;
  EXPECT_NE(text.find("layout(binding = 0, std430) readonly buffer Places"), std::string::npos) << text;
  EXPECT_NE(text.find("layout(binding = 1, std430) writeonly buffer Results"), std::string::npos) << text;

  const ShaderCode& unused = find_shader("device_unused.comp", device_test_shaders());
  const std::string without = egl::glsl_of(unused, egl::assign_units(reflect_shader(unused)));
  EXPECT_EQ(without.find("unused"), std::string::npos) << without;
}

TEST(DeviceGlsl, TheProductFitsIntoWhatDriversOfGpusGrant) {
  // Limits per compute shader: 8 images and 16 storage buffers with NVIDIA's and AMD's drivers; 16 textures is the
  // minimum of OpenGL.
  for (const ShaderCode& shader : product_shaders()) {
    std::array<int, 3> count{};
    for (const auto& [number, slot] : reflect_shader(shader).slots)
      count[static_cast<std::size_t>(slot.kind)] += slot.used;
    EXPECT_LE(count[static_cast<std::size_t>(Binding::Kind::sampled)], 16) << shader.name;
    EXPECT_LE(count[static_cast<std::size_t>(Binding::Kind::storage_image)], 8) << shader.name;
    EXPECT_LE(count[static_cast<std::size_t>(Binding::Kind::storage_buffer)], 16) << shader.name;
  }
}

}  // namespace
}  // namespace lumigraft::relight::gpu
