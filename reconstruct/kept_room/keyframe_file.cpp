#include "reconstruct/kept_room/keyframe_file.h"

#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>
#include <string>

#include "capture/error.h"
#include "capture/message_text.h"

namespace lumigraft::reconstruct {
namespace {

using capture::InputError;

constexpr int kFormat = 1;

/// What must be the same for views to be of use: the world frame, and the mapping from pixels to rays.
std::string identity_of(const capture::Tag& tag, const capture::CameraModel& color) {
  std::string text = world_name(tag);
  text += capture::formatted("; camera of %d x %d pixels, f %.6g %.6g, c %.6g %.6g", color.width, color.height,
                             color.fx, color.fy, color.cx, color.cy);
  for (const double k : color.distortion) text += capture::formatted(" %.6g", k);
  return text;
}

/// A matrix over values that stay where they are; OpenCV has no const one.
template <typename T>
cv::Mat rows_of(int rows, int columns, int type, const T* data) {
  return cv::Mat(rows, columns, type, const_cast<T*>(data));
}

void write_view(cv::FileStorage& out, const Keyframe& view) {
  const int points = static_cast<int>(view.features.size());
  cv::Mat pose, covariance;
  cv::eigen2cv(view.pose.T_tag_camera.matrix(), pose);
  cv::eigen2cv(view.pose.covariance, covariance);
  out << "{"
      << "T_tag_camera" << pose << "covariance" << covariance;
  out << "pixels" << rows_of(points, 2, CV_32F, view.features.pixels.front().data());
  out << "sigma_px" << rows_of(points, 1, CV_32F, view.features.sigma_px.data());
  out << "points_m" << rows_of(points, 3, CV_32F, view.points_m.front().data());
  out << "descriptors" << rows_of(points, ViewFeatures::kDescriptorBytes, CV_8U, view.features.descriptors.data.data());
  out << "small" << rows_of(1, static_cast<int>(view.features.small.size()), CV_32F, view.features.small.data());
  out << "}";
}

/// The matrix `key` of the type, or an error. Rows and columns of 0: any number.
cv::Mat matrix(const cv::FileNode& node, const char* key, int rows, int columns, int type) {
  cv::Mat m;
  node[key] >> m;
  if (m.type() != type || m.empty() || (rows > 0 && m.rows != rows) || (columns > 0 && m.cols != columns) ||
      !cv::checkRange(m))
    throw InputError(std::string(key) + ": found " + std::to_string(m.rows) + " x " + std::to_string(m.cols) +
                     " values, allowed: finite ones" +
                     (rows > 0 ? ", " + std::to_string(rows) + " rows" : std::string()) +
                     (columns > 0 ? ", " + std::to_string(columns) + " columns" : std::string()));
  return m;
}

Keyframe read_view(const cv::FileNode& node) {
  Keyframe view;
  const cv::Mat pixels = matrix(node, "pixels", 0, 2, CV_32F);
  const int points = pixels.rows;
  const cv::Mat sigma = matrix(node, "sigma_px", points, 1, CV_32F),
                position = matrix(node, "points_m", points, 3, CV_32F),
                descriptors = matrix(node, "descriptors", points, ViewFeatures::kDescriptorBytes, CV_8U),
                small = matrix(node, "small", 1, 0, CV_32F);
  for (int i = 0; i < points; ++i) {
    view.features.pixels.emplace_back(pixels.at<float>(i, 0), pixels.at<float>(i, 1));
    view.features.sigma_px.push_back(sigma.at<float>(i, 0));
    view.points_m.emplace_back(position.at<float>(i, 0), position.at<float>(i, 1), position.at<float>(i, 2));
    if (!(view.features.sigma_px.back() > 0) || !(view.points_m.back().z() > 0))
      throw InputError("points_m, sigma_px: found values that are not above 0");
  }
  view.features.descriptors = capture::Image<std::uint8_t>(ViewFeatures::kDescriptorBytes, points, 1);
  std::memcpy(view.features.descriptors.data.data(), descriptors.ptr(), view.features.descriptors.data.size());
  view.features.small.assign(small.begin<float>(), small.end<float>());
  Eigen::Matrix4d pose;
  cv::cv2eigen(matrix(node, "T_tag_camera", 4, 4, CV_64F), pose);
  cv::cv2eigen(matrix(node, "covariance", 6, 6, CV_64F), view.pose.covariance);
  const Eigen::Matrix3d rotation = pose.topLeftCorner<3, 3>();
  constexpr double kRigid = 1e-6;
  if (!(rotation * rotation.transpose()).isIdentity(kRigid) || !(rotation.determinant() > 0) ||
      pose.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw InputError("T_tag_camera: found a matrix that is no rigid transform");
  view.pose.T_tag_camera.matrix() = pose;
  return view;
}

}  // namespace

std::string world_name(const capture::Tag& tag) {
  return tag.present() ? capture::formatted("%s %d, %.6g m", tag.family.c_str(), tag.id, tag.size_m)
                       : std::string("a surface");
}

void write_views(const std::filesystem::path& file, const KeyframeMap::Views& views, const capture::Tag& tag,
                 const capture::CameraModel& color) {
  // OpenCV chooses the format by the end of the name.
  const std::filesystem::path partial = file.parent_path() / ("partial-" + file.filename().string());
  try {
    cv::FileStorage out(partial.string(), cv::FileStorage::WRITE_BASE64);
    if (!out.isOpened()) throw InputError("cannot be written");
    out << "format" << kFormat << "world" << identity_of(tag, color) << "views"
        << "[";
    for (const auto& view : views) write_view(out, *view);
    out << "]"
        << "complete" << 1;
    out.release();
    std::filesystem::rename(partial, file);
  } catch (const std::exception& e) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw InputError(file.string() + ": " + capture::on_one_line(e.what()));
  }
}

KeyframeMap::Views read_views(const std::filesystem::path& file, const capture::Tag& tag,
                              const capture::CameraModel& color) {
  try {
    if (!std::filesystem::exists(file)) throw InputError("no such file");
    const cv::FileStorage in(file.string(), cv::FileStorage::READ);
    if (!in.isOpened()) throw InputError("cannot be read");
    const int format = static_cast<int>(in["format"]);
    if (format != kFormat)
      throw InputError("format: found " + std::to_string(format) + ", allowed: " + std::to_string(kFormat));
    const std::string world = static_cast<std::string>(in["world"]), wanted = identity_of(tag, color);
    if (world != wanted) throw InputError("world: found \"" + world + "\", allowed: \"" + wanted + "\"");
    if (static_cast<int>(in["complete"]) != 1) throw InputError("cut short");
    KeyframeMap::Views views;
    for (const cv::FileNode& node : in["views"]) views.push_back(std::make_shared<const Keyframe>(read_view(node)));
    return views;
  } catch (const std::exception& e) {
    throw InputError(file.string() + ": " + capture::on_one_line(e.what()));
  }
}

}  // namespace lumigraft::reconstruct
