#include "relight/compose/motion_blur.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "relight/compose/parameters.h"
#include "relight/compose/rgb_image.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;

/// What a pixel of the layer shows at a position between pixels; nothing beyond the window.
struct Sample {
  Rgb radiance = Rgb::Zero();
  float coverage = 0, distance_m = 0;  ///< the largest around
};

Sample sample_at(const ObjectLayer& objects, const Vector2f& at) {
  const auto left = static_cast<int>(std::floor(at.x())), top = static_cast<int>(std::floor(at.y()));
  const float right = at.x() - static_cast<float>(left), below = at.y() - static_cast<float>(top);
  Sample sum;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const auto pixel = objects.index(left + i, top + j);
      const float weight = (i ? right : 1 - right) * (j ? below : 1 - below);
      if (!pixel || weight == 0) continue;
      sum.radiance += weight * radiance_at(objects.radiance, *pixel);
      sum.coverage += weight * objects.coverage.data[*pixel];
      sum.distance_m = std::max(sum.distance_m, objects.distance_m.data[*pixel]);
    }
  }
  return sum;
}

/// Of every pixel of the window `grown`, that of the nearest pixel of the layer with an object.
class NearestShift {
 public:
  /// `part`: of the layer, with all of its objects.
  NearestShift(const ObjectLayer& objects, const capture::Image<float>& shift_px, const cv::Rect& part,
               const cv::Rect& grown)
      : shift_px_(shift_px) {
    const cv::Point to_grown = cv::Point(objects.left, objects.top) - grown.tl();
    cv::Mat1b none(grown.size(), std::uint8_t{255});
    for (int y = part.y; y < part.y + part.height; ++y) {
      for (int x = part.x; x < part.x + part.width; ++x) {
        if (objects.distance_m.at(x, y) > 0) none(cv::Point(x, y) + to_grown) = 0;
      }
    }
    cv::Mat1f distance;
    cv::distanceTransform(none, distance, nearest_, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
    pixels_.resize(static_cast<std::size_t>(cv::countNonZero(none == 0)) + 1);
    for (int y = part.y; y < part.y + part.height; ++y) {
      for (int x = part.x; x < part.x + part.width; ++x) {
        const cv::Point at = cv::Point(x, y) + to_grown;
        if (none(at) == 0) pixels_[static_cast<std::size_t>(nearest_(at))] = {x, y};
      }
    }
  }
  Vector2f at(int x, int y) const {
    const cv::Point& from = pixels_[static_cast<std::size_t>(nearest_(y, x))];
    return {shift_px_.at(from.x, from.y, 0), shift_px_.at(from.x, from.y, 1)};
  }

 private:
  const capture::Image<float>& shift_px_;
  cv::Mat1i nearest_;              ///< label of a pixel with an object
  std::vector<cv::Point> pixels_;  ///< by label, in the layer's window
};

/// Half of the longest shift to each side, whole pixels.
cv::Size margin_of(const capture::Image<float>& shift_px) {
  float across = 0, down = 0;
  for (std::size_t i = 0; i < shift_px.data.size(); i += 2) {
    across = std::max(across, std::abs(shift_px.data[i]));
    down = std::max(down, std::abs(shift_px.data[i + 1]));
  }
  return {static_cast<int>(std::ceil(across / 2)), static_cast<int>(std::ceil(down / 2))};
}

}  // namespace

std::optional<Vector2f> ObjectMotion::shift_px(const PosedCamera& camera, const Eigen::Vector3f& at_m) const {
  const Eigen::Isometry3f T_camera_tag = camera.T_tag_camera.inverse();
  const auto from = camera.model.project((T_camera_tag * (to_begin * at_m)).cast<double>()),
             to = camera.model.project((T_camera_tag * (to_end * at_m)).cast<double>());
  if (!from || !to) return std::nullopt;
  const Vector2f shift = (*to - *from).cast<float>();
  return shift * std::min(1.0f, kCompose.max_motion_px / std::max(shift.norm(), 1.0f));
}

std::vector<ObjectMotion> motions_over(const Exhibit& exhibit, double time_s, double exposure_s) {
  std::vector<ObjectMotion> motions;
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.drawn(time_s)) continue;
    ObjectMotion& motion = motions.emplace_back();
    if (object.motion.size() < 2) continue;
    const Eigen::Affine3d T_model_tag = object.T_tag_model(time_s).inverse();
    motion.to_begin = (object.T_tag_model(time_s - exposure_s / 2) * T_model_tag).cast<float>();
    motion.to_end = (object.T_tag_model(time_s + exposure_s / 2) * T_model_tag).cast<float>();
    motion.any = !motion.to_begin.isApprox(motion.to_end);
  }
  return motions;
}

