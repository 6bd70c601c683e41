#include "capture/recorded/image_source.h"

#include <gtest/gtest.h>

#include <fstream>

#include "capture/error.h"
#include "capture/formats/picture_file.h"
#include "tests/capture/formats/exr_writer.h"
#include "tests/capture/formats/png_writer.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;

constexpr int kWidth = 40;
constexpr int kHeight = 30;
const StreamSpec kColor{.stream = Stream::color, .width = kWidth, .height = kHeight, .exposure = 2.5};
const StreamSpec kDepth{.stream = Stream::depth, .width = kWidth, .height = kHeight};
const StreamSpec kFisheye{.stream = Stream::fisheye, .width = kWidth, .height = kHeight, .exposure = 6.0};

class ImageSourceTest : public test::ScratchFolder {
 protected:
  void color(const std::string& name, int blue, int width = kWidth) const {
    Image<std::uint8_t> picture(width, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < width; ++x) {
        picture.at(x, y, 0) = 10;
        picture.at(x, y, 1) =
            static_cast<std::uint8_t>(20 + (x * y) % 7);  // not uniform, so that truncation loses pixels
        picture.at(x, y, 2) = static_cast<std::uint8_t>(blue);
      }
    }
    picture.at(5, 3, 0) = 3;
    picture.at(5, 3, 2) = 1;
    test::write_png(folder_ / name, picture);
  }
  void depth(const std::string& name, int first) const {
    Image<std::uint16_t> picture(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        picture.at(x, y) = static_cast<std::uint16_t>(first + 1000 * y + x);
      }
    }
    test::write_png(folder_ / name, picture);
  }
  /// An image of one pixel value (R G B E), without run-length encoding.
  void hdr(const std::string& name, const std::string& rgbe) const {
    std::ofstream out(folder_ / name, std::ios::binary);
    out << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " << kHeight << " +X " << kWidth << "\n";
    for (int i = 0; i < kWidth * kHeight; ++i) {
      out << rgbe;
    }
  }
  void cut(const std::string& name, double keep) const {
    const auto size = std::filesystem::file_size(folder_ / name);
    std::filesystem::resize_file(folder_ / name, static_cast<std::uintmax_t>(keep * static_cast<double>(size)));
  }
  std::filesystem::path list(const std::string& text) const {
    std::ofstream(folder_ / "list.txt") << text;
    return folder_ / "list.txt";
  }
  std::string error(const std::string& text, const StreamSpec& spec) const {
    try {
      ImageSource source(list(text), spec);
    } catch (const InputError& e) {
      const std::string what = e.what();
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
      EXPECT_EQ(what.find((folder_ / "list.txt").string()), 0u) << what;
      return what.substr((folder_ / "list.txt").string().size());
    }
    return "no error";
  }
};

TEST_F(ImageSourceTest, DeliversTheListedImages) {
  color("a.png", 100);
  color("b.png", 200);
  ImageSource source(list("# timestamp path\n\n1305031102.175304 a.png\n1305031102.211214 b.png 7.5\n"), kColor);
  for (int pass = 0; pass < 2; ++pass) {
    const auto a = std::get<Frame>(*source.next(0ms));
    EXPECT_EQ(a.stamp.time_ns, 1305031102175304000);
    EXPECT_EQ(a.stamp.sequence, 0u);
    EXPECT_EQ(a.stream, Stream::color);
    EXPECT_EQ(a.exposure, 2.5);
    EXPECT_TRUE(a.radiance.empty());
    EXPECT_EQ(a.encoded.at(0, 0, 0), 10);
    EXPECT_EQ(a.encoded.at(0, 0, 1), 20);
    EXPECT_EQ(a.encoded.at(0, 0, 2), 100);
    EXPECT_EQ(a.encoded.at(5, 3, 0), 3);
    EXPECT_EQ(a.encoded.at(5, 3, 2), 1);
    EXPECT_FALSE(source.finished());
    const auto b = std::get<Frame>(*source.next(0ms));
    EXPECT_EQ(b.exposure, 7.5);
    EXPECT_EQ(b.encoded.at(0, 0, 2), 200);
    EXPECT_EQ(b.stamp.sequence, 1u);
    EXPECT_TRUE(source.finished());
    EXPECT_FALSE(source.next(0ms));
    source.rewind();
  }
}

