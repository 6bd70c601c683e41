#include <png.h>

#include <cstring>

#include "capture/error.h"
#include "capture/formats/picture_decoders.h"

namespace lumigraft::capture {
namespace {

struct PngBytes {
  const std::uint8_t* at;
  std::size_t left;
};

void read(png_structp png, png_bytep out, std::size_t count) {
  auto* bytes = static_cast<PngBytes*>(png_get_io_ptr(png));
  if (count > bytes->left) png_error(png, "cut short");
  std::memcpy(out, bytes->at, count);
  bytes->at += count;
  bytes->left -= count;
}

[[noreturn]] void on_error(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void on_warning(png_structp, png_const_charp) {}

/// Decodes into `rows`, which point to rows of `row_bytes` bytes. libpng leaves by longjmp, so no object in this
/// function may have a destructor.
bool decode(png_structp png, png_infop info, PngBytes* bytes, std::uint8_t** rows, std::size_t row_bytes, bool rgb8) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, bytes, read);
  png_read_info(png, info);
  if (rgb8) {
    png_set_expand(png);
    png_set_strip_alpha(png);
    png_set_gray_to_rgb(png);
  } else {
    png_set_swap(png);  // PNG is big-endian
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_rowbytes(png, info) != row_bytes) return false;
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

template <typename T>
Image<T> decoded(const std::vector<std::uint8_t>& file, int channels) {
  const PictureHeader header = png_header(file);
  Image<T> image(header.width, header.height, channels);
  std::vector<std::uint8_t*> rows;
  rows.reserve(static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) rows.push_back(reinterpret_cast<std::uint8_t*>(&image.at(0, y)));
  PngBytes bytes{file.data(), file.size()};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning);
  png_infop info = png_create_info_struct(png);
  const std::size_t row_bytes = sizeof(T) * static_cast<std::size_t>(image.width) * image.channels;
  const bool good = decode(png, info, &bytes, rows.data(), row_bytes, sizeof(T) == 1);
  png_destroy_read_struct(&png, &info, nullptr);
  refuse_if(!good, "found a picture that is damaged or cut short");
  return image;
}

std::uint32_t big_endian(const std::uint8_t* at) {
  return std::uint32_t{at[0]} << 24 | std::uint32_t{at[1]} << 16 | std::uint32_t{at[2]} << 8 | at[3];
}

}  // namespace

bool is_png(const std::vector<std::uint8_t>& start) {
  return start.size() >= 8 && png_sig_cmp(start.data(), 0, 8) == 0;
}

/// The IHDR chunk (PNG specification, 11.2.2).
PictureHeader png_header(const std::vector<std::uint8_t>& start) {
  refuse_if(start.size() < 33 || std::memcmp(start.data() + 12, "IHDR", 4) != 0, "found a PNG that ends in its header");
  const std::uint32_t width = big_endian(&start[16]), height = big_endian(&start[20]);
  refuse_if(width == 0 || height == 0 || width > kMaxSide_px || height > kMaxSide_px, "found a PNG of impossible size");
  return {.width = static_cast<int>(width),
          .height = static_cast<int>(height),
          .bits = start[24],
          .gray = start[25] == PNG_COLOR_TYPE_GRAY};
}

Image<std::uint8_t> decode_png8(const std::vector<std::uint8_t>& bytes) { return decoded<std::uint8_t>(bytes, 3); }

Image<std::uint16_t> decode_png16(const std::vector<std::uint8_t>& bytes) { return decoded<std::uint16_t>(bytes, 1); }

}  // namespace lumigraft::capture
