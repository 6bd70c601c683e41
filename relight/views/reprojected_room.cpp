#include "relight/views/reprojected_room.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "relight/gather/parameters.h"
#include "relight/tracing/fast_exp.h"
#include "relight/tracing/parallel_for.h"
#include "relight/views/view_projection.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

class RoomReprojection {
 public:
  RoomReprojection(const RoomInView& view, const Eigen::Isometry3f& T_tag_view, const PixelRays& rays,
                   const Eigen::Isometry3f& T_tag_camera, const CurrentDepth& depth, const CameraUpload* picture,
                   RoomInView& out)
      : view_(view),
        projection_(view.camera, T_tag_view),
        rays_(rays),
        T_tag_camera_(T_tag_camera),
        depth_(depth),
        picture_(picture),
        eye_m_(T_tag_camera.translation()),
        width_(view.camera.width),
        height_(view.camera.height),
        right_(width_ > 1 ? 1 : 0),
        below_(height_ > 1 ? static_cast<std::size_t>(width_) : 0),
        out_(out) {
    double sum_m = 0;
    int known = 0;
    for (const ViewSurface& surface : view.surfaces) {
      sum_m += surface.known ? surface.depth_m : 0;
      known += surface.known ? 1 : 0;
    }
    if (known > 0) usual_m_ = static_cast<float>(sum_m / known);
  }

  void row(int v) const {
    // Where the surface of the pixel to the left was: most are near it.
    Vector2f shift = Vector2f::Zero();
    for (int u = 0; u < width_; ++u) {
      const std::size_t i = index(u, v);
      out_.surfaces[i].known = false;
      const Vector3f w = T_tag_camera_.linear() * rays_.at(u, v);
      const Vector2f pixel(u, v);
      const float depth_m = w.isZero(0) ? 0 : depth_at(u, v);
      out_.surfaces[i].depth_m = 0;
      std::optional<Source> source;
      if (depth_m > 0) source = at(depth_m, w);
      if (!source && !w.isZero(0)) source = nearer(find(w, within(pixel + shift)), find(w, pixel));
      if (!source && !w.isZero(0)) source = at(usual_m_, w);
      if (source && depth_m > 0 && std::abs(source->distance_m - depth_m) > depth_.allowed_m(depth_m)) {
        out_.surfaces[i].position_m = eye_m_ + depth_m * w;
        out_.surfaces[i].depth_m = depth_m;
        continue;
      }
      if (!source) {
        shift.setZero();
        continue;
      }
      shift = source->at - pixel;
      take(i, w, *source);
      out_.tiles.set(u / TileMask::kEdge, v / TileMask::kEdge);
    }
  }

  /// The surface next to a pixel that explains its depth, where the view saw none there; -1: none. After all rows.
  int around(int u, int v) const {
    const ViewSurface& own = out_.surfaces[index(u, v)];
    if (own.known || !(own.depth_m > 0)) return -1;
    const float allowed_m = depth_.allowed_m(own.depth_m);
    int nearest = -1, least = kGather.uncovered_reach_px * kGather.uncovered_reach_px + 1;
    for (int y = std::max(v - kGather.uncovered_reach_px, 0);
         y <= std::min(v + kGather.uncovered_reach_px, height_ - 1); ++y) {
      for (int x = std::max(u - kGather.uncovered_reach_px, 0);
           x <= std::min(u + kGather.uncovered_reach_px, width_ - 1); ++x) {
        const int off = (x - u) * (x - u) + (y - v) * (y - v);
        const ViewSurface& other = out_.surfaces[index(x, y)];
        if (off >= least || !other.known) continue;
        if (std::abs(other.normal.dot(own.position_m - other.position_m)) > allowed_m) continue;
        least = off;
        nearest = static_cast<int>(index(x, y));
      }
    }
    return nearest;
  }
  /// Continues that surface there.
  void continue_from(std::size_t other, std::size_t i) const {
    ViewSurface& surface = out_.surfaces[i];
    surface = {surface.position_m, out_.surfaces[other].normal, surface.depth_m, true, out_.surfaces[other].glossy};
    set_at(out_.change, i, radiance_at(out_.change, other));
    set_at(out_.radiance, i, radiance_at(out_.radiance, other));
    const int u = static_cast<int>(i) % width_, v = static_cast<int>(i) / width_;
    out_.tiles.set(u / TileMask::kEdge, v / TileMask::kEdge);
  }

