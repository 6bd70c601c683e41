#include <png.h>

#include <cstring>

#include "capture/error.h"
#include "capture/formats/coded_picture.h"
#include "capture/formats/picture_decoders.h"

namespace lumigraft::capture {
namespace {

struct PngBytes {
  const std::uint8_t* at;
  std::size_t left;
};

/// libpng's objects of one picture.
struct PngReader {
  png_structp png = nullptr;
  png_infop info = nullptr;

  PngReader(png_error_ptr on_error, png_error_ptr on_warning)
      : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning)),
        info(png_create_info_struct(png)) {}
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
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

enum class PngPixels { rgb8, rgb8_or_rgba8, gray16 };

/// Reads up to the pixels. libpng leaves by longjmp, so no object in this function or the next may have a destructor.
bool begin(png_structp png, png_infop info, PngBytes* bytes, PngPixels pixels) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, bytes, read);
  png_read_info(png, info);
  if (pixels == PngPixels::gray16) {
    png_set_swap(png);  // PNG is big-endian
  } else {
    png_set_expand(png);
    png_set_gray_to_rgb(png);
    if (pixels == PngPixels::rgb8) png_set_strip_alpha(png);
    if (pixels == PngPixels::rgb8_or_rgba8) png_set_scale_16(png);
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  return true;
}

/// Decodes into `rows`, which point to rows of `row_bytes` bytes.
bool finish(png_structp png, png_infop info, std::uint8_t** rows, std::size_t row_bytes) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  if (png_get_rowbytes(png, info) != row_bytes) return false;
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

template <typename T>
bool finish(const PngReader& reader, Image<T>* image) {
  std::vector<std::uint8_t*> rows;
  rows.reserve(static_cast<std::size_t>(image->height));
  for (int y = 0; y < image->height; ++y) rows.push_back(reinterpret_cast<std::uint8_t*>(&image->at(0, y)));
  const std::size_t row_bytes = sizeof(T) * static_cast<std::size_t>(image->width) * image->channels;
  return finish(reader.png, reader.info, rows.data(), row_bytes);
}

template <typename T>
Image<T> decoded(const std::vector<std::uint8_t>& file, int channels) {
  const PictureHeader header = png_header(file);
  Image<T> image(header.width, header.height, channels);
  PngBytes bytes{file.data(), file.size()};
  const PngReader reader(on_error, on_warning);
  const bool good = begin(reader.png, reader.info, &bytes, sizeof(T) == 1 ? PngPixels::rgb8 : PngPixels::gray16) &&
                    finish(reader, &image);
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

Image<std::uint8_t> decode_any_png(std::span<const std::uint8_t> file, int max_edge) {
  PngBytes bytes{file.data(), file.size()};
  const PngReader reader(on_error, on_warning);
  if (!begin(reader.png, reader.info, &bytes, PngPixels::rgb8_or_rgba8)) return {};
  const png_uint_32 width = png_get_image_width(reader.png, reader.info),
                    height = png_get_image_height(reader.png, reader.info);
  refuse_large_picture(width, height, max_edge);
  Image<std::uint8_t> image(static_cast<int>(width), static_cast<int>(height),
                            png_get_channels(reader.png, reader.info));
  return finish(reader, &image) ? image : Image<std::uint8_t>{};
}

}  // namespace lumigraft::capture