TEST_F(ImageSourceTest, DepthKeepsAllSixteenBits) {
  depth("d.png", 30000);
  ImageSource source(list("0 d.png\n0.1 d.png\n"), kDepth);
  for (int i = 0; i < 2; ++i) {
    const auto d = std::get<RawDepth>(*source.next(0ms));
    EXPECT_EQ(d.counts.at(0, 0), 30000);
    EXPECT_EQ(d.counts.at(39, 29), 59039);
  }
}

TEST_F(ImageSourceTest, RadianceFromExrAndHdr) {
  Image<float> radiance(kWidth, kHeight, 3, 0.25f);
  radiance.at(5, 3, 0) = 70000.0f;  // exceeds the range of half floats
  radiance.at(5, 3, 2) = 1e-3f;
  test::write_exr(folder_ / "a.exr", radiance);
  hdr("b.hdr", {static_cast<char>(200), 100, 7, static_cast<char>(140)});
  ImageSource source(list("0 a.exr\n0.5 b.hdr\n"), kFisheye);
  const auto a = std::get<Frame>(*source.next(0ms));
  EXPECT_TRUE(a.encoded.empty());
  EXPECT_EQ(a.radiance.data, radiance.data);
  const auto b = std::get<Frame>(*source.next(0ms));
  EXPECT_EQ(b.radiance.at(7, 7, 0), 200.5f / 256.0f * 4096.0f);
  EXPECT_EQ(b.radiance.at(7, 7, 2), 7.5f / 256.0f * 4096.0f);
}

/// All three encodings of rows, and the exposure factors of the header.
TEST_F(ImageSourceTest, HdrRowsOfEveryEncoding) {
  const auto pixel = [](int r, int g, int b, int e) {
    return std::string{static_cast<char>(r), static_cast<char>(g), static_cast<char>(b), static_cast<char>(e)};
  };
  const std::string head = "#?RADIANCE\nEXPOSURE=2.0\nEXPOSURE=2.0\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 40\n";
  std::string flat;
  std::string channels{2, 2, 0, 40};
  for (int x = 0; x < 40; ++x) {
    flat += pixel(100, 50, x < 20 ? 10 : 20, 130);
  }
  channels += std::string{static_cast<char>(168), 100, static_cast<char>(168), 50};
  channels += std::string{static_cast<char>(148), 10, 2, 20, 20, static_cast<char>(146), 20, static_cast<char>(168)};
  channels += static_cast<char>(130);
  const std::string repeated =
      pixel(100, 50, 10, 130) + pixel(1, 1, 1, 19) + pixel(100, 50, 20, 130) + pixel(1, 1, 1, 19);
  for (const std::string& rows : {flat, channels, repeated}) {
    std::ofstream(folder_ / "a.hdr", std::ios::binary) << head << rows;
    const Image<float> image = read_radiance(folder_ / "a.hdr");
    ASSERT_EQ(image.width, 40);
    for (int x = 0; x < 40; ++x) {
      EXPECT_FLOAT_EQ(image.at(x, 0, 0), 100.5f / 256.0f * 4.0f / 4.0f);
      EXPECT_FLOAT_EQ(image.at(x, 0, 1), 50.5f / 256.0f * 4.0f / 4.0f);
      EXPECT_FLOAT_EQ(image.at(x, 0, 2), (x < 20 ? 10.5f : 20.5f) / 256.0f * 4.0f / 4.0f);
    }
  }
}

TEST_F(ImageSourceTest, GreyAndTransparentPngsBecomeRgb) {
  test::write_png(folder_ / "grey.png", Image<std::uint8_t>(kWidth, kHeight, 1, 7));
  Image<std::uint8_t> half_clear(kWidth, kHeight, 4, 128);
  for (std::size_t i = 0; i < half_clear.data.size(); i += 4) {
    half_clear.data[i] = 3;
    half_clear.data[i + 2] = 1;
  }
  test::write_png(folder_ / "clear.png", half_clear);
  ImageSource source(list("0 grey.png\n1 clear.png\n"), kColor);
  EXPECT_EQ(std::get<Frame>(*source.next(0ms)).encoded.at(4, 4, 2), 7);
  const auto clear = std::get<Frame>(*source.next(0ms));
  EXPECT_EQ(clear.encoded.at(4, 4, 0), 3) << "alpha is ignored";
  EXPECT_EQ(clear.encoded.at(4, 4, 2), 1);
}

