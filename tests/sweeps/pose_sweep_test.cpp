// Limits of the tag's pose: tilt, distance, blur, partial occlusion, camera motion faster than the filter.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "capture/camera/srgb.h"
#include "reconstruct/pose/filter.h"
#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/pose_room.h"
#include "tests/reconstruct/pose/pose_views.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kTagM = 0.16;

capture::CameraModel vga_camera() {
  capture::CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

double percentile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1) + 0.5)];
}

capture::FrameSet view(const capture::CameraModel& camera, const Isometry3d& T_tag_camera, std::uint64_t index,
                       double code_sigma) {
  const reconstruct::TagFinder finder(some_tag());
  return frame_of(
      view_of_tag(camera, finder.pattern(), kTagM, T_tag_camera, {code_sigma, static_cast<unsigned>(index) + 1}), index,
      static_cast<std::int64_t>(index) * kFrameNs);
}

struct Errors {
  std::vector<double> mm, degrees;
  int pictures = 0, surprises = 0;  ///< surprises: errors above three sigma

  void add(const reconstruct::PoseStage::Result& result, const Isometry3d& truth) {
    ++pictures;
    if (!result.pose) return;
    mm.push_back(millimetres_apart(result.pose->T_tag_camera, truth));
    degrees.push_back(degrees_apart(result.pose->T_tag_camera, truth));
    surprises += mm.back() > 3e3 * reconstruct::position_sigma_m(result.pose->covariance);
  }
};

/// Independent single pictures without a prior pose.
Errors first_sights(const capture::CameraModel& camera, double distance_m, double tilt_rad, bool with_depth) {
  Errors errors;
  for (unsigned i = 0; i < 8; ++i) {
    const Isometry3d truth = looking_at_tag(distance_m, tilt_rad, 0.8 * i, {0.01 * i, -0.02, 0});
    capture::FrameSet frame = view(camera, truth, i, 3);
    if (with_depth) frame.depth = std::make_shared<capture::DepthFrame>(depth_of_table(camera, truth, i, 1));
    errors.add(reconstruct::PoseStage(some_tag(), camera).locate(frame), truth);
  }
  return errors;
}

TEST(PoseSweep, Tilt) {
  Sweep sweep{.stem = "pose-tilt",
              .title = "One picture of a tag 1 m away, 640 x 480",
              .x_label = "tilt, degrees",
              .y_label = "largest turn off the truth, degrees",
              .x = {0, 10, 20, 30, 40, 50, 60, 70, 80},
              .curves = {{"picture alone"}, {"with depth"}},
              .max = 1.5};
  int surprises = 0, pictures = 0;
  for (const double tilt : sweep.x)
    for (const bool with_depth : {false, true}) {
      const Errors errors = first_sights(vga_camera(), 1, tilt * kDegree, with_depth);
      sweep.curves[with_depth ? 1 : 0].y.push_back(errors.degrees.empty() ? 0 : percentile(errors.degrees, 1));
      EXPECT_EQ(errors.degrees.size(), 8u) << tilt;
      surprises += errors.surprises;
      pictures += errors.pictures;
      if (!with_depth || errors.degrees.empty()) continue;
      EXPECT_LT(percentile(errors.degrees, 1), sweep.max) << "tilt " << tilt;
    }
  write_sweep(sweep);
  EXPECT_LT(surprises, 0.05 * pictures);
}

TEST(PoseSweep, Distance) {
  Sweep sweep{.stem = "pose-distance",
              .title = "One picture of a tag tilted by 35 degrees, 640 x 480",
              .x_label = "distance, m",
              .y_label = "off the truth, median of 8",
              .x = {0.3, 0.5, 0.75, 1, 1.5, 2, 3, 4},
              .curves = {{"place, mm"}, {"turn, 0.1 degrees"}},
              .logarithmic = true};
  int surprises = 0, pictures = 0;
  for (const double distance : sweep.x) {
    const Errors errors = first_sights(vga_camera(), distance, 35 * kDegree, true);
    ASSERT_GE(errors.mm.size(), 6u) << distance;
    sweep.curves[0].y.push_back(percentile(errors.mm, 0.5));
    sweep.curves[1].y.push_back(10 * percentile(errors.degrees, 0.5));
    surprises += errors.surprises;
    pictures += errors.pictures;
    // Corner errors are constant in pixels: pose errors grow with the square of the distance.
    EXPECT_LT(percentile(errors.mm, 0.5), 0.5 + 1.5 * distance * distance) << distance;
    EXPECT_LT(percentile(errors.degrees, 1), 2) << distance << " m: no flip";
  }
  write_sweep(sweep);
  EXPECT_LT(surprises, 0.05 * pictures);
}

