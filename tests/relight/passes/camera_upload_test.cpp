#include "relight/passes/screen/camera_upload.h"

#include <gtest/gtest.h>

#include "capture/camera/srgb.h"

namespace lumigraft::relight {
namespace {

capture::FrameSet frame_with(std::shared_ptr<const capture::Frame> picture) {
  capture::FrameSet frame;
  frame.color = std::move(picture);
  return frame;
}

std::shared_ptr<const capture::Frame> picture(std::uint8_t code) {
  auto picture = std::make_shared<capture::Frame>();
  picture->encoded = capture::Image<std::uint8_t>(4, 3, 3, code);
  picture->exposure = 2;
  return picture;
}

TEST(CameraUpload, ThePictureOfAnSrgbCameraIsNotCopied) {
  CameraUpload upload{capture::ColorCamera{}};
  const auto first = picture(100), second = picture(200);
  upload.take(frame_with(first));
  EXPECT_EQ(upload.coded().get(), &first->encoded);
  const auto held = upload.coded();
  upload.take(frame_with(second));
  EXPECT_EQ(upload.coded().get(), &second->encoded);
  EXPECT_EQ(held->data[0], 100) << "whoever still holds it may";
}

TEST(CameraUpload, RadianceIsCodedOnce) {
  CameraUpload upload{capture::ColorCamera{}};
  auto linear = std::make_shared<capture::Frame>();
  linear->radiance = capture::Image<float>(4, 3, 3, 0.5f);
  upload.take(frame_with(linear));
  EXPECT_EQ(upload.coded()->data.size(), linear->radiance.data.size());
  EXPECT_EQ(upload.coded()->data[0],
            static_cast<std::uint8_t>(capture::linear_to_srgb(upload.exposure()[0] * 0.5f) * 255.0f + 0.5f));
}

TEST(CameraUpload, AGainOfTheCameraIsNoLightOfTheRoom) {
  CameraUpload upload{capture::ColorCamera{}};
  capture::FrameSet frame = frame_with(picture(188));
  upload.take(frame);
  const Eigen::Array3f radiance = upload.radiance(0), exposure = upload.exposure();
  frame.color_gain = {0.5f, 1, 2};
  upload.take(frame);
  EXPECT_TRUE(upload.exposure().isApprox(exposure * Eigen::Array3f(0.5f, 1, 2)));
  EXPECT_TRUE(upload.radiance(0).isApprox(radiance / Eigen::Array3f(0.5f, 1, 2)));
  EXPECT_FLOAT_EQ(upload.radiance().at(1, 1, 0), radiance[0] / 0.5f) << "of all pixels";
  EXPECT_TRUE((upload.exposure() * upload.radiance(0)).isApprox(exposure * radiance)) << "the same pixel value";
}

}  // namespace
}  // namespace lumigraft::relight
