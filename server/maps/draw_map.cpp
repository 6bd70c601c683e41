#include "server/maps/draw_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "capture/camera/srgb.h"
#include "capture/message_text.h"
#include "server/maps/parameters.h"

namespace lumigraft::server {
namespace {

using Picture = capture::Image<std::uint8_t>;
using Rgb = std::array<std::uint8_t, 3>;

constexpr Rgb kUnknown = {0, 0, 0}, kUnsolved = {48, 48, 48};

std::uint8_t rounded(float value) { return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)); }

/// `rgb(u, v)` at every pixel.
template <typename Function>
Picture painted(int width, int height, const Function& rgb) {
  Picture picture(width, height, 3);
  std::size_t i = 0;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      for (const std::uint8_t value : Rgb(rgb(u, v))) picture.data[i++] = value;
    }
  }
  return picture;
}

/// `rgb(before, after)` of the three pixel values of every pixel.
template <typename Function>
Picture compared(const MapSource& source, const Function& rgb) {
  return painted(source.camera.width, source.camera.height, [&](int u, int v) {
    const std::size_t i = 3 * static_cast<std::size_t>(v * source.camera.width + u);
    return rgb(&source.camera.data[i], &source.shown->data[i]);
  });
}

Picture side_by_side(const MapSource& source) {
  const int width = source.camera.width;
  return painted(2 * width, source.camera.height, [&](int u, int v) {
    const Picture& from = u < width ? source.camera : *source.shown;
    const std::uint8_t* p = &from.data[3 * static_cast<std::size_t>(v * width + u % width)];
    return Rgb{p[0], p[1], p[2]};
  });
}

Picture change(const MapSource& source) {
  return compared(source, [](const std::uint8_t* before, const std::uint8_t* after) {
    Rgb rgb{};
    for (std::size_t c = 0; c < 3; ++c)
      rgb[c] = rounded(128 + kMaps.change_gain * static_cast<float>(after[c] - before[c]));
    return rgb;
  });
}

Picture shadow(const MapSource& source) {
  const auto luminance = [](const std::uint8_t* p) {
    const auto& linear = capture::srgb_table().linear;
    return 0.2126f * linear[p[0]] + 0.7152f * linear[p[1]] + 0.0722f * linear[p[2]];
  };
  return compared(source, [&](const std::uint8_t* before, const std::uint8_t* after) {
    const float was = luminance(before);
    const float left = was > 0 ? std::min(luminance(after) / was, 1.0f) : 1.0f;
    const std::uint8_t grey = capture::srgb_table().code(left);
    return Rgb{grey, grey, grey};
  });
}

/// Turbo (Mikhailov 2019), from red where it is near to blue where it is far.
Rgb depth_color(float depth_m) {
  static const cv::Mat_<cv::Vec3b> table = [] {
    cv::Mat_<std::uint8_t> codes(1, 256);
    for (int i = 0; i < 256; ++i) codes(0, i) = static_cast<std::uint8_t>(i);
    cv::Mat colors;
    cv::applyColorMap(codes, colors, cv::COLORMAP_TURBO);
    return cv::Mat_<cv::Vec3b>(colors);
  }();
  const float far = std::log(depth_m / kMaps.first_depth_m) / std::log(kMaps.last_depth_m / kMaps.first_depth_m);
  // The ends of the table are too dark to be told from unknown.
  const cv::Vec3b bgr = table(0, static_cast<int>(std::lround(240 - 220 * std::clamp(far, 0.0f, 1.0f))));
  return {bgr[2], bgr[1], bgr[0]};
}

Rgb albedo_color(const reconstruct::AlbedoField& albedo, const Eigen::Vector3f& position_m) {
  const Eigen::Vector3i voxel = (position_m / albedo.voxel_m).array().round().matrix().cast<int>();
  const auto brick = albedo.bricks.find(reconstruct::brick_of(voxel));
  const auto index = static_cast<std::size_t>(reconstruct::index_in_brick(voxel));
  if (brick == albedo.bricks.end() || brick->second->sigma[index] < 0) return kUnsolved;
  const Eigen::Vector3f& color = brick->second->albedo[index];
  Rgb rgb{};
  for (int c = 0; c < 3; ++c) rgb[static_cast<std::size_t>(c)] = capture::srgb_table().code(color[c]);
  return rgb;
}

Rgb normal_color(const Eigen::Vector3f& n) {
  return {rounded(127.5f * (n.x() + 1)), rounded(127.5f * (n.y() + 1)), rounded(127.5f * (n.z() + 1))};
}

Picture of_surface(MapKind kind, const MapSource& source, const SeenSurface& surface) {
  return painted(source.lens.width, source.lens.height, [&](int u, int v) {
    const std::optional<SeenSurface::Pixel>& pixel = surface.at(u, v);
    if (!pixel) return kUnknown;
    if (kind == MapKind::depth) return depth_color(pixel->depth_m);
    if (kind == MapKind::surface) return normal_color(pixel->normal);
    return albedo_color(*source.scene.albedo, pixel->position_m);
  });
}