TEST_F(ImageSourceTest, OneTimestampIsOneBracket) {
  color("a.png", 100);
  ImageSource source(list("0 a.png 6\n0 a.png 0.4\n1 a.png 6\n1 a.png 0.4\n"), kFisheye);
  EXPECT_EQ(std::get<Frame>(*source.next(0ms)).exposure, 6.0);
  const auto second = std::get<Frame>(*source.next(0ms));
  EXPECT_EQ(second.exposure, 0.4);
  EXPECT_EQ(second.stamp.time_ns, 0);
  EXPECT_EQ(std::get<Frame>(*source.next(0ms)).stamp.time_ns, 1'000'000'000);
}

TEST_F(ImageSourceTest, AnUndecodableImageIsLost) {
  color("a.png", 100);
  color("b.png", 120);
  color("c.png", 140);
  cut("b.png", 0.7);
  ImageSource source(list("0 a.png\n0.1 b.png\n0.2 c.png\n"), kColor);
  EXPECT_TRUE(std::holds_alternative<Frame>(*source.next(0ms)));
  const auto lost = std::get<LostFrame>(*source.next(0ms));
  EXPECT_EQ(lost.stamp.sequence, 1u);
  EXPECT_EQ(lost.stamp.time_ns, 100'000'000);
  EXPECT_EQ(lost.stream, Stream::color);
  EXPECT_EQ(lost.reason, "b.png: found a picture that is damaged or cut short");
  const auto c = std::get<Frame>(*source.next(0ms));
  EXPECT_EQ(c.stamp.sequence, 2u);
  EXPECT_EQ(c.encoded.at(0, 0, 2), 140);
}

TEST_F(ImageSourceTest, ADeletedFileIsLost) {
  color("a.png", 100);
  color("b.png", 120);
  ImageSource source(list("0 a.png\n0.1 b.png\n"), kColor);
  std::filesystem::remove(folder_ / "b.png");
  EXPECT_TRUE(std::holds_alternative<Frame>(*source.next(0ms)));
  EXPECT_NE(std::get<LostFrame>(*source.next(0ms)).reason.find("found no readable file"), std::string::npos);
}

TEST_F(ImageSourceTest, BadListsAreRefused) {
  color("a.png", 100);
  try {
    ImageSource source(folder_ / "none.txt", kColor);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("none.txt: found no readable file"), std::string::npos);
  }
  EXPECT_EQ(error("", kColor), ": found no picture in the list, allowed: \"timestamp_s path [exposure]\"");
  EXPECT_NE(error("# nothing\n\n", kColor).find("found no picture"), std::string::npos);
  EXPECT_EQ(error("0 a.png\n0.2 a.png\n0.1 a.png\n", kColor),
            ":3: found a timestamp before that of line 2, allowed: timestamps that never go back");
  EXPECT_NE(error("0 a.png\n0 a.png\n", kColor).find(":2: found the timestamp of line 1 again"), std::string::npos);
  EXPECT_NE(error("0\n", kColor).find(":1: found 1 columns"), std::string::npos);
  EXPECT_NE(error("0 a.png 1 2\n", kColor).find(":1: found 4 columns"), std::string::npos);
  EXPECT_NE(error("0 a.png 1\n", kDepth).find(":1: found 3 columns"), std::string::npos);
  EXPECT_NE(error("a.png 0\n", kColor).find(":1: found a timestamp that is no plain number"), std::string::npos);
  for (const char* time : {"nan", "-1", "1e3", "0x10", "1.", ".5", "1.2.3", "99999999999", "1.2x"}) {
    EXPECT_NE(error(std::string(time) + " a.png\n", kColor).find("found a timestamp"), std::string::npos) << time;
  }
  for (const char* exposure : {"nan", "inf", "0", "-1", "x", "1x"}) {
    EXPECT_NE(error("0 a.png " + std::string(exposure) + "\n", kColor).find("found an exposure"), std::string::npos);
  }
}