/// Single pictures of a tag whose paper is `over` times as bright as the clipping level.
Errors overexposed(double over, double lens_blur, bool* warned) {
  const capture::CameraModel camera = small_camera();
  const reconstruct::TagFinder finder(some_tag());
  Errors errors;
  for (unsigned i = 0; i < 12; ++i) {
    const Isometry3d truth = looking_at_tag(0.85, (25 + 3 * (i % 4)) * kDegree, 0.7 * i, {0.02 * (i % 3), -0.03, 0});
    capture::FrameSet frame =
        frame_of(view_of_tag(camera, finder.pattern(), kTagM, truth, {3, i + 1, over / kPaperLight, lens_blur}), i, 0);
    frame.depth = std::make_shared<capture::DepthFrame>(depth_of_table(camera, truth, i, 1));
    const auto result = reconstruct::PoseStage(some_tag(), camera).locate(frame);
    errors.add(result, truth);
    *warned = *warned || !result.warnings.empty();
  }
  return errors;
}

// Where paper is clipped, its edges appear shifted into the ink.
TEST(PoseSweep, Overexposed) {
  Sweep sweep{
      .stem = "pose-overexposed",
      .title = "One picture of a tag that is too bright, 0.85 m away, 320 x 240",
      .x_label = "paper's light, times the picture's end",
      .y_label = "off the truth, median of 12",
      .x = {0.7, 1, 1.5, 2, 3, 4, 6, 8, 12, 16},
      .curves = {{"place, mm"}, {"turn, 0.1 degrees"}, {"place, mm, soft lens"}, {"turn, 0.1 degrees, soft lens"}},
      .logarithmic = true};
  int surprises = 0, pictures = 0;
  for (const double over : sweep.x)
    for (const bool soft : {false, true}) {
      bool warned = false;
      const Errors errors = overexposed(over, soft ? 0.5 : 0, &warned);
      ASSERT_EQ(errors.mm.size(), 12u) << over;
      const double mm = percentile(errors.mm, 0.5), degrees = percentile(errors.degrees, 0.5);
      sweep.curves[soft ? 2 : 0].y.push_back(mm);
      sweep.curves[soft ? 3 : 1].y.push_back(10 * degrees);
      surprises += errors.surprises;
      pictures += errors.pictures;
      EXPECT_LT(mm, over > 8 ? 3 : soft ? 1.5 : 1) << over << " soft " << soft;
      EXPECT_LT(degrees, over > 8 ? 0.2 : 0.1) << over << " soft " << soft;
      if (over <= 4) {
        EXPECT_FALSE(warned) << over << " soft " << soft;
      }
      if (over > 12) {
        EXPECT_TRUE(warned) << over << " soft " << soft;
      }
    }
  write_sweep(sweep);
  EXPECT_LT(surprises, 0.05 * pictures);
}

/// Motion blur along the rows: the camera moves sideways during the exposure.
capture::Frame blurred(const capture::Frame& picture, int pixels) {
  capture::Frame result = picture;
  const capture::Image<std::uint8_t>& from = picture.encoded;
  for (int v = 0; v < from.height; ++v)
    for (int u = 0; u < from.width; ++u) {
      float light = 0;
      for (int i = -pixels / 2; i <= pixels / 2; ++i)
        light += capture::srgb_to_linear(from.at(std::clamp(u + i, 0, from.width - 1), v) / 255.0f);
      const float code = 255 * capture::linear_to_srgb(light / static_cast<float>(2 * (pixels / 2) + 1));
      std::fill_n(&result.encoded.at(u, v), 3, static_cast<std::uint8_t>(std::lround(code)));
    }
  return result;
}

