#include "reconstruct/pose/pose.h"

#include <gtest/gtest.h>

#include "capture/camera/srgb.h"
#include "capture/error.h"
#include "reconstruct/pose/print_alignment.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::kDegree;
using test::kFrameNs;
using test::some_tag;

capture::FrameSet seen_from(const Isometry3d& T_tag_camera, std::uint64_t index, const test::ViewNoise& noise = {},
                            const capture::CameraModel& camera = test::small_camera()) {
  const TagFinder finder(some_tag());
  return test::frame_of(test::view_of_tag(camera, finder.pattern(), 0.16, T_tag_camera, noise), index,
                        static_cast<std::int64_t>(index) * kFrameNs);
}

capture::FrameSet empty_table(std::uint64_t index) {
  capture::Frame picture;
  picture.encoded = capture::Image<std::uint8_t>(320, 240, 3, 120);
  return test::frame_of(std::move(picture), index, static_cast<std::int64_t>(index) * kFrameNs);
}

TEST(Pose, AnImageWithoutNoiseGivesThePose) {
  for (const double azimuth : {-1.6, -0.9, 0.3}) {
    PoseStage stage(some_tag(), test::small_camera());
    const Isometry3d truth = test::looking_at_tag(0.85, 50 * kDegree, azimuth, {0.05, 0.1, 0});
    const auto result = stage.locate(seen_from(truth, 0));
    ASSERT_TRUE(result.pose);
    EXPECT_TRUE(result.warnings.empty());
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 0.6);
    EXPECT_LT(test::degrees_apart(result.pose->T_tag_camera, truth), 0.04);
    EXPECT_LT(result.pose->reprojection_error_px, 0.5);
    EXPECT_EQ(result.pose->age_ns, 0);
  }
}

TEST(Pose, NoiseIsAveragedWhileTheCameraRests) {
  PoseStage stage(some_tag(), test::small_camera());
  const Isometry3d truth = test::looking_at_tag(0.85, 50 * kDegree, -1.2);
  std::vector<Isometry3d> raw, smooth;
  for (unsigned i = 0; i < 24; ++i) {
    const auto result = stage.locate(seen_from(truth, i, {6, i + 1}));
    ASSERT_TRUE(result.pose);
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, truth), 2);
    if (i < 8) continue;
    raw.push_back(result.pose->T_tag_camera_raw);
    smooth.push_back(result.pose->T_tag_camera);
  }
  const auto jitter_mm = [](const std::vector<Isometry3d>& poses) {
    double sum = 0;
    for (std::size_t i = 1; i < poses.size(); ++i) sum += test::millimetres_apart(poses[i - 1], poses[i]);
    return sum / static_cast<double>(poses.size() - 1);
  };
  EXPECT_LT(jitter_mm(smooth), 0.15 * jitter_mm(raw));
  EXPECT_LT(test::millimetres_apart(smooth.back(), truth), 0.6);
}

TEST(Pose, LensDistortionIsCorrected) {
  capture::CameraModel camera = test::small_camera();
  camera.distortion = {-0.28, 0.08, 0.001, -0.001, 0};
  PoseStage stage(some_tag(), camera);
  const Isometry3d truth = test::looking_at_tag(0.6, 40 * kDegree, -1.2, {-0.15, 0.1, 0});
  const auto result = stage.locate(seen_from(truth, 0, {}, camera));
  ASSERT_TRUE(result.pose);
  EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 0.5);
  EXPECT_LT(test::degrees_apart(result.pose->T_tag_camera, truth), 0.05);
}

TEST(Pose, ThePrintIsMoreExactThanCorners) {
  const TagFinder finder(some_tag());
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d truth = test::looking_at_tag(0.85, 50 * kDegree, -1.2);
  capture::Frame picture = test::view_of_tag(camera, finder.pattern(), 0.16, truth);
  const PixelRegion all_pixels{0, 0, camera.width, camera.height};
  const auto align = [&](const Isometry3d& start) {
    return align_to_print(sample_pixels(picture, capture::Response::srgb(), camera, all_pixels), finder.pattern(), 0.16,
                          start);
  };
  Isometry3d off = truth.inverse();
  off.linear() = Eigen::AngleAxisd(1.0 * kDegree, Vector3d(1, 1, 0).normalized()) * off.linear();
  off.translation() += Vector3d(0.001, -0.001, 0.01);
  const auto alignment = align(off);
  ASSERT_TRUE(alignment);
  EXPECT_LT(alignment->contrast_error, 0.02);
  EXPECT_LT(test::millimetres_apart(alignment->T_camera_tag.inverse(), truth), 0.6);

  // A fifth of the pixels gives nearly the same pose.
  const auto few = thin_out(sample_pixels(picture, capture::Response::srgb(), camera, all_pixels));
  const auto near = align_to_print(few, finder.pattern(), 0.16, off);
  ASSERT_TRUE(near);
  EXPECT_LT(near->pixels, 0.22 * alignment->pixels);
  EXPECT_LT(test::millimetres_apart(near->T_camera_tag.inverse(), truth), 2);

  // A finger covers a corner of the print: the rest is enough.
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      const Vector3d d = truth.linear() * *ray;
      const Vector3d p = truth.translation() - truth.translation().z() / d.z() * d;
      if (p.x() > 0.05 && p.y() > 0.05) std::fill_n(&picture.encoded.at(u, v), 3, 150);
    }
  const auto partly = align(off);
  ASSERT_TRUE(partly);
  EXPECT_LT(test::millimetres_apart(partly->T_camera_tag.inverse(), truth), 3);

  // An image without the print.
  picture.encoded = capture::Image<std::uint8_t>(320, 240, 3, 150);
  EXPECT_FALSE(align(off));
}

