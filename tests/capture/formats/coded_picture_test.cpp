#include "capture/formats/coded_picture.h"

#include <gtest/gtest.h>
#include <png.h>
#include <tiffio.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "capture/error.h"
#include "tests/capture/formats/coded_pictures.h"
#include "tests/capture/formats/png_writer.h"

namespace lumigraft::test {
namespace {

namespace fs = std::filesystem;
using Picture = capture::Image<std::uint8_t>;

constexpr int kWidth = 13, kHeight = 7;

/// Every channel differs, and no symmetry hides an exchange.
Picture gradients(int channels) {
  Picture picture(kWidth, kHeight, channels);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < channels; ++c) picture.at(x, y, c) = static_cast<std::uint8_t>(40 * c + 5 * x + 11 * y);
    }
  }
  return picture;
}

Picture decoded(const std::string& bytes, int max_edge = 100) {
  return capture::decode_coded_picture({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, max_edge);
}

int largest_difference(const Picture& a, const Picture& b) {
  if (a.width != b.width || a.height != b.height || a.channels != b.channels) return 256;
  int largest = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) largest = std::max(largest, std::abs(a.data[i] - b.data[i]));
  return largest;
}

class CodedPicture : public testing::Test {
 protected:
  CodedPicture() : file_(fs::temp_directory_path() / ("lumigraft_coded_picture_" + std::to_string(getpid()))) {}
  ~CodedPicture() override { fs::remove(file_); }

