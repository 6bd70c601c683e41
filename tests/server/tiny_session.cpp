#include "tests/server/tiny_session.h"

#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <vector>

#include "capture/formats/picture_writer.h"

namespace lumigraft::server {
namespace {

constexpr const char* kSession = R"(format = 1
name = "tiny"

[color]
source = "images:color.txt"
width = 64
height = 48
fx = 52.5
fy = 52.5
cx = 31.5
cy = 23.5
exposure = 3.0
response = "srgb"

[depth]
source = "images:depth.txt"
unit_m = 0.001
registered = true

[tag]
family = "tag36h11"
id = 2
size_m = 0.16
)";

constexpr const char* kExhibit = R"([[object]]
name = "pyramid"
model = "pyramid.obj"
position_m = [0.05, 0.1, 0.0]
)";

constexpr const char* kPyramid = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

void write_depth(const std::filesystem::path& path) {
  const std::vector<std::uint16_t> depth(TinySession::kWidth * TinySession::kHeight, 1000);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = TinySession::kWidth;
  image.height = TinySession::kHeight;
  image.format = PNG_FORMAT_LINEAR_Y;
  ASSERT_TRUE(png_image_write_to_file(&image, path.c_str(), 0, depth.data(), 0, nullptr));
}

}  // namespace

TinySession::TinySession(const std::string& name)
    : folder(std::filesystem::path(testing::TempDir()) / ("lumigraft-" + std::to_string(getpid()) + "-" + name)) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "color");
  std::filesystem::create_directories(folder / "depth");
  write("session.toml", kSession);
  write("exhibit.toml", kExhibit);
  write("pyramid.obj", kPyramid);
  std::string color, depth;
  for (int i = 0; i < kFrames; ++i) {
    const std::string file = "/00000" + std::to_string(i) + ".png";
    capture::Image<std::uint8_t> picture(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        picture.at(x, y, 0) = static_cast<std::uint8_t>(4 * x);
        picture.at(x, y, 1) = static_cast<std::uint8_t>(5 * y);
        picture.at(x, y, 2) = static_cast<std::uint8_t>(60 * i);
      }
    }
    capture::write_png(folder / ("color" + file), picture);
    write_depth(folder / ("depth" + file));
    const std::string time = "0." + std::to_string(i) + " ";
    color += time + "color" + file + "\n";
    depth += time + "depth" + file + "\n";
  }
  write("color.txt", color);
  write("depth.txt", depth);
}

TinySession::~TinySession() {
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
}

void TinySession::write(const std::string& file, const std::string& text) const {
  std::ofstream(folder / file, std::ios::binary) << text;
}

std::string TinySession::read(const std::string& file) const {
  std::ifstream in(folder / file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void TinySession::edit(const std::string& file, const std::string& from, const std::string& to) const {
  std::string text = read(file);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  write(file, text.replace(at, from.size(), to));
}

}  // namespace lumigraft::server
