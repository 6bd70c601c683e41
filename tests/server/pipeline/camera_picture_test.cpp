#include "server/pipeline/camera_picture.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "capture/formats/picture_file.h"
#include "capture/formats/picture_writer.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

std::filesystem::path scratch(const char* name) {
  return std::filesystem::path(testing::TempDir()) / ("lumigraft-" + std::to_string(getpid()) + "-" + name);
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(WritePicture, PngKeepsEveryBitAndWritesTheSameBytes) {
  capture::Image<std::uint8_t> image(37, 21, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<std::uint8_t>(i * 7919 >> 3);
  }
  capture::write_png(scratch("a.png"), image);
  capture::write_png(scratch("b.png"), image);
  EXPECT_EQ(capture::read_encoded(scratch("a.png")).data, image.data);
  EXPECT_EQ(bytes_of(scratch("a.png")), bytes_of(scratch("b.png")));
  EXPECT_THROW(capture::write_png("/nonexistent/a.png", image), std::runtime_error);
}

TEST(WritePicture, ExrKeepsFloats) {
  capture::Image<float> color(5, 4, 3), depth(5, 4, 1);
  for (std::size_t i = 0; i < color.data.size(); ++i) {
    color.data[i] = 0.1f * static_cast<float>(i) - 2.0f;
  }
  for (std::size_t i = 0; i < depth.data.size(); ++i) {
    depth.data[i] = 1.0f / static_cast<float>(1 + i);
  }
  capture::write_exr(scratch("color.exr"), color);
  capture::write_exr(scratch("depth.exr"), depth);
  EXPECT_EQ(capture::read_radiance(scratch("color.exr")).data, color.data);
  EXPECT_EQ(read_true_depth(scratch("depth.exr")).data, depth.data);
}

TEST(RawFrame, RadianceIsShownThroughTheExposure) {
  capture::Frame picture;
  picture.exposure = 2.0;
  picture.radiance = capture::Image<float>(3, 1, 3);
  picture.radiance.data = {0.0f, 0.25f, 0.5f, 7.0f, -1.0f, 0.107f, 0, 0, 0};
  const capture::Image<std::uint8_t> shown = camera_picture(picture);
  EXPECT_EQ(shown.at(0, 0, 0), 0);
  EXPECT_EQ(shown.at(0, 0, 1), 188);  // sRGB of 0.5 is 0.7354
  EXPECT_EQ(shown.at(0, 0, 2), 255);
  EXPECT_EQ(shown.at(1, 0, 0), 255);
  EXPECT_EQ(shown.at(1, 0, 1), 0);
  EXPECT_EQ(shown.at(1, 0, 2), 127);  // sRGB of 0.214 is 0.500
  picture.encoded = capture::Image<std::uint8_t>(1, 1, 3, 9);
  EXPECT_EQ(camera_picture(picture).data, picture.encoded.data);
}

}  // namespace
}  // namespace lumigraft::server