/// The largest error in mm while a camera starts to move sideways; `max` without a pose.
double error_while_moving(int blur_px, const reconstruct::TestRoom& room, const reconstruct::DistanceField* field,
                          double max) {
  const capture::CameraModel camera = small_camera();
  const Isometry3d start = looking_at_tag(1.0, 45 * kDegree, -1.4, {0.05, 0.12, 0.05});
  // The exposure lasts half of the frame interval.
  const double step_m = 2.0 * blur_px / camera.fx;
  reconstruct::PoseStage stage(some_tag(), camera);
  double worst = 0;
  for (std::uint64_t i = 0; i < 6; ++i) {
    Isometry3d truth = start;
    truth.translation() += start.linear().col(0) * step_m * std::max(0.0, static_cast<double>(i) - 1);
    capture::FrameSet frame = view(camera, truth, i, 2);
    if (i > 1) frame.color = std::make_shared<capture::Frame>(blurred(*frame.color, blur_px));
    frame.depth =
        std::make_shared<capture::DepthFrame>(depth_of_room(room, camera, truth, static_cast<unsigned>(i), 1));
    const auto result = stage.locate(frame, field);
    if (i < 2) continue;
    const double off_mm = result.pose ? millimetres_apart(result.pose->T_tag_camera, truth) : max;
    worst = std::max(worst, off_mm);
    // Failures are reported by the pose.
    if (result.pose && field) {
      EXPECT_LT(off_mm, 3 + 3e3 * reconstruct::position_sigma_m(result.pose->covariance)) << blur_px;
    }
  }
  return std::min(worst, max);
}

TEST(PoseSweep, Blur) {
  Sweep sweep{.stem = "pose-blur",
              .title = "A camera leaps sideways 1 m from a tag, 320 x 240",
              .x_label = "blur, pixels (each 0.23 m/s)",
              .y_label = "farthest off the truth, mm (cut at 40)",
              .x = {0, 2, 4, 6, 8, 10},
              .curves = {{"tag alone"}, {"with surfaces"}},
              .max = 3};
  const reconstruct::TestRoom room = furnished_room();
  const reconstruct::DistanceField field = room.field();
  for (const double blur : sweep.x) {
    sweep.curves[0].y.push_back(error_while_moving(static_cast<int>(blur), room, nullptr, 40));
    sweep.curves[1].y.push_back(error_while_moving(static_cast<int>(blur), room, &field, 40));
    EXPECT_LT(sweep.curves[1].y.back(), sweep.max) << blur;
  }
  write_sweep(sweep);
}

/// A hand covers a fraction of the tag while the camera moves slowly.
double error_while_covered(double fraction, const reconstruct::TestRoom& room, const reconstruct::DistanceField* field,
                           double max) {
  const capture::CameraModel camera = small_camera();
  reconstruct::PoseStage stage(some_tag(), camera);
  double worst = 0;
  for (std::uint64_t i = 0; i < 8; ++i) {
    const Isometry3d truth =
        looking_at_tag(0.9, 45 * kDegree, -1.4 + 0.006 * static_cast<double>(i), {0.05, 0.1, 0.05});
    capture::FrameSet frame = view(camera, truth, i, 2);
    if (i > 1) {
      capture::Frame covered = *frame.color;
      for (int v = 0; v < camera.height; ++v)
        for (int u = 0; u < camera.width; ++u) {
          const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
          const Vector3d d = truth.linear() * *ray;
          const Vector3d p = truth.translation() - truth.translation().z() / d.z() * d;
          if (p.x() > (0.5 - fraction) * 1.25 * kTagM) std::fill_n(&covered.encoded.at(u, v), 3, 150);
        }
      frame.color = std::make_shared<capture::Frame>(std::move(covered));
    }
    frame.depth =
        std::make_shared<capture::DepthFrame>(depth_of_room(room, camera, truth, static_cast<unsigned>(i), 1));
    const auto result = stage.locate(frame, field);
    if (i < 2) continue;
    worst = std::max(worst, result.pose ? millimetres_apart(result.pose->T_tag_camera, truth) : max);
  }
  return std::min(worst, max);
}

TEST(PoseSweep, Occlusion) {
  Sweep sweep{.stem = "pose-occlusion",
              .title = "A hand covers a tag 0.9 m away, 320 x 240",
              .x_label = "fraction covered",
              .y_label = "farthest off the truth, mm (cut at 40)",
              .x = {0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1},
              .curves = {{"tag alone"}, {"with surfaces"}},
              .max = 3};
  const reconstruct::TestRoom room = furnished_room();
  const reconstruct::DistanceField field = room.field();
  for (const double fraction : sweep.x) {
    sweep.curves[0].y.push_back(error_while_covered(fraction, room, nullptr, 40));
    sweep.curves[1].y.push_back(error_while_covered(fraction, room, &field, 40));
    EXPECT_LT(sweep.curves[1].y.back(), sweep.max) << fraction;
  }
  write_sweep(sweep);
}

