#include "tests/capture/formats/coded_pictures.h"

#include <png.h>
#include <turbojpeg.h>
#include <webp/encode.h>

#include <stdexcept>

namespace lumigraft::test {

std::string png_bytes(const capture::Image<std::uint8_t>& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format =
      (picture.channels >= 3 ? PNG_FORMAT_FLAG_COLOR : 0u) | (picture.channels == 4 ? PNG_FORMAT_FLAG_ALPHA : 0u);
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.data.data(), 0, nullptr))
    throw std::runtime_error(image.message);
  bytes.resize(size);
  return bytes;
}

std::string jpeg_bytes(const capture::Image<std::uint8_t>& rgb) {
  const tjhandle encoder = tjInitCompress();
  unsigned char* data = nullptr;
  unsigned long size = 0;
  constexpr int kQuality = 95;
  const int failed =
      tjCompress2(encoder, rgb.data.data(), rgb.width, 0, rgb.height, TJPF_RGB, &data, &size, TJSAMP_444, kQuality, 0);
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  tjFree(data);
  tjDestroy(encoder);
  if (failed != 0) throw std::runtime_error("no JPEG");
  return bytes;
}

std::string webp_bytes(const capture::Image<std::uint8_t>& picture) {
  std::uint8_t* data = nullptr;
  const auto encode = picture.channels == 4 ? &WebPEncodeLosslessRGBA : &WebPEncodeLosslessRGB;
  const std::size_t size =
      encode(picture.data.data(), picture.width, picture.height, picture.channels * picture.width, &data);
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  WebPFree(data);
  if (size == 0) throw std::runtime_error("no WebP");
  return bytes;
}

}  // namespace lumigraft::test