TEST_F(ImageSourceTest, BadImagesAreRefusedBeforeTheFirstFrame) {
  color("a.png", 100);
  color("wide.png", 100, 41);
  depth("d.png", 5);
  test::write_png(folder_ / "deep.png", Image<std::uint16_t>(kWidth, kHeight, 3, 7));
  test::write_png(folder_ / "gray.png", Image<std::uint8_t>(kWidth, kHeight, 1, 7));
  std::ofstream(folder_ / "text.png") << "no picture";
  std::ofstream(folder_ / "empty.png") << "";
  EXPECT_EQ(error("0 a.png\n1 none.png\n", kColor), ":2: none.png: found no readable file");
  EXPECT_EQ(error("0 a.png\n1 wide.png\n", kColor), ":2: wide.png: found 41x30 pixels, allowed: 40x30 pixels");
  EXPECT_EQ(error("0 a.png\n1 deep.png\n", kColor),
            ":2: deep.png: found 16 bits a channel, allowed: 8-bit PNG, EXR or HDR");
  EXPECT_EQ(error("0 d.png\n1 gray.png\n", kDepth),
            ":2: gray.png: found 8 bits a channel, allowed: 16-bit grey PNG for depth");
  EXPECT_NE(error("0 deep.png\n", kDepth).find("found 16 bits a channel in colour"), std::string::npos);
  EXPECT_NE(error("0 text.png\n", kColor).find("text.png: found a file of another kind"), std::string::npos);
  EXPECT_NE(error("0 empty.png\n", kColor).find("empty.png: found an empty file"), std::string::npos);
  EXPECT_NE(error("0 .\n", kColor).find("found no readable file"), std::string::npos);
  cut("a.png", 0.7);
  EXPECT_EQ(error("0 a.png\n", kColor), ":1: a.png: found a picture that is damaged or cut short");
  cut("a.png", 0.1);
  EXPECT_NE(error("0 a.png\n", kColor).find("found a PNG that ends in its header"), std::string::npos);
}

TEST_F(ImageSourceTest, BadRadianceIsRefused) {
  color("a.png", 100);
  test::write_exr(folder_ / "a.exr", Image<float>(kWidth, kHeight, 3, 1.0f));
  test::write_exr(folder_ / "y.exr", Image<float>(kWidth, kHeight, 1, 1.0f));
  hdr("b.hdr", {9, 8, 7, 100});
  EXPECT_NE(error("0 a.exr\n0 a.png 0.5\n", kFisheye).find(":2: a.png: found radiance in a bracket"),
            std::string::npos);
  EXPECT_NE(error("0 y.exr\n", kFisheye).find("without full channels R, G and B"), std::string::npos);
  EXPECT_NE(error("0 a.exr\n", kDepth).find("allowed: 16-bit grey PNG"), std::string::npos);
  cut("a.exr", 0.5);
  EXPECT_NE(error("0 a.exr\n", kFisheye).find("OpenEXR file that is damaged or cut short"), std::string::npos);
  cut("b.hdr", 0.5);
  EXPECT_NE(error("0 b.hdr\n", kFisheye).find("damaged or cut short"), std::string::npos);
  std::filesystem::resize_file(folder_ / "b.hdr", 20);
  EXPECT_NE(error("0 b.hdr\n", kFisheye).find("b.hdr: found an HDR file that ends in its header"), std::string::npos);
  std::ofstream(folder_ / "c.hdr") << "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 30 +X 40\n";
  EXPECT_NE(error("0 c.hdr\n", kFisheye).find("found an HDR header of another kind"), std::string::npos);
}

TEST_F(ImageSourceTest, FlippedBitsNeverCrash) {
  color("a.png", 100);
  test::write_exr(folder_ / "a.exr", Image<float>(kWidth, kHeight, 3, 1.0f));
  hdr("a.hdr", {9, 8, 7, 100});
  unsigned random = 7;
  for (const char* name : {"a.png", "a.exr", "a.hdr"}) {
    std::ifstream in(folder_ / name, std::ios::binary);
    const std::string good((std::istreambuf_iterator<char>(in)), {});
    for (int trial = 0; trial < 60; ++trial) {
      std::string bytes = good;
      for (int flip = 0; flip < 3; ++flip) {
        random = random * 1664525u + 1013904223u;
        bytes[(random >> 8) % std::min<std::size_t>(bytes.size(), trial % 2 == 0 ? 120 : 100000)] ^=
            static_cast<char>(1 << (random & 7));
      }
      std::ofstream(folder_ / name, std::ios::binary) << bytes;
      try {
        ImageSource source(list(std::string("0 ") + name + "\n"), kFisheye);
        source.next(0ms);
      } catch (const InputError&) {
      }
    }
  }
}

}  // namespace
}  // namespace lumigraft::capture