/// Direction to a lamp in the camera's frame, and its distance in metres if it is known.
struct LampDirection {
  Eigen::Vector3d direction;
  std::optional<double> distance_m;
};

LampDirection seen_from_camera(const reconstruct::PointLight& lamp, const Eigen::Isometry3d& T_tag_camera) {
  if (!lamp.distance_known) return {T_tag_camera.linear().transpose() * lamp.direction.cast<double>(), std::nullopt};
  const Eigen::Vector3d at_m = T_tag_camera.inverse() * lamp.position_m.cast<double>();
  return {at_m.normalized(), at_m.norm()};
}

/// A disk where the lamp is in the picture, else an arrow at its border towards it; beside it its distance.
void mark(cv::Mat& picture, const capture::CameraModel& lens, const reconstruct::PointLight& lamp,
          const LampDirection& seen) {
  const double size = kMaps.arrow_fraction * picture.rows;
  const Eigen::Vector3f hue = lamp.irradiance / std::max(lamp.irradiance.maxCoeff(), 1e-9f);
  cv::Scalar color;
  for (int c = 0; c < 3; ++c) color[c] = capture::srgb_table().code(std::clamp(hue[c], 0.0f, 1.0f));
  const std::string text = seen.distance_m ? capture::formatted("%.2f m", *seen.distance_m) : std::string("far");
  const auto pixel = seen.direction.z() > 0 ? lens.project(seen.direction) : std::nullopt;
  cv::Point at;
  if (pixel && lens.inside(*pixel)) {
    at = {static_cast<int>(pixel->x()), static_cast<int>(pixel->y())};
    cv::circle(picture, at, static_cast<int>(size), color, 2, cv::LINE_AA);
    cv::circle(picture, at, static_cast<int>(size / 3), color, cv::FILLED, cv::LINE_AA);
  } else {
    const Eigen::Vector2d middle(0.5 * picture.cols, 0.5 * picture.rows);
    Eigen::Vector2d out = seen.direction.head<2>();
    out = out.norm() > 1e-9 ? Eigen::Vector2d(out.normalized()) : Eigen::Vector2d(0, -1);
    const double reach = std::min(std::abs(out.x()) > 1e-9 ? (middle.x() - size) / std::abs(out.x()) : 1e9,
                                  std::abs(out.y()) > 1e-9 ? (middle.y() - size) / std::abs(out.y()) : 1e9);
    const Eigen::Vector2d tip = middle + reach * out, foot = tip - 2 * size * out;
    at = {static_cast<int>(foot.x()), static_cast<int>(foot.y())};
    cv::arrowedLine(picture, at, {static_cast<int>(tip.x()), static_cast<int>(tip.y())}, color, 3, cv::LINE_AA, 0, 0.5);
  }
  const double scale = picture.rows / 800.0;
  const cv::Size room = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, nullptr);
  const cv::Point place(std::clamp(at.x + static_cast<int>(size) + 4, 2, std::max(2, picture.cols - room.width - 2)),
                        std::clamp(at.y + room.height / 2, room.height + 2, picture.rows - 4));
  cv::putText(picture, text, place, cv::FONT_HERSHEY_SIMPLEX, scale, {0, 0, 0}, 3, cv::LINE_AA);
  cv::putText(picture, text, place, cv::FONT_HERSHEY_SIMPLEX, scale, {255, 255, 255}, 1, cv::LINE_AA);
}

Picture lamps(const MapSource& source) {
  Picture drawn = source.camera;
  for (std::uint8_t& value : drawn.data) value = rounded(kMaps.behind_lamps * static_cast<float>(value));
  cv::Mat picture(drawn.height, drawn.width, CV_8UC3, drawn.data.data());
  for (const reconstruct::PointLight& lamp : source.scene.illumination->lights) {
    if (lamp.visibility == reconstruct::PointLight::Visibility::dark) continue;
    mark(picture, source.lens, lamp, seen_from_camera(lamp, source.scene.pose->T_tag_camera));
  }
  return drawn;
}

}  // namespace

std::optional<Picture> draw_map(MapKind kind, const MapSource& source, SeenSurface& surface) {
  const reconstruct::Scene& scene = source.scene;
  if (kind == MapKind::before_after) return side_by_side(source);
  if (kind == MapKind::change) return change(source);
  if (kind == MapKind::shadow) return shadow(source);
  if (!scene.pose) return std::nullopt;
  if (kind == MapKind::lamps) return scene.illumination ? std::optional(lamps(source)) : std::nullopt;
  if (!scene.field || (kind == MapKind::albedo && !scene.albedo)) return std::nullopt;
  surface.update(source.lens, scene.pose->T_tag_camera, scene.field);
  return of_surface(kind, source, surface);
}

}  // namespace lumigraft::server
