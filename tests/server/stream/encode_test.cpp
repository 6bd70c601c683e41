#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>

#include "server/stream/encode_h264.h"
#include "server/stream/encode_jpeg.h"
#include "server/stream/encode_stage.h"
extern "C" {
#include <libavcodec/avcodec.h>
#include <libswscale/swscale.h>
}

namespace lumigraft::server {
namespace {

constexpr double kMinPsnr_dB = 34;  // for 4:2:0 at the stream's quality, on a smooth picture with an edge

capture::Image<std::uint8_t> scene(int width, int height, int shift) {
  capture::Image<std::uint8_t> image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool box = x > 40 + shift && x < 90 + shift && y > 30 && y < 80;
      image.at(x, y, 0) = static_cast<std::uint8_t>(box ? 200 : 40 + 120 * x / width);
      image.at(x, y, 1) = static_cast<std::uint8_t>(box ? 60 : 60 + 100 * y / height);
      image.at(x, y, 2) = static_cast<std::uint8_t>(box ? 40 : 90);
    }
  }
  return image;
}

double psnr_dB(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    squares += std::pow(static_cast<double>(a.data[i]) - b.data[i], 2);
  }
  return 10 * std::log10(255 * 255 * static_cast<double>(a.data.size()) / std::max(squares, 1e-9));
}

class H264Decoder {
 public:
  H264Decoder() : codec_(avcodec_alloc_context3(avcodec_find_decoder(AV_CODEC_ID_H264))), frame_(av_frame_alloc()) {
    codec_->flags |= AV_CODEC_FLAG_LOW_DELAY;
    avcodec_open2(codec_, nullptr, nullptr);
  }
  ~H264Decoder() {
    av_frame_free(&frame_);
    avcodec_free_context(&codec_);
  }
  capture::Image<std::uint8_t> decode(std::vector<std::uint8_t> unit) {
    const std::size_t size = unit.size();
    unit.resize(size + AV_INPUT_BUFFER_PADDING_SIZE);
    AVPacket* packet = av_packet_alloc();
    packet->data = unit.data();
    packet->size = static_cast<int>(size);
    EXPECT_EQ(avcodec_send_packet(codec_, packet), 0);
    av_packet_free(&packet);
    if (avcodec_receive_frame(codec_, frame_) != 0) {
      return {};
    }
    EXPECT_EQ(frame_->colorspace, AVCOL_SPC_BT709);
    EXPECT_EQ(frame_->color_range, AVCOL_RANGE_MPEG);
    capture::Image<std::uint8_t> rgb(frame_->width, frame_->height, 3);
    SwsContext* convert =
        sws_getContext(rgb.width, rgb.height, static_cast<AVPixelFormat>(frame_->format), rgb.width, rgb.height,
                       AV_PIX_FMT_RGB24, SWS_BILINEAR | SWS_ACCURATE_RND, nullptr, nullptr, nullptr);
    const int* bt709 = sws_getCoefficients(SWS_CS_ITU709);
    sws_setColorspaceDetails(convert, bt709, 0, bt709, 1, 0, 1 << 16, 1 << 16);
    std::uint8_t* rows[] = {rgb.data.data()};
    const int stride[] = {3 * rgb.width};
    sws_scale(convert, frame_->data, frame_->linesize, 0, rgb.height, rows, stride);
    sws_freeContext(convert);
    return rgb;
  }

 private:
  AVCodecContext* codec_;
  AVFrame* frame_;
};

TEST(H264, EveryFrameIsDecodedAtOnceAndIsLikeItsInput) {
  H264Encoder encoder(160, 120);
  H264Decoder decoder;
  for (int i = 0; i < 10; ++i) {
    const capture::Image<std::uint8_t> in = scene(160, 120, 2 * i);
    const H264Encoder::AccessUnit unit = encoder.encode(in, i * 33'000'000, false);
    EXPECT_EQ(unit.key, i == 0);
    const capture::Image<std::uint8_t> out = decoder.decode(unit.bytes);
    ASSERT_EQ(out.width, 160) << "picture " << i << " is held back";
    EXPECT_GT(psnr_dB(in, out), kMinPsnr_dB) << i;
  }
  EXPECT_EQ(encoder.codec_string().rfind("avc1.42", 0), 0u) << encoder.codec_string();
  EXPECT_EQ(encoder.codec_string().size(), 11u);
}