// The gathering filter of McGuire et al. 2012 for one moving layer: objects that pass each other are blurred as one.
ObjectLayer motion_blurred(const ObjectLayer& objects, const capture::Image<float>& shift_px, int width, int height) {
  const cv::Size margin = margin_of(shift_px);
  const cv::Mat1f distance_m(objects.distance_m.height, objects.distance_m.width,
                             const_cast<float*>(objects.distance_m.data.data()));
  const cv::Rect part = cv::boundingRect(cv::Mat1b(distance_m > 0));
  if (part.empty() || margin == cv::Size(0, 0)) return objects;
  const cv::Rect window = cv::Rect(objects.left + part.x - margin.width, objects.top + part.y - margin.height,
                                   part.width + 2 * margin.width, part.height + 2 * margin.height) &
                          cv::Rect(0, 0, width, height);
  const NearestShift shifts(objects, shift_px, part, window);
  const capture::Image<float> empty(window.width, window.height, 1);
  ObjectLayer blurred{window.x, window.y, capture::Image<float>(window.width, window.height, 3), empty, empty};
  for_each_pixel(window.width, window.height, kRows, [&](int x, int y) {
    const Vector2f at(static_cast<float>(x + window.x), static_cast<float>(y + window.y)), shift = shifts.at(x, y);
    const int samples = 1 + static_cast<int>(std::ceil(kCompose.motion_samples_per_px * shift.norm()));
    Sample sum;
    for (int k = 0; k < samples; ++k) {
      const float along = (static_cast<float>(k) + 0.5f) / static_cast<float>(samples) - 0.5f;
      const Sample there = sample_at(objects, at - along * shift);
      sum.radiance += there.radiance;
      sum.coverage += there.coverage;
      sum.distance_m = std::max(sum.distance_m, there.distance_m);
    }
    const std::size_t i = blurred.coverage.index(x, y);
    set_at(blurred.radiance, i, sum.radiance / static_cast<float>(samples));
    blurred.coverage.data[i] = sum.coverage / static_cast<float>(samples);
    const auto own = objects.index(x + window.x, y + window.y);
    const float own_m = own ? objects.distance_m.data[*own] : 0;
    blurred.distance_m.data[i] = own_m > 0 ? own_m : sum.distance_m;
  });
  return blurred;
}

ObjectLayer MotionBlur::of(const ObjectLayer& objects) const {
  if (!any() || objects.distance_m.empty()) return objects;
  const capture::CameraModel& camera = view_->camera.model;
  return motion_blurred(objects, shift_px(objects), camera.width, camera.height);
}

capture::Image<float> MotionBlur::shift_px(const ObjectLayer& objects) const {
  capture::Image<float> shift(objects.coverage.width, objects.coverage.height, 2);
  const Eigen::Isometry3f& T_tag_camera = view_->camera.T_tag_camera;
  const auto within = [&](std::size_t k, const Eigen::Vector3f& at_m) {
    const Eigen::Vector4f& sphere = view_->spheres[k];
    return (at_m - sphere.head<3>()).norm() / sphere.w();  // 1 on its surface
  };
  // Of what lies in spheres of several objects a ray decides, in a second pass: the tree is not always needed.
  constexpr float kNear = 1.05f;  // of blurred outlines and flattened objects
  const auto of_object = [&](std::size_t i, std::size_t k, const Eigen::Vector3f& at_m) {
    if (!motions_[k].any) return;
    if (const auto by_px = motions_[k].shift_px(view_->camera, at_m)) std::copy_n(by_px->data(), 2, &shift.data[2 * i]);
  };
  const auto ray_at = [&](std::size_t i) {
    const auto x = static_cast<int>(i) % shift.width, y = static_cast<int>(i) / shift.width;
    return Eigen::Vector3f(T_tag_camera.linear() * view_->rays.at(x + objects.left, y + objects.top));
  };
  std::vector<std::uint8_t> decided(objects.coverage.data.size(), 1);
  for_each_index(decided.size(), kRows * std::max(shift.width, 1), [&](std::size_t i) {
    const float distance_m = objects.distance_m.data[i];
    if (!(distance_m > 0)) return;
    const Eigen::Vector3f at_m = T_tag_camera.translation() + distance_m * ray_at(i);
    std::size_t nearest = 0, around = 0;
    for (std::size_t k = 0; k < motions_.size(); ++k) {
      if (within(k, at_m) < within(nearest, at_m)) nearest = k;
      if (within(k, at_m) < kNear) ++around;
    }
    if (around > 1) {
      decided[i] = 0;
    } else {
      of_object(i, nearest, at_m);
    }
  });
  if (std::ranges::find(decided, 0) == decided.end()) return shift;
  const Meshes& meshes = view_->meshes();
  for_each_index(decided.size(), kRows * std::max(shift.width, 1), [&](std::size_t i) {
    if (decided[i]) return;
    const Eigen::Vector3f w = ray_at(i), eye_m = T_tag_camera.translation();
    if (const auto hit = meshes.hit(eye_m, w, std::numeric_limits<float>::infinity()))
      of_object(i, hit->mesh, eye_m + hit->t_m * w);
  });
  return shift;
}

std::vector<ObjectMotion> motions_while_exposed(const capture::ColorCamera& camera, const Exhibit& exhibit,
                                                std::int64_t time_ns) {
  if (!camera.settings.exposure_us) return {};
  std::vector<ObjectMotion> found =
      motions_over(exhibit, 1e-9 * static_cast<double>(time_ns), 1e-6 * *camera.settings.exposure_us);
  if (std::ranges::none_of(found, &ObjectMotion::any)) found.clear();
  return found;
}

}  // namespace lumigraft::relight