// A tracked tag is searched near its last position, with the same result as a search of the whole image.
TEST(Pose, TrackingGivesTheSameAsSearching) {
  PoseStage tracking(some_tag(), test::small_camera());
  for (unsigned i = 0; i < 8; ++i) {
    // It moves by a fifth of its size and more per frame, then jumps across the image.
    const Vector3d aim(0.03 * i, i < 6 ? 0.05 : -0.25, 0);
    const capture::FrameSet frame =
        seen_from(test::looking_at_tag(0.85, 50 * kDegree, -1.2 + 0.03 * i, aim), i, {6, i + 1});
    PoseStage searching(some_tag(), test::small_camera());
    const auto a = tracking.locate(frame), b = searching.locate(frame);
    ASSERT_TRUE(a.pose && b.pose) << i;
    EXPECT_TRUE(a.warnings.empty());
    EXPECT_LT(test::millimetres_apart(a.pose->T_tag_camera_raw, b.pose->T_tag_camera_raw), 0.02) << i;
    EXPECT_LT(test::degrees_apart(a.pose->T_tag_camera_raw, b.pose->T_tag_camera_raw), 0.002) << i;
  }
}

TEST(Pose, LinearRadianceGivesTheSamePose) {
  const Isometry3d truth = test::looking_at_tag(0.85, 50 * kDegree, -1.2);
  capture::FrameSet frame = seen_from(truth, 0);
  capture::Frame linear;
  linear.radiance = capture::Image<float>(320, 240, 3);
  for (std::size_t i = 0; i < linear.radiance.data.size(); ++i)
    linear.radiance.data[i] = 0.01f * capture::srgb_to_linear(frame.color->encoded.data[i] / 255.0f);
  PoseStage stage(some_tag(), test::small_camera());
  const auto result = stage.locate(test::frame_of(std::move(linear), 0, 0));
  ASSERT_TRUE(result.pose);
  EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 0.6);
}

// Warm light clips white paper strongly in red, slightly in green and not in blue; then a hand covers a part.
TEST(Pose, ClippedPaperDoesNotMoveThePose) {
  const TagFinder finder(some_tag());
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d truth = test::looking_at_tag(0.85, 50 * kDegree, -1.2, {0.05, 0.1, 0});
  capture::Frame picture;
  const double times[3] = {3, 1.4, 0.7};
  for (int c = 0; c < 3; ++c) {
    const capture::Frame one =
        test::view_of_tag(camera, finder.pattern(), 0.16, truth, {.exposure = times[c] / test::kPaperLight});
    if (c == 0) picture = one;
    for (int v = 0; v < camera.height; ++v)
      for (int u = 0; u < camera.width; ++u) picture.encoded.at(u, v, c) = one.encoded.at(u, v, c);
  }
  PoseStage stage(some_tag(), camera);
  const auto result = stage.locate(test::frame_of(picture, 0, 0));
  ASSERT_TRUE(result.pose);
  EXPECT_TRUE(result.warnings.empty());
  EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 0.6);
  EXPECT_LT(test::degrees_apart(result.pose->T_tag_camera, truth), 0.04);

  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      const Vector3d d = truth.linear() * *ray;
      const Vector3d p = truth.translation() - truth.translation().z() / d.z() * d;
      if (p.x() > 0.06) std::fill_n(&picture.encoded.at(u, v), 3, 120);
    }
  const auto followed = stage.locate(test::frame_of(picture, 1, kFrameNs));
  ASSERT_TRUE(followed.pose);
  EXPECT_EQ(followed.pose->age_ns, 0) << "visible in part";
  EXPECT_LT(test::millimetres_apart(followed.pose->T_tag_camera_raw, truth), 7);
}