/// Poses with noise of 0.5 mm and 0.5 mrad, as from a tag at 1 m.
TEST(PoseSweep, Filter) {
  constexpr double kSigmaM = 0.5e-3, kSigmaRad = 0.5e-3;
  Sweep sweep{.stem = "pose-filter",
              .title = "The filter: 0.5 mm of noise on a camera that moves evenly",
              .x_label = "speed, mm a frame",
              .y_label = "mm",
              .x = {0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30},
              .curves = {{"mean lag"}, {"noise left, RMS"}},
              .logarithmic = true,
              .max = 0.5};
  for (const double speed_mm : sweep.x) {
    reconstruct::PoseFilter filter;
    std::mt19937 random(7);
    std::normal_distribution<double> gauss(0, 1 / std::sqrt(3.0));
    double behind = 0, squares = 0, count = 0;
    for (int i = 0; i < 400; ++i) {
      Isometry3d truth = looking_at_tag(1, 0.7, 0.2).inverse();
      truth.translation().x() += 1e-3 * speed_mm * i;
      Isometry3d noisy = truth;
      noisy.translation() += kSigmaM * Vector3d(gauss(random), gauss(random), gauss(random));
      const Vector3d turn = kSigmaRad * Vector3d(gauss(random), gauss(random), gauss(random));
      noisy.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * noisy.linear();
      const Vector3d off = truth.translation() - filter.update(noisy, kSigmaM, kSigmaRad).translation();
      if (i < 100) continue;
      behind += off.x();
      squares += off.squaredNorm();
      ++count;
    }
    behind /= count;
    sweep.curves[0].y.push_back(1e3 * behind);
    sweep.curves[1].y.push_back(1e3 * std::sqrt(squares / count - behind * behind));
    // The lag is one frame at most, or less than the error of one measurement.
    EXPECT_LT(1e3 * behind, std::max(speed_mm, 1e3 * kSigmaM)) << speed_mm;
  }
  write_sweep(sweep);
}

TEST(PoseSweep, AStillCameraIsStill) {
  const capture::CameraModel camera = vga_camera();
  const Isometry3d truth = looking_at_tag(1, 40 * kDegree, -1.2);
  const capture::FrameSet quiet = view(camera, truth, 0, 0);
  reconstruct::PoseStage stage(some_tag(), camera);
  std::vector<Vector3d> raw, smooth;
  std::mt19937 random(3);
  std::normal_distribution<float> gauss(0, 4);
  for (std::uint64_t i = 0; i < 60; ++i) {
    capture::Frame noisy = *quiet.color;
    for (std::uint8_t& code : noisy.encoded.data)
      code = static_cast<std::uint8_t>(std::clamp(std::lround(code + gauss(random)), 0l, 255l));
    const auto result = stage.locate(frame_of(std::move(noisy), i, static_cast<std::int64_t>(i) * kFrameNs));
    ASSERT_TRUE(result.pose);
    if (i < 10) continue;
    raw.push_back(result.pose->T_tag_camera_raw.translation());
    smooth.push_back(result.pose->T_tag_camera.translation());
  }
  const auto rms_mm = [](const std::vector<Vector3d>& places) {
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& place : places) mean += place / static_cast<double>(places.size());
    double squares = 0;
    for (const Vector3d& place : places) squares += (place - mean).squaredNorm() / static_cast<double>(places.size());
    return 1e3 * std::sqrt(squares);
  };
  std::printf("pose: still camera 1 m from the tag, noise of 4 codes: %.3f mm RMS raw, %.3f mm after the filter\n",
              rms_mm(raw), rms_mm(smooth));
  EXPECT_LT(rms_mm(smooth), 0.3);
}

