#pragma once
// Frames of a capture in the format of 7-Scenes: frame-NNNNNN.{color.jpg,depth.png,pose.txt} of a Kinect v1 at 30 Hz.
#include <Eigen/Geometry>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/formats/picture_file.h"
#include "capture/formats/pixel_format.h"
#include "capture/frame.h"

namespace lumigraft::test {

inline capture::CameraModel seven_scenes_camera() {
  capture::CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 585;
  camera.cx = 320;
  camera.cy = 240;
  return camera;
}

struct PosedFrame {
  capture::FrameSet frame;
  Eigen::Isometry3d T_world_camera = Eigen::Isometry3d::Identity();
};

/// Empty if the folder has no frame of this number.
inline std::optional<PosedFrame> seven_scenes_frame(const std::filesystem::path& folder, unsigned number) {
  char name[40];
  std::snprintf(name, sizeof(name), "frame-%06u", number);
  const std::string stem = folder / name;
  if (!std::filesystem::exists(stem + ".pose.txt")) return std::nullopt;
  PosedFrame result;
  std::ifstream pose(stem + ".pose.txt");
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) pose >> result.T_world_camera.matrix()(r, c);
  result.T_world_camera.linear() = Eigen::Quaterniond(result.T_world_camera.linear()).normalized().toRotationMatrix();
  const auto counts_mm = capture::read_depth(stem + ".depth.png");
  auto depth = std::make_shared<capture::DepthFrame>();
  depth->depth_m = capture::Image<float>(counts_mm.width, counts_mm.height, 1);
  for (std::size_t i = 0; i < counts_mm.data.size(); ++i)
    depth->depth_m.data[i] = counts_mm.data[i] == 65535 ? 0.0f : 0.001f * counts_mm.data[i];
  std::ifstream jpeg(stem + ".color.jpg", std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(jpeg), {}};
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 1;
  color->encoded = capture::PixelConverter()
                       .to_rgb(capture::PixelFormat::mjpeg, counts_mm.width, counts_mm.height,
                               {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()})
                       .value();
  result.frame.index = number;
  result.frame.time_ns = number * std::int64_t{33'333'333};
  result.frame.color = color;
  result.frame.depth = depth;
  return result;
}

}  // namespace lumigraft::test