 private:
  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  }
  Vector2f within(const Vector2f& pixel) const {
    return pixel.cwiseMax(0).cwiseMin(Vector2f(static_cast<float>(width_ - 1), static_cast<float>(height_ - 1)));
  }
  std::size_t nearest(const Vector2f& pixel) const {
    return index(static_cast<int>(pixel.x() + 0.5f), static_cast<int>(pixel.y() + 0.5f));
  }

  /// Intersection of a ray with the room: its distance, and the pixel of the view that shows it.
  struct Source {
    float distance_m;
    Vector2f at;
  };

  /// Of the central pixel of the camera's in this one; 0: unknown.
  float depth_at(int u, int v) const {
    const float depth_m = depth_.at(std::min(u * view_.scale + central_offset(view_.scale), depth_.width() - 1),
                                    std::min(v * view_.scale + central_offset(view_.scale), depth_.height() - 1));
    return std::isfinite(depth_m) ? depth_m : 0;
  }

  /// Starts at the point at this distance along the ray.
  std::optional<Source> at(float distance_m, const Vector3f& w) const {
    const auto pixel = projection_.pixel(eye_m_ + distance_m * w);
    return pixel ? find(w, within(*pixel)) : std::nullopt;
  }

  static std::optional<Source> nearer(const std::optional<Source>& a, const std::optional<Source>& b) {
    if (!a || !b) return a ? a : b;
    return a->distance_m <= b->distance_m ? a : b;
  }

  /// `at`: initial guess. Empty: no surface is known there.
  std::optional<Source> find(const Vector3f& w, Vector2f at) const {
    constexpr int kSteps = 4;
    constexpr float kSettled_px = 0.25f;
    float distance_m = 0;
    for (int step = 0; step < kSteps; ++step) {
      const ViewSurface& s = view_.surfaces[nearest(at)];
      if (!s.known) return std::nullopt;
      distance_m = along(w, s);
      const auto pixel = projection_.pixel(eye_m_ + distance_m * w);
      if (!pixel) return std::nullopt;
      const Vector2f next = within(*pixel);
      const bool settled = (next - at).squaredNorm() < kSettled_px * kSettled_px;
      at = next;
      if (settled) break;
    }
    if (!view_.surfaces[nearest(at)].known) return std::nullopt;
    return Source{distance_m, at};
  }

  /// To the plane of a surface; where it is seen too flatly, as far as it is.
  float along(const Vector3f& w, const ViewSurface& s) const {
    const float far_m = (s.position_m - eye_m_).norm(), cosine = -s.normal.dot(w);
    if (cosine < kGather.grazing) return far_m;
    const float t_m = s.normal.dot(eye_m_ - s.position_m) / cosine;
    // The plane ends with the surface, of which a pixel shows little.
    return t_m > 0 ? std::clamp(t_m, far_m / 2, 2 * far_m) : far_m;
  }

  void take(std::size_t i, const Vector3f& w, const Source& source) const {
    const auto& [distance_m, at] = source;
    const Vector3f p_m = eye_m_ + distance_m * w;
    const int x = std::clamp(static_cast<int>(at.x()), 0, std::max(width_ - 2, 0)),
              y = std::clamp(static_cast<int>(at.y()), 0, std::max(height_ - 2, 0));
    const float right = at.x() - static_cast<float>(x), down = at.y() - static_cast<float>(y);
    const std::size_t first = index(x, y);
    const std::array<std::size_t, 4> corners{first, first + right_, first + below_, first + right_ + below_};
    std::array<float, 4> weight{(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down};
    const float allowed_m = kGather.off_px * distance_m / static_cast<float>(view_.camera.fx);
    float sum = 0;
    std::size_t most = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const ViewSurface& corner = view_.surfaces[corners[k]];
      const float off = corner.normal.dot(p_m - corner.position_m) / allowed_m;
      weight[k] = corner.known ? (weight[k] + kGather.block_unlike) * (fast_exp(off * off) + kGather.block_unlike) : 0;
      sum += weight[k];
      if (weight[k] > weight[most]) most = k;
    }
    if (!(sum > 0)) return;
    Rgb change = Rgb::Zero(), radiance = Rgb::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      change += weight[k] / sum * radiance_at(view_.change, corners[k]);
      radiance += weight[k] / sum * radiance_at(view_.radiance, corners[k]);
    }
    if (picture_ && !change.isZero(0)) change *= bound(i, radiance);
    const ViewSurface& surface = view_.surfaces[corners[most]];
    out_.surfaces[i] = {p_m, surface.normal, distance_m, true, surface.glossy};
    set_at(out_.change, i, change);
    set_at(out_.radiance, i, radiance);
  }

  /// Factor of a change that was found under this radiance. Four pixels of a square give that of now.
  Rgb bound(std::size_t i, const Rgb& then) const {
    const int scale = view_.scale, left = static_cast<int>(i) % width_ * scale,
              top = static_cast<int>(i) / width_ * scale;
    Rgb now = Rgb::Zero();
    for (int k = 0; k < 4; ++k) {
      const int u = std::min(left + (k & 1 ? (3 * scale) / 4 : scale / 4), depth_.width() - 1),
                v = std::min(top + (k >> 1 ? (3 * scale) / 4 : scale / 4), depth_.height() - 1);
      now += picture_->radiance(static_cast<std::size_t>(v) * static_cast<std::size_t>(depth_.width()) +
                                static_cast<std::size_t>(u)) /
             4;
    }
    return (now > kGather.brighter * then).select(kGather.brighter * then / now, 1);
  }

  const RoomInView& view_;
  ViewProjection projection_;
  const PixelRays& rays_;
  Eigen::Isometry3f T_tag_camera_;
  const CurrentDepth& depth_;
  const CameraUpload* picture_;
  Vector3f eye_m_;
  float usual_m_ = 1;  ///< mean distance of the view's surfaces
  int width_, height_;
  std::size_t right_, below_;  ///< from a pixel to its right and lower neighbour, 0 if there is none
  RoomInView& out_;
};

}  // namespace