/// The pose that explains the tag's corners best, each seen from where the camera was at its row's time, to first
/// order: least squares of four corners over six unknowns.
Isometry3d pose_of_corners(const capture::CameraModel& camera, const Isometry3d& T_tag_camera,
                           const RollingShutter& shutter) {
  const double tag_row = camera.project(T_tag_camera.inverse().translation())->y();
  Eigen::Matrix<double, 8, 6> by_pose;
  Eigen::Matrix<double, 8, 1> off_px;
  Isometry3d pose = T_tag_camera;
  const auto stepped = [](const Isometry3d& from, const Eigen::Matrix<double, 6, 1>& step) {
    Isometry3d to = from;
    to.translate(Vector3d(step.head<3>()));
    const double angle = step.tail<3>().norm();
    if (angle > 0) to.rotate(Eigen::AngleAxisd(angle, step.tail<3>() / angle));
    return to;
  };
  for (int round = 0; round < 5; ++round) {
    for (int k = 0; k < 4; ++k) {
      const Vector3d corner(k % 2 ? kTagM / 2 : -kTagM / 2, k / 2 ? kTagM / 2 : -kTagM / 2, 0);
      const auto seen_from = [&](const Isometry3d& from) { return *camera.project(from.inverse() * corner); };
      Eigen::Vector2d seen = seen_from(T_tag_camera);
      for (int i = 0; i < 3; ++i)
        seen = seen_from(shutter.at(T_tag_camera, shutter.seconds(camera, seen.y(), tag_row)));
      off_px.segment<2>(2 * k) = seen - seen_from(pose);
      for (int axis = 0; axis < 6; ++axis) {
        const Eigen::Matrix<double, 6, 1> step = 1e-5 * Eigen::Matrix<double, 6, 1>::Unit(axis);
        by_pose.block<2, 1>(2 * k, axis) = (seen_from(stepped(pose, step)) - seen_from(pose)) / 1e-5;
      }
    }
    pose = stepped(pose, by_pose.colPivHouseholderQr().solve(off_px));
  }
  return pose;
}

// Where the readout time is stated the pose is that at the tag's row; else its covariance contains the error.
TEST(PoseSweep, RollingShutter) {
  Sweep sweep{.stem = "pose-rolling-shutter",
              .title = "A tag 1 m away, tilted by 45 degrees, 640 x 480",
              .x_label = "readout of a picture, ms",
              .y_label = "off the pose at the tag's row, degrees",
              .x = {0, 5, 10, 20, 33},
              .curves = {{"panning by 30 degrees/s, readout not stated"},
                         {"corners alone", {}, true},
                         {"readout stated"},
                         {"walking by 0.3 m/s, readout not stated"},
                         {"corners alone", {}, true},
                         {"readout stated"}}};
  const capture::CameraModel camera = vga_camera();
  const Isometry3d truth = looking_at_tag(1, 45 * kDegree, -1.2);
  for (const double readout_ms : sweep.x) {
    RollingShutter pan{1e-3 * readout_ms}, walk{1e-3 * readout_ms};
    pan.turn_rad_s = {0, 30 * kDegree, 0};
    walk.speed_m_s = {0.3, 0, 0};
    for (const RollingShutter& shutter : {pan, walk}) {
      const std::size_t curve = shutter.speed_m_s.norm() > 0 ? 3 : 0;
      const Isometry3d expected = pose_of_corners(camera, truth, shutter);
      const double answer = degrees_apart(expected, truth);
      sweep.curves[curve + 1].y.push_back(answer);
      for (const bool stated : {false, true}) {
        reconstruct::PoseStage stage(some_tag(), camera, capture::Response::srgb(), {},
                                     stated ? std::optional(shutter.readout_s) : std::nullopt);
        const auto result = shutter.locate(stage, camera, truth);
        ASSERT_TRUE(result.pose) << readout_ms;
        const double turn = degrees_apart(result.pose->T_tag_camera, truth);
        const double off_mm = millimetres_apart(result.pose->T_tag_camera, truth);
        const double claimed_mm = 1e3 * reconstruct::position_sigma_m(result.pose->covariance);
        sweep.curves[curve + (stated ? 2 : 0)].y.push_back(turn);
        std::printf(
            "pose: readout of %.0f ms %s, %s: %.1f mm, %.2f deg; corners alone %.1f mm, %.2f deg; claimed %.1f mm\n",
            readout_ms, stated ? "stated" : "not stated", curve == 0 ? "panning" : "walking", off_mm, turn,
            millimetres_apart(expected, truth), answer, claimed_mm);
        EXPECT_LT(off_mm, 3 * claimed_mm) << readout_ms << " ms, curve " << curve << ", stated: " << stated;
        if (stated)
          EXPECT_LT(turn, 0.03 + 0.05 * answer) << readout_ms << " ms, curve " << curve;
        else
          EXPECT_NEAR(turn, answer, 0.1 + 0.2 * answer) << readout_ms << " ms, curve " << curve;
      }
    }
  }
  write_sweep(sweep);
}

}  // namespace
}  // namespace lumigraft::test
