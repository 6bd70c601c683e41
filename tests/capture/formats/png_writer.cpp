#include "tests/capture/formats/png_writer.h"

#include <png.h>

#include <cstring>
#include <stdexcept>

namespace lumigraft::test {
namespace {

void write(const std::filesystem::path& file, const void* pixels, int width, int height, int channels, bool deep) {
  png_image image;
  std::memset(&image, 0, sizeof(image));
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = (channels >= 3 ? PNG_FORMAT_FLAG_COLOR : 0u) | (channels == 4 ? PNG_FORMAT_FLAG_ALPHA : 0u) |
                 (deep ? PNG_FORMAT_FLAG_LINEAR : 0u);
  if (png_image_write_to_file(&image, file.c_str(), 0, pixels, 0, nullptr) == 0) {
    throw std::runtime_error(image.message);
  }
}

}  // namespace

void write_png(const std::filesystem::path& file, const capture::Image<std::uint8_t>& image) {
  write(file, image.data.data(), image.width, image.height, image.channels, false);
}

void write_png(const std::filesystem::path& file, const capture::Image<std::uint16_t>& image) {
  write(file, image.data.data(), image.width, image.height, image.channels, true);
}

}  // namespace lumigraft::test