RoomInView reprojected(const RoomInView& view, const Eigen::Isometry3f& T_tag_view, const PixelRays& rays,
                       const Eigen::Isometry3f& T_tag_camera, const CurrentDepth& depth, const CameraUpload* picture,
                       RoomInView memory) {
  RoomInView out = std::move(memory);
  const capture::CameraModel& model = view.camera;
  out.scale = view.scale;
  out.camera = model;
  out.surfaces.resize(view.surfaces.size());
  for (capture::Image<float>* image : {&out.change, &out.radiance}) {
    if (image->width != model.width || image->height != model.height || image->data.empty())
      *image = capture::Image<float>(model.width, model.height, 3);
    else
      std::fill(image->data.begin(), image->data.end(), 0.0f);
  }
  out.tiles = {model.width, model.height, false};
  const RoomReprojection reprojection(view, T_tag_view, rays, T_tag_camera, depth, picture, out);
  for_each_index(model.height, TileMask::kEdge, [&](int v) { reprojection.row(v); });  // no two threads share a tile
  // Surface that came or is uncovered since the view.
  using Continued = std::pair<int, int>;  // a pixel, and the one whose surface it shows
  const auto find_continued = [&](int v, std::vector<Continued>& found) {
    for (int u = 0; u < model.width; ++u) {
      if (const int other = reprojection.around(u, v); other >= 0) found.emplace_back(v * model.width + u, other);
    }
  };
  for (const auto& [i, other] : found_in_rows<Continued>(model.height, find_continued))
    reprojection.continue_from(static_cast<std::size_t>(other), static_cast<std::size_t>(i));
  return out;
}

float overlap(const RoomInView& view, const Eigen::Isometry3f& T_tag_view, const Eigen::Isometry3f& T_tag_camera) {
  constexpr int kAcross = 16;
  const ViewProjection then(view.camera, T_tag_view);
  const Eigen::Isometry3f T_now_then = T_tag_camera * T_tag_view.inverse();
  int inside = 0, all = 0;
  for (int k = 0; k < kAcross * kAcross; ++k) {
    const int u = (2 * (k % kAcross) + 1) * view.camera.width / (2 * kAcross),
              v = (2 * (k / kAcross) + 1) * view.camera.height / (2 * kAcross);
    const ViewSurface& surface =
        view.surfaces[static_cast<std::size_t>(v) * static_cast<std::size_t>(view.camera.width) +
                      static_cast<std::size_t>(u)];
    if (!surface.known) continue;
    ++all;
    // What was there in the view, as if it were there in the camera.
    const auto pixel = then.pixel(T_now_then * surface.position_m);
    inside += pixel && view.camera.inside(pixel->cast<double>()) ? 1 : 0;
  }
  return all > 0 ? static_cast<float>(inside) / static_cast<float>(all) : 0;
}

}  // namespace lumigraft::relight