// A far, almost frontal tag with noise: corners and print do not distinguish the two poses, depth or the past does.
TEST(Pose, DepthResolvesTheAmbiguity) {
  int flips_alone = 0, flips_with_depth = 0, seen = 0;
  for (unsigned i = 0; i < 24; ++i) {
    const Isometry3d truth = test::looking_at_tag(2.4, 10 * kDegree, 0.5 * i);
    capture::FrameSet frame = seen_from(truth, 0, {25, i + 1});
    PoseStage alone(some_tag(), test::small_camera());
    const auto a = alone.locate(frame);
    frame.depth = std::make_shared<capture::DepthFrame>(test::depth_of_table(test::small_camera(), truth, i, 0.3));
    PoseStage with_depth(some_tag(), test::small_camera());
    const auto b = with_depth.locate(frame);
    if (!a.pose || !b.pose) continue;
    ++seen;
    flips_alone += test::degrees_apart(a.pose->T_tag_camera, truth) > 10;
    flips_with_depth += test::degrees_apart(b.pose->T_tag_camera, truth) > 10;
  }
  std::printf("pose: almost frontal tag 2.4 m away: %d of %d flipped alone, %d with depth\n", flips_alone, seen,
              flips_with_depth);
  EXPECT_GT(seen, 12);
  EXPECT_GT(flips_alone, 0) << "else the case is too easy";
  EXPECT_EQ(flips_with_depth, 0);
}

TEST(Pose, ThePastResolvesTheAmbiguity) {
  PoseStage stage(some_tag(), test::small_camera());
  int flips = 0;
  for (unsigned i = 0; i < 24; ++i) {
    // From an unambiguous view to an ambiguous one.
    const double progress = std::min(1.0, i / 8.0);
    const Isometry3d truth =
        test::looking_at_tag(0.8 + 1.4 * progress, (40 - 26 * progress) * kDegree, -1.2 + 0.02 * i);
    const auto result = stage.locate(seen_from(truth, i, {14 * progress, i + 1}));
    if (result.pose && result.pose->age_ns == 0)
      flips += test::degrees_apart(result.pose->T_tag_camera_raw, truth) > 14;
  }
  EXPECT_EQ(flips, 0);
}

TEST(Pose, NoTagNoPose) {
  PoseStage stage(some_tag(), test::small_camera());
  const auto nothing = stage.locate(empty_table(0));
  EXPECT_FALSE(nothing.pose);
  ASSERT_EQ(nothing.warnings.size(), 1u);
  EXPECT_EQ(nothing.warnings[0], "tag: not in the picture");

  capture::Tag other = some_tag();
  other.id = 3;
  PoseStage other_stage(other, test::small_camera());
  EXPECT_FALSE(other_stage.locate(seen_from(test::looking_at_tag(0.85, 0.8, 0), 0)).pose);
}

TEST(Pose, TheLastPoseIsUsedUpToItsAgeLimit) {
  PoseStage stage(some_tag(), test::small_camera());
  const Isometry3d truth = test::looking_at_tag(0.85, 50 * kDegree, -1.2);
  ASSERT_TRUE(stage.locate(seen_from(truth, 0)).pose);
  for (std::uint64_t i = 1; i < 20; ++i) {
    const auto result = stage.locate(empty_table(i));
    const std::int64_t age_ns = static_cast<std::int64_t>(i) * kFrameNs;
    const bool usable = age_ns <= PoseStage::kAgeLimitNs;
    EXPECT_EQ(result.warnings,
              std::vector<std::string>{usable ? "tag: not in the picture, the pose is an old one"
                                              : "tag: not in the picture, its pose is too old to use"});
    if (usable) {
      ASSERT_TRUE(result.pose);
      EXPECT_EQ(result.pose->age_ns, age_ns);
      EXPECT_EQ(result.pose->time_ns, 0);
    } else {
      EXPECT_FALSE(result.pose);
    }
  }
  stage.reset();
  EXPECT_FALSE(stage.locate(empty_table(1)).pose);
}

TEST(Pose, ATagThatDoesNotExistThrows) {
  EXPECT_THROW(PoseStage({"tag36h12", 0, 0.16}, test::small_camera()), capture::InputError);
  EXPECT_THROW(PoseStage({"tag36h11", 587, 0.16}, test::small_camera()), capture::InputError);
  EXPECT_THROW(PoseStage({"tag36h11", -1, 0.16}, test::small_camera()), capture::InputError);
}

TEST(Pose, EveryFamilyIsFound) {
  for (const char* family : {"tag36h11", "tag36h10", "tag25h9", "tag16h5", "tagCircle21h7", "tagStandard41h12",
                             "tagStandard52h13", "tagCustom48h12", "tagCircle49h12"}) {
    const capture::Tag tag{family, 5, 0.16};
    const TagFinder finder(tag);
    const Isometry3d truth = test::looking_at_tag(0.7, 40 * kDegree, -1.2);
    PoseStage stage(tag, test::small_camera());
    const auto result =
        stage.locate(test::frame_of(test::view_of_tag(test::small_camera(), finder.pattern(), 0.16, truth), 0, 0));
    ASSERT_TRUE(result.pose) << family;
    EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera, truth), 1) << family;
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
