#include "capture/formats/chroma_sampling.h"

#include <gtest/gtest.h>

#include <vector>

namespace lumigraft::capture {
namespace {

void expect_block(const RawFrame& frame, int width, int height) {
  const ChromaBlock block = chroma_block(frame);
  EXPECT_EQ(block.width, width);
  EXPECT_EQ(block.height, height);
}

TEST(ChromaSampling, OfVideoFormats) {
  expect_block(RawFrame(PixelFormat::yuyv, {}), 2, 1);
  expect_block(RawFrame(PixelFormat::uyvy, {}), 2, 1);
  expect_block(RawFrame(PixelFormat::nv12, {}), 2, 2);
  expect_block(RawFrame(PixelFormat::rgb8, {}), 1, 1);
  expect_block(RawFrame(PixelFormat::bayer_rggb8, {}), 1, 1);
}

/// The start of a JPEG: a table, then the frame header with these sampling factors of luma and chroma.
std::vector<std::uint8_t> jpeg(std::uint8_t of_luma, std::uint8_t of_chroma) {
  return {0xff, 0xd8, 0xff, 0xdb, 0,       4, 7, 7,         0xff, 0xc0, 0,         17, 8,    0,   16,
          0,    16,   3,    1,    of_luma, 0, 2, of_chroma, 1,    3,    of_chroma, 1,  0xff, 0xda};
}

TEST(ChromaSampling, OfJpegByItsHeader) {
  expect_block(RawFrame(PixelFormat::mjpeg, jpeg(0x22, 0x11)), 2, 2);
  expect_block(RawFrame(PixelFormat::mjpeg, jpeg(0x21, 0x11)), 2, 1);
  expect_block(RawFrame(PixelFormat::mjpeg, jpeg(0x11, 0x11)), 1, 1);
  expect_block(RawFrame(PixelFormat::mjpeg, jpeg(0x22, 0x12)), 2, 1);
}

TEST(ChromaSampling, OfCutOrWrongJpegIsNone) {
  const std::vector<std::uint8_t> whole = jpeg(0x22, 0x11);
  for (std::size_t length = 0; length < 27; ++length)
    expect_block(
        RawFrame(PixelFormat::mjpeg, std::vector(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length))),
        1, 1);
  expect_block(RawFrame(PixelFormat::mjpeg, jpeg(0x22, 0x00)), 1, 1);
}

}  // namespace
}  // namespace lumigraft::capture
