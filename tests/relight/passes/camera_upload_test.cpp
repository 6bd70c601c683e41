#include "relight/passes/screen/camera_upload.h"

#include <gtest/gtest.h>

#include "capture/camera/srgb.h"

namespace lumigraft::relight {
namespace {

std::shared_ptr<const capture::Frame> picture(std::uint8_t code) {
  auto picture = std::make_shared<capture::Frame>();
  picture->encoded = capture::Image<std::uint8_t>(4, 3, 3, code);
  picture->exposure = 2;
  return picture;
}

TEST(CameraUpload, ThePictureOfAnSrgbCameraIsNotCopied) {
  CameraUpload upload{capture::ColorCamera{}};
  const auto first = picture(100), second = picture(200);
  upload.take(first);
  EXPECT_EQ(upload.coded().get(), &first->encoded);
  const auto held = upload.coded();
  upload.take(second);
  EXPECT_EQ(upload.coded().get(), &second->encoded);
  EXPECT_EQ(held->data[0], 100) << "whoever still holds it may";
}

TEST(CameraUpload, RadianceIsCodedOnce) {
  CameraUpload upload{capture::ColorCamera{}};
  auto linear = std::make_shared<capture::Frame>();
  linear->radiance = capture::Image<float>(4, 3, 3, 0.5f);
  upload.take(linear);
  EXPECT_EQ(upload.coded()->data.size(), linear->radiance.data.size());
  EXPECT_EQ(upload.coded()->data[0],
            static_cast<std::uint8_t>(capture::linear_to_srgb(upload.exposure() * 0.5f) * 255.0f + 0.5f));
}

}  // namespace
}  // namespace lumigraft::relight