  std::string file_bytes() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  /// R G B of 8 or 16 bits.
  std::string tiff_bytes(std::uint16_t compression, bool deep = false) const {
    const Picture picture = gradients(3);
    TIFF* tiff = TIFFOpen(file_.c_str(), "w");
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kWidth);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kHeight);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, deep ? 16 : 8);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
    const bool jpeg = compression == COMPRESSION_JPEG;
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, jpeg ? PHOTOMETRIC_YCBCR : PHOTOMETRIC_RGB);
    if (jpeg) TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, jpeg ? 16 : 2);
    for (int y = 0; y < kHeight; ++y) {
      std::vector<std::uint8_t> row(&picture.at(0, y), &picture.at(0, y) + 3 * kWidth);
      std::vector<std::uint16_t> deep_row(row.begin(), row.end());
      for (auto& v : deep_row) v = static_cast<std::uint16_t>(257 * v);
      TIFFWriteScanline(tiff, deep ? static_cast<void*>(deep_row.data()) : row.data(), static_cast<std::uint32_t>(y),
                        0);
    }
    TIFFClose(tiff);
    return file_bytes();
  }

  /// With libpng's options: a palette, transparent colours, interlacing.
  template <typename Options>
  std::string special_png(int colour, int bits, const std::vector<std::vector<std::uint8_t>>& rows,
                          Options options) const {
    std::FILE* out = std::fopen(file_.c_str(), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, out);
    const int interlace = options(png, info);
    const auto width = static_cast<png_uint_32>(rows[0].size() * 8 / static_cast<std::size_t>(bits));
    png_set_IHDR(png, info, width, static_cast<png_uint_32>(rows.size()), bits, colour, interlace,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    std::vector<png_bytep> pointers;
    for (const auto& row : rows) pointers.push_back(const_cast<png_bytep>(row.data()));
    png_write_image(png, pointers.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    std::fclose(out);
    return file_bytes();
  }

  fs::path file_;
};

TEST_F(CodedPicture, PngOfEveryKind) {
  EXPECT_EQ(largest_difference(decoded(png_bytes(gradients(3))), gradients(3)), 0);
  EXPECT_EQ(largest_difference(decoded(png_bytes(gradients(4))), gradients(4)), 0);
  const Picture grey = gradients(1), replicated = decoded(png_bytes(grey));
  ASSERT_EQ(replicated.channels, 3);
  for (std::size_t i = 0; i < replicated.data.size(); ++i) EXPECT_EQ(replicated.data[i], grey.data[i / 3]);
}

TEST_F(CodedPicture, PngOf16BitsIsRounded) {
  capture::Image<std::uint16_t> deep(kWidth, kHeight, 1);
  for (std::size_t i = 0; i < deep.data.size(); ++i) deep.data[i] = static_cast<std::uint16_t>(700 * i);
  write_png(file_, deep);
  const Picture picture = decoded(file_bytes());
  ASSERT_EQ(picture.channels, 3);
  for (std::size_t i = 0; i < deep.data.size(); ++i)
    EXPECT_NEAR(picture.data[3 * i], deep.data[i] / 257.0, 0.501) << i;  // half a step, and libpng's fixed point
}

TEST_F(CodedPicture, PngWithAPaletteAndATransparentColour) {
  const std::string bytes = special_png(PNG_COLOR_TYPE_PALETTE, 8, {{0, 1, 2, 1}}, [](png_structp png, png_infop info) {
    png_color colours[3] = {{1, 2, 3}, {40, 50, 60}, {200, 210, 220}};
    png_byte alpha[2] = {255, 128};
    png_set_PLTE(png, info, colours, 3);
    png_set_tRNS(png, info, alpha, 2, nullptr);
    return PNG_INTERLACE_NONE;
  });
  EXPECT_EQ(decoded(bytes).data,
            (std::vector<std::uint8_t>{1, 2, 3, 255, 40, 50, 60, 128, 200, 210, 220, 255, 40, 50, 60, 128}));
}

TEST_F(CodedPicture, PngOfOneBit) {
  const Picture picture = decoded(special_png(PNG_COLOR_TYPE_GRAY, 1, {{0x81}}, [](auto, auto) { return 0; }));
  ASSERT_EQ(picture.width, 8);
  ASSERT_EQ(picture.channels, 3);
  for (int x = 0; x < 8; ++x) EXPECT_EQ(picture.at(x, 0, 1), x == 0 || x == 7 ? 255 : 0);
}

TEST_F(CodedPicture, InterlacedPng) {
  std::vector<std::vector<std::uint8_t>> rows;
  const Picture grey = gradients(1);
  for (int y = 0; y < kHeight; ++y) rows.emplace_back(&grey.at(0, y), &grey.at(0, y) + kWidth);
  const Picture picture =
      decoded(special_png(PNG_COLOR_TYPE_GRAY, 8, rows, [](auto, auto) { return PNG_INTERLACE_ADAM7; }));
  EXPECT_EQ(largest_difference(picture, decoded(png_bytes(grey))), 0);
}

TEST_F(CodedPicture, JpegAndWebp) {
  EXPECT_LE(largest_difference(decoded(jpeg_bytes(gradients(3))), gradients(3)), 6);
  EXPECT_EQ(largest_difference(decoded(webp_bytes(gradients(3))), gradients(3)), 0);
  EXPECT_EQ(largest_difference(decoded(webp_bytes(gradients(4))), gradients(4)), 0);
}

// As printers' programs write them: Adobe's inks are inverted.
TEST_F(CodedPicture, JpegOfFourInks) {
  Picture inks(16, 16, 4);
  for (std::size_t i = 0; i < inks.data.size(); ++i)
    inks.data[i] = std::array<std::uint8_t, 4>{250, 100, 30, 200}[i % 4];
  const tjhandle encoder = tjInitCompress();
  unsigned char* data = nullptr;
  unsigned long size = 0;
  ASSERT_EQ(tjCompress2(encoder, inks.data.data(), 16, 0, 16, TJPF_CMYK, &data, &size, TJSAMP_444, 95, 0), 0);
  const Picture picture = decoded(std::string(reinterpret_cast<char*>(data), size));
  tjFree(data);
  tjDestroy(encoder);
  ASSERT_EQ(picture.channels, 3);
  EXPECT_NEAR(picture.at(5, 5, 0), 250 * 200 / 255, 3);
  EXPECT_NEAR(picture.at(5, 5, 1), 100 * 200 / 255, 3);
  EXPECT_NEAR(picture.at(5, 5, 2), 30 * 200 / 255, 3);
}

TEST_F(CodedPicture, Tiff) {
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS})
    EXPECT_EQ(largest_difference(decoded(tiff_bytes(static_cast<std::uint16_t>(compression))), gradients(3)), 0);
  EXPECT_EQ(largest_difference(decoded(tiff_bytes(COMPRESSION_NONE, true)), gradients(3)), 0);
  // Chroma has half the resolution; it is smooth.
  EXPECT_LE(largest_difference(decoded(tiff_bytes(COMPRESSION_JPEG)), gradients(3)), 40);
}

