#include "capture/formats/pixel_format.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumigraft::capture {
namespace {

constexpr int kWidth = 32;
constexpr int kHeight = 16;

/// A frame of one colour in `format`, made by the definition of the format.
std::vector<std::uint8_t> flat(PixelFormat format, std::array<std::uint8_t, 3> rgb) {
  const double r = rgb[0], g = rgb[1], b = rgb[2];
  // ITU-R BT.601-7, 2.5: 8 bits, luma 16 to 235, chroma 16 to 240.
  const double luma = 0.299 * r + 0.587 * g + 0.114 * b;
  const auto y = static_cast<std::uint8_t>(std::lround(16 + 219.0 / 255.0 * luma));
  const auto u = static_cast<std::uint8_t>(std::lround(128 + 224.0 / 255.0 * (b - luma) / 1.772));
  const auto v = static_cast<std::uint8_t>(std::lround(128 + 224.0 / 255.0 * (r - luma) / 1.402));
  std::vector<std::uint8_t> out(*bytes_of(format, kWidth, kHeight));
  const auto bayer = [&](const char* two_by_two) {
    for (int i = 0; i < kWidth * kHeight; ++i) {
      const char c = two_by_two[2 * (i / kWidth % 2) + i % 2];
      out[static_cast<std::size_t>(i)] = c == 'r' ? rgb[0] : c == 'g' ? rgb[1] : rgb[2];
    }
  };
  for (std::size_t i = 0; i < out.size(); ++i) {
    switch (format) {
      case PixelFormat::rgb8:
        out[i] = rgb[i % 3];
        break;
      case PixelFormat::bgr8:
        out[i] = rgb[2 - i % 3];
        break;
      case PixelFormat::grey8:
        out[i] = rgb[0];
        break;
      case PixelFormat::grey10:
      case PixelFormat::grey12: {
        const int value = (rgb[0] << (grey_bits(format) - 8)) + 1;
        out[i] = static_cast<std::uint8_t>(i % 2 == 1 ? value >> 8 : value);
        break;
      }
      case PixelFormat::grey16:
        out[i] = i % 2 == 1 ? rgb[0] : 77;
        break;
      case PixelFormat::yuyv:
        out[i] = i % 2 == 0 ? y : i % 4 == 1 ? u : v;
        break;
      case PixelFormat::uyvy:
        out[i] = i % 2 == 1 ? y : i % 4 == 0 ? u : v;
        break;
      case PixelFormat::nv12:
        out[i] = i < kWidth * kHeight ? y : i % 2 == 0 ? u : v;
        break;
      default:
        break;
    }
  }
  if (format == PixelFormat::bayer_rggb8) bayer("rggb");
  if (format == PixelFormat::bayer_bggr8) bayer("bggr");
  if (format == PixelFormat::bayer_gbrg8) bayer("gbrg");
  if (format == PixelFormat::bayer_grbg8) bayer("grbg");
  return out;
}

constexpr std::array kUncompressed = {PixelFormat::rgb8,        PixelFormat::bgr8,        PixelFormat::grey8,
                                      PixelFormat::grey16,      PixelFormat::yuyv,        PixelFormat::bayer_rggb8,
                                      PixelFormat::bayer_bggr8, PixelFormat::bayer_gbrg8, PixelFormat::bayer_grbg8,
                                      PixelFormat::nv12,        PixelFormat::uyvy,        PixelFormat::grey10,
                                      PixelFormat::grey12};

TEST(PixelFormats, UniformColoursConvertCorrectly) {
  PixelConverter converter;
  for (const PixelFormat format : kUncompressed) {
    for (const std::array<std::uint8_t, 3> rgb :
         {std::array<std::uint8_t, 3>{200, 100, 50}, {20, 130, 240}, {0, 0, 0}, {255, 255, 255}}) {
      const auto picture = converter.to_rgb(format, kWidth, kHeight, flat(format, rgb));
      ASSERT_TRUE(picture) << name_of(format);
      const bool grey = grey_bits(format) != 0;
      const int tolerance = is_yuv(format) ? 2 : 0;
      for (int i = 0; i < kWidth * kHeight; ++i) {
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(picture->data[static_cast<std::size_t>(3 * i + c)], rgb[grey ? 0 : c], tolerance)
              << name_of(format) << ' ' << i % kWidth << ' ' << i / kWidth << ' ' << c;
        }
      }
    }
  }
}

