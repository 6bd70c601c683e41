#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <vector>

#include "capture/formats/coded_picture.h"
#include "capture/formats/picture_decoders.h"

// libav reads TIFF, too, but some kinds, as JPEG in TIFF, in wrong colours.
namespace lumigraft::capture {
namespace {

struct TiffBytes {
  std::span<const std::uint8_t> bytes;
  std::uint64_t at = 0;
};

tmsize_t read_bytes(thandle_t handle, void* out, tmsize_t count) {
  auto* file = static_cast<TiffBytes*>(handle);
  const std::uint64_t left = file->bytes.size() - std::min<std::uint64_t>(file->at, file->bytes.size());
  const std::uint64_t taken = std::min(left, static_cast<std::uint64_t>(std::max<tmsize_t>(count, 0)));
  if (taken > 0) std::memcpy(out, file->bytes.data() + file->at, taken);
  file->at += taken;
  return static_cast<tmsize_t>(taken);
}

tmsize_t write_nothing(thandle_t, void*, tmsize_t) { return 0; }

toff_t seek_byte(thandle_t handle, toff_t offset, int whence) {
  auto* file = static_cast<TiffBytes*>(handle);
  const toff_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? file->at : file->bytes.size();
  return file->at = base + offset;
}

int close_nothing(thandle_t) { return 0; }
toff_t byte_count(thandle_t handle) { return static_cast<TiffBytes*>(handle)->bytes.size(); }

}  // namespace

Image<std::uint8_t> decode_tiff(std::span<const std::uint8_t> bytes, int max_edge) {
  TIFFSetErrorHandler(nullptr);  // which prints to the terminal
  TIFFSetWarningHandler(nullptr);
  TiffBytes file{bytes};
  const std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(
      TIFFClientOpen("picture", "rm", &file, read_bytes, write_nothing, seek_byte, close_nothing, byte_count, nullptr,
                     nullptr),
      &TIFFClose);
  std::uint32_t width = 0, height = 0;
  if (!tiff || !TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width) ||
      !TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height))
    return {};
  refuse_large_picture(width, height, max_edge);
  std::vector<std::uint32_t> pixels(std::size_t{width} * height);
  if (pixels.empty() ||
      !TIFFReadRGBAImageOriented(tiff.get(), width, height, pixels.data(), ORIENTATION_TOPLEFT, /*stop_on_error=*/1))
    return {};
  Image<std::uint8_t> picture(static_cast<int>(width), static_cast<int>(height), 3);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::array rgb = {TIFFGetR(pixels[i]), TIFFGetG(pixels[i]), TIFFGetB(pixels[i])};
    std::transform(rgb.begin(), rgb.end(), &picture.data[3 * i], [](auto v) { return static_cast<std::uint8_t>(v); });
  }
  return picture;
}

}  // namespace lumigraft::capture