TEST_F(CodedPicture, BmpAndPnm) {
  const std::string bmp(
      "BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\1\0\0\0\1\0\0\0\1\0\x18\0\0\0\0\0\4\0\0\0\0\0\0\0\0\0\0\0"
      "\0\0\0\0\0\0\0\0\x1e\x14\x0a\0",
      58);
  EXPECT_EQ(decoded(bmp).data, (std::vector<std::uint8_t>{10, 20, 30}));
  EXPECT_EQ(decoded("P6\n2 1\n255\nabcdef").data, (std::vector<std::uint8_t>{'a', 'b', 'c', 'd', 'e', 'f'}));
  EXPECT_EQ(decoded("P5\n1 1\n255\nz").data, (std::vector<std::uint8_t>{'z', 'z', 'z'}));
}

TEST_F(CodedPicture, LargerThanAllowedIsRefused) {
  const Picture wide(101, 2, 3);
  std::string pnm = "P6\n101 2\n255\n" + std::string(606, 'x');
  for (const std::string& bytes : {png_bytes(wide), jpeg_bytes(wide), webp_bytes(wide), pnm}) {
    EXPECT_NO_THROW(EXPECT_EQ(decoded(bytes, 101).width, 101));
    try {
      decoded(bytes);
      ADD_FAILURE() << "not refused: " << bytes.substr(0, 4);
    } catch (const capture::InputError& error) {
      EXPECT_STREQ(error.what(), "found 101 x 2 pixels, allowed: at most 100 along an edge");
    }
  }
  EXPECT_THROW(decoded(tiff_bytes(COMPRESSION_NONE), 12), capture::InputError);
}

// Without its pixels, as a picture that would fill the memory when decoded.
TEST_F(CodedPicture, AHeaderThatStatesALargePictureIsRefusedBeforeItsPixels) {
  EXPECT_TRUE(decoded("P6\n60000 60000\n255\nx").empty());
  std::string png = png_bytes(gradients(3));
  png.replace(16, 17, std::string("\0\0\xff\0\0\0\xff\0\x08\2\0\0\0\x3c\xe4\x32\xdf", 17));
  EXPECT_THROW(decoded(png), capture::InputError);
}

TEST_F(CodedPicture, WhatIsCutShortOrUnknownIsEmpty) {
  EXPECT_TRUE(decoded("").empty());
  EXPECT_TRUE(decoded("GIF89a......").empty());
  const std::string png = png_bytes(gradients(3)), webp = webp_bytes(gradients(3)), tiff = tiff_bytes(COMPRESSION_NONE);
  for (const std::string& bytes : {png, webp, jpeg_bytes(gradients(3)), tiff}) {
    EXPECT_TRUE(decoded(bytes.substr(0, 5)).empty());
    EXPECT_TRUE(decoded(bytes.substr(0, 20)).empty());
  }
  EXPECT_TRUE(decoded(png.substr(0, png.size() / 2)).empty());
  EXPECT_TRUE(decoded(webp.substr(0, webp.size() / 2)).empty());
}

}  // namespace
}  // namespace lumigraft::test