TEST(PixelFormats, RowPaddingIsRemoved) {
  constexpr std::size_t kPadding = 7;
  for (const PixelFormat format : kUncompressed) {
    std::vector<std::uint8_t> tight(*bytes_of(format, kWidth, kHeight));
    for (std::size_t i = 0; i < tight.size(); ++i) {
      tight[i] = static_cast<std::uint8_t>(i * 31);
    }
    const std::size_t row = format == PixelFormat::nv12 ? kWidth : tight.size() / kHeight;
    std::vector<std::uint8_t> padded;
    for (std::size_t at = 0; at < tight.size(); at += row) {
      padded.insert(padded.end(), tight.begin() + static_cast<std::ptrdiff_t>(at),
                    tight.begin() + static_cast<std::ptrdiff_t>(at + row));
      padded.insert(padded.end(), kPadding, 0xEE);
    }
    padded.resize(padded.size() - kPadding);  // drivers may omit the padding of the last row
    EXPECT_EQ(without_padding(format, kWidth, kHeight, row + kPadding, padded), tight) << name_of(format);
    padded.pop_back();
    EXPECT_TRUE(without_padding(format, kWidth, kHeight, row + kPadding, padded).empty()) << name_of(format);
    EXPECT_TRUE(without_padding(format, kWidth, kHeight, row - 1, tight).empty()) << name_of(format);
  }
}

// Rows of whole vectors are written into the image itself, others by way of padded ones.
TEST(PixelFormats, RowsOfAnyLengthAreConvertedAlike) {
  constexpr int kWide = 2 * kWidth;
  PixelConverter converter;
  for (const PixelFormat format : kUncompressed) {
    std::vector<std::uint8_t> wide(*bytes_of(format, kWide, kHeight));
    for (std::size_t i = 0; i < wide.size(); ++i) wide[i] = static_cast<std::uint8_t>(i * i * 31 >> 3);
    const std::size_t row = format == PixelFormat::nv12 ? kWide : wide.size() / kHeight;
    const auto left = without_padding(format, kWidth, kHeight, row, wide);
    const auto full = converter.to_rgb(format, kWide, kHeight, wide),
               half = converter.to_rgb(format, kWidth, kHeight, left);
    ASSERT_TRUE(full && half) << name_of(format);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth - 4; ++u) {  // beyond, a neighbour is missing
        for (int c = 0; c < 3; ++c) ASSERT_EQ(full->at(u, v, c), half->at(u, v, c)) << name_of(format) << u << ' ' << v;
      }
    }
  }
}

TEST(PixelFormats, NamesAndFourCharacterCodesRoundTrip) {
  for (const PixelFormat format : kUncompressed) {
    EXPECT_EQ(pixel_format_named(name_of(format)), format);
    EXPECT_EQ(pixel_format_of(*fourcc_of(format)), format);
  }
  EXPECT_EQ(pixel_format_named("mjpeg"), PixelFormat::mjpeg);
  EXPECT_EQ(pixel_format_named(name_of(PixelFormat::z16)), PixelFormat::z16);
  EXPECT_FALSE(fourcc_of(PixelFormat::mjpeg));
  EXPECT_FALSE(fourcc_of(PixelFormat::z16));
  EXPECT_FALSE(pixel_format_named("rgb9"));
}

TEST(PixelFormats, CountsOfDepthHaveTheLowerByteFirst) {
  const auto counts = to_counts(2, 1, std::vector<std::uint8_t>{1, 2, 255, 0});
  ASSERT_TRUE(counts);
  EXPECT_EQ(counts->data, (std::vector<std::uint16_t>{0x0201, 0x00FF}));
  EXPECT_FALSE(to_counts(2, 1, std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_FALSE(to_counts(2, 1, std::vector<std::uint8_t>{1, 2, 3, 4, 5}));
}

TEST(PixelFormats, InvalidBytesAreRefused) {
  PixelConverter converter;
  for (const PixelFormat format : kUncompressed) {
    std::vector<std::uint8_t> bytes = flat(format, {1, 2, 3});
    bytes.pop_back();
    EXPECT_FALSE(converter.to_rgb(format, kWidth, kHeight, bytes)) << name_of(format);
  }
  EXPECT_FALSE(bytes_of(PixelFormat::bayer_rggb8, 31, 16)) << "Bayer needs an even width";
  EXPECT_FALSE(bytes_of(PixelFormat::rgb8, 0, 16));
  EXPECT_FALSE(bytes_of(PixelFormat::rgb8, 2'000'000'000, 2'000'000'000));
  const std::vector<std::uint8_t> noise(5000, 0x5a);
  EXPECT_FALSE(converter.to_rgb(PixelFormat::mjpeg, kWidth, kHeight, noise));
  EXPECT_FALSE(converter.to_rgb(PixelFormat::mjpeg, kWidth, kHeight, {}));
}

}  // namespace
}  // namespace lumigraft::capture