TEST(H264, AViewerCanBeginAtAnyKeyFrame) {
  H264Encoder encoder(160, 120);
  encoder.encode(scene(160, 120, 0), 0, false);
  encoder.encode(scene(160, 120, 5), 33'000'000, false);
  const H264Encoder::AccessUnit asked = encoder.encode(scene(160, 120, 9), 66'000'000, true);
  EXPECT_TRUE(asked.key);
  EXPECT_GT(psnr_dB(scene(160, 120, 9), H264Decoder().decode(asked.bytes)), kMinPsnr_dB);
  EXPECT_FALSE(encoder.encode(scene(160, 120, 9), 2'000'000'000, false).key);
  EXPECT_TRUE(encoder.encode(scene(160, 120, 9), 2'070'000'000, false).key) << "2 s after the last";
}

TEST(H264, OddSizesLoseTheirLastColumnAndRow) {
  H264Encoder encoder(161, 121);
  const capture::Image<std::uint8_t> out = H264Decoder().decode(encoder.encode(scene(161, 121, 0), 0, true).bytes);
  EXPECT_EQ(out.width, 160);
  EXPECT_EQ(out.height, 120);
}

/// What no encoder compresses well.
capture::Image<std::uint8_t> noise(int width, int height, unsigned seed) {
  capture::Image<std::uint8_t> image = scene(width, height, 0);
  for (std::uint8_t& value : image.data) {
    seed = seed * 1664525 + 1013904223;
    value = static_cast<std::uint8_t>(std::min(255u, value / 2 + (seed >> 25)));
  }
  return image;
}

double bits(const H264Encoder::AccessUnit& unit) { return 8 * static_cast<double>(unit.bytes.size()); }

TEST(H264, ABoundHoldsOnNoiseAndCanBeChanged) {
  constexpr int kEachPictures = 30;
  constexpr double kPicture_bits = 60'000, kBurst_bits = 240'000, kTolerance = 1.1;
  const auto sum = [](H264Encoder& encoder, int from) {
    double sum_bits = 0;
    for (int i = from; i < from + kEachPictures; ++i)
      sum_bits += bits(encoder.encode(noise(320, 240, static_cast<unsigned>(i)), i * 66'000'000LL, false));
    return sum_bits;
  };
  H264Encoder free(320, 240), bounded(320, 240, H264Encoder::Bound{kPicture_bits, kBurst_bits});
  EXPECT_GT(sum(free, 0), 3 * kEachPictures * kPicture_bits) << "without a bound";
  EXPECT_LT(sum(bounded, 0), kTolerance * (kEachPictures * kPicture_bits + kBurst_bits));
  EXPECT_LT(bits(bounded.encode(noise(320, 240, 99), kEachPictures * 66'000'000LL, true)), kTolerance * kBurst_bits);
  bounded.change_bound({2 * kPicture_bits, kBurst_bits});
  const double twice_bits = sum(bounded, kEachPictures + 1);
  EXPECT_GT(twice_bits, 1.5 * kEachPictures * kPicture_bits);
  EXPECT_LT(twice_bits, kTolerance * (2 * kEachPictures * kPicture_bits + kBurst_bits));
}

TEST(Jpeg, LooksLikeWhatWentIn) {
  const capture::Image<std::uint8_t> in = scene(160, 120, 0);
  const std::vector<std::uint8_t> file = JpegEncoder(85).encode(in);
  capture::Image<std::uint8_t> out(160, 120, 3);
  const tjhandle decoder = tjInitDecompress();
  ASSERT_EQ(tjDecompress2(decoder, file.data(), file.size(), out.data.data(), 160, 480, 120, TJPF_RGB, 0), 0);
  tjDestroy(decoder);
  EXPECT_GT(psnr_dB(in, out), kMinPsnr_dB);
}

TEST(EncodeStage, MakesOnlyWhatIsWantedAndFewKeysOnDemand) {
  EncoderDemand demand;
  Metrics metrics;
  EncodeStage stage(85, demand, metrics);
  ShownFrame picture;
  picture.srgb = std::make_shared<const capture::Image<std::uint8_t>>(scene(160, 120, 0));
  picture.sequence = 5;
  picture.passed_through = true;
  picture.captured = std::chrono::steady_clock::now();
  EXPECT_TRUE(stage.encode(picture).empty());
  demand.jpeg = 1;
  auto messages = stage.encode(picture);
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0]->header.kind, StreamKind::jpeg);
  EXPECT_EQ(messages[0]->header.sequence, 5u);
  EXPECT_EQ(messages[0]->header.flags, StreamHeader::kPassedThrough);
  EXPECT_LE(messages[0]->header.capture_time_ns, messages[0]->header.send_time_ns);
  demand.jpeg = 0;
  demand.h264 = 1;
  messages = stage.encode(picture);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0]->header.kind, StreamKind::config);
  EXPECT_EQ(messages[1]->header.kind, StreamKind::h264_key);
  int keys = 0;
  for (int i = 0; i < 5; ++i) {
    demand.key = true;
    for (const auto& message : stage.encode(picture)) {
      keys += message->header.kind == StreamKind::h264_key ? 1 : 0;
    }
  }
  EXPECT_EQ(keys, 1) << "a flood of requests makes one";
  demand.h264_busy = 1;
  EXPECT_TRUE(stage.encode(picture).empty()) << "its only viewer cannot be sent a picture";
}

TEST(EncodeStage, MakesHalfTheSizeForThoseWhoGetThat) {
  EncoderDemand demand;
  Metrics metrics;
  EncodeStage stage(85, demand, metrics);
  ShownFrame picture;
  picture.srgb = std::make_shared<const capture::Image<std::uint8_t>>(scene(162, 122, 0));
  demand.half.jpeg = demand.half.h264 = 1;
  const auto messages = stage.encode(picture);
  ASSERT_EQ(messages.size(), 3u);
  for (const auto& message : messages) EXPECT_EQ(message->size, StreamSize::half);
  EXPECT_EQ(messages[0]->header.kind, StreamKind::jpeg);
  EXPECT_EQ(messages[0]->header.width, 81);
  EXPECT_EQ(messages[2]->header.kind, StreamKind::h264_key);
  EXPECT_EQ(messages[2]->header.width, 80) << "4:2:0 needs even sizes";
  EXPECT_EQ(messages[2]->header.height, 60);
}

}  // namespace
}  // namespace lumigraft::server
