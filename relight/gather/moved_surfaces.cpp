#include "relight/gather/moved_surfaces.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "relight/compose/depth_shell.h"
#include "relight/compose/parameters.h"
#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// What the fused room shows at a pixel.
struct FusedPixel {
  float depth_m = 0;  ///< along the ray; 0: nothing
  float cosine = 1;   ///< of the ray to the surface's normal
};

/// Edge of the square that fits into an area of moved surface, pixels; odd. Fusion displaces an edge by up to a voxel.
int min_width_px(float voxel_m, const CameraRays& eye, const std::vector<FusedPixel>& fused) {
  float near_m = std::numeric_limits<float>::max();
  for (const FusedPixel& p : fused) {
    if (p.depth_m > 0) near_m = std::min(near_m, p.depth_m);
  }
  const float px =
      voxel_m * static_cast<float>(eye.camera.model.fx) / std::max(near_m, static_cast<float>(kGather.min_nearest_m));
  return 2 * std::clamp(static_cast<int>(std::ceil(px)), 1, kCompose.moved_max_edge_px) + 1;
}

/// Whether depth is known and without a jump between neighbours in the square around a pixel, which is in the image.
bool smooth_around(const capture::Image<float>& depth_m, int u, int v, int reach) {
  const auto close = [](float a, float b) { return std::abs(a - b) < kCompose.moved_jump * std::min(a, b); };
  for (int y = v - reach; y <= v + reach; ++y) {
    for (int x = u - reach; x <= u + reach; ++x) {
      const float here = depth_m.at(x, y);
      if (!(here > 0) || (x < u + reach && !close(here, depth_m.at(x + 1, y))) ||
          (y < v + reach && !close(here, depth_m.at(x, y + 1))))
        return false;
    }
  }
  return true;
}

/// Whether the fused room has a surface at a pixel's depth in that square: its edge may be displaced.
bool fused_nearby(const CurrentDepth& depth, const std::vector<FusedPixel>& fused, int u, int v, int reach) {
  const int width = depth.along_z_m().width;
  for (int y = v - reach; y <= v + reach; ++y) {
    for (int x = u - reach; x <= u + reach; ++x) {
      const FusedPixel& p = fused[static_cast<std::size_t>(y * width + x)];
      if (p.depth_m > 0 && std::abs(p.depth_m - depth.at(u, v)) <= depth.allowed_m(p.depth_m, p.cosine)) return true;
    }
  }
  return false;
}

/// Keeps those connected areas of `differs` of which a part is certain: wider than fusion displaces edges, or wider
/// than a pixel, which may be noise, and no displaced edge. Not at the image's border, where fusion continues planes
/// that nothing was measured of.
void keep_certain(cv::Mat1b& differs, const CurrentDepth& depth, const std::vector<FusedPixel>& fused, int edge_px) {
  if (cv::countNonZero(differs) == 0) return;
  cv::Mat1b certain;
  cv::morphologyEx(differs, certain, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {edge_px, edge_px}));
  certain &= differs;
  const int reach = edge_px / 2;
  cv::Mat1b wide;
  cv::morphologyEx(differs, wide, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {2, 2}));
  for_each_pixel(differs.cols, differs.rows, kRows, [&](int u, int v) {
    const bool inside = std::min(u, v) >= reach && u + reach < differs.cols && v + reach < differs.rows;
    if (!inside || !wide(v, u) || certain(v, u)) return;
    if (smooth_around(depth.along_z_m(), u, v, reach) || !fused_nearby(depth, fused, u, v, reach)) certain(v, u) = 255;
  });
  if (cv::countNonZero(certain) == 0) {
    differs = std::uint8_t{0};
    return;
  }
  cv::Mat1i area;
  std::vector<std::uint8_t> keep(static_cast<std::size_t>(cv::connectedComponents(differs, area)), 0);
  for (int v = 0; v < differs.rows; ++v) {
    for (int u = 0; u < differs.cols; ++u) keep[static_cast<std::size_t>(area(v, u))] |= certain(v, u);
  }
  keep[0] = 0;  // what does not differ
  for (int v = 0; v < differs.rows; ++v) {
    for (int u = 0; u < differs.cols; ++u) differs(v, u) = keep[static_cast<std::size_t>(area(v, u))];
  }
}

/// Not 0 where depth differs from the fused room by more than noise, in areas wider than fusion displaces edges.
cv::Mat1b moved_mask(float voxel_m, const CameraRays& eye, const CurrentDepth& depth,
                     const std::vector<FusedPixel>& fused) {
  const int width = eye.camera.model.width, height = eye.camera.model.height;
  cv::Mat1b nearer(height, width, std::uint8_t{0}), farther(height, width, std::uint8_t{0});
  for_each_pixel(width, height, kRows, [&](int u, int v) {
    const float depth_m = depth.at(u, v);
    const FusedPixel& p = fused[static_cast<std::size_t>(v * width + u)];
    if (!(depth_m > 0)) return;
    const float off_m = p.depth_m > 0 ? depth_m - p.depth_m : -std::numeric_limits<float>::infinity();
    if (std::abs(off_m) <= depth.allowed_m(depth_m, p.cosine)) return;
    (off_m < 0 ? nearer : farther)(v, u) = 255;
  });
  const int edge = min_width_px(voxel_m, eye, fused);
  keep_certain(nearer, depth, fused, edge);
  keep_certain(farther, depth, fused, edge);
  return nearer | farther;
}

/// Adds pixels of what has arrived where depth does not differ from it.
void add_arrived(const CurrentDepth& depth, const std::vector<GBufferPixel>& seen, const ArrivedSurface& arrived,
                 cv::Mat1b& moved) {
  for_each_pixel(moved.cols, moved.rows, kRows, [&](int u, int v) {
    const GBufferPixel& p = seen[static_cast<std::size_t>(v * moved.cols + u)];
    if (moved(v, u) || !p.known || p.glossy || depth.differs(u, v, p.depth_m)) return;
    if (arrived.contains(p.surface.position_m, p.depth_m)) moved(v, u) = 255;
  });
}

/// The field's surfaces at pixels whose depth may differ from them; the others have their depth.
class FieldView {
 public:
  FieldView(const CameraRays& eye, const CurrentDepth& depth, const reconstruct::DistanceField& field)
      : eye_(eye), depth_(depth), field_(field) {}

  /// Whether depth may differ somewhere that matters, or shows there what has arrived.
  bool any_moved(const std::function<bool(const Vector3f&)>& may_matter, const ArrivedSurface& arrived) const {
    std::atomic<bool> any = false;
    const bool any_arrived = arrived.any();
    for_each_tile([&](int left, int top) {
      for_each_sample(left, top, [&](int u, int v) {
        if (any || !depth_.known(u, v) || !may_matter(point(u, v))) return;
        if (differs(u, v) || (any_arrived && arrived.contains(point(u, v), depth_.at(u, v)))) any = true;
      });
    });
    return any;
  }

  /// Calls `add(left, top)` for squares of window_px, of whose pixels some may have moved.
  template <typename Add>
  void moved_squares(const ArrivedSurface& arrived, Add add) const {
    const bool any_arrived = arrived.any();
    for_each_tile([&](int left, int top) {
      bool some = false;
      for_each_sample(left, top, [&](int u, int v) {
        some = some || differs(u, v) ||
               (any_arrived && depth_.known(u, v) && arrived.contains(point(u, v), depth_.at(u, v)));
      });
      if (some) add(left, top);
    });
  }

  std::vector<FusedPixel> pixels() const {
    const capture::CameraModel& camera = eye_.camera.model;
    std::vector<FusedPixel> fused(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    for_each_tile([&](int left, int top) {
      bool differ = false;
      for_each_sample(left, top, [&](int u, int v) { differ = differ || differs(u, v); });
      for (int v = top; v < std::min(top + kGather.window_px, camera.height); ++v) {
        for (int u = left; u < std::min(left + kGather.window_px, camera.width); ++u) {
          fused[static_cast<std::size_t>(v * camera.width + u)] = differ ? seen(u, v) : FusedPixel{depth_.at(u, v)};
        }
      }
    });
    return fused;
  }

 private:
  template <typename Do>
  void for_each_tile(Do act) const {
    const capture::CameraModel& camera = eye_.camera.model;
    const int edge = kGather.window_px;
    for_each_pixel((camera.width - 1) / edge + 1, (camera.height - 1) / edge + 1, 1,
                   [&](int x, int y) { act(x * edge, y * edge); });
  }
  /// Beyond the square on all sides, too: surface that ends there may continue in it.
  template <typename Do>
  void for_each_sample(int left, int top, Do act) const {
    const int step = kGather.moved_sample_px;
    for (int v = top - step / 2; v < top + kGather.window_px + step; v += step) {
      for (int u = left - step / 2; u < left + kGather.window_px + step; u += step) {
        if (u >= 0 && v >= 0 && u < eye_.camera.model.width && v < eye_.camera.model.height) act(u, v);
      }
    }
  }
  Vector3f point(int u, int v) const { return eye_.camera.T_tag_camera * (depth_.at(u, v) * eye_.rays.at(u, v)); }
  bool differs(int u, int v) const {
    if (!depth_.known(u, v)) return false;
    if (depth_.at(u, v) > kGather.moved_far_m) return true;
    const auto sample = field_.sample(point(u, v));
    return !sample || std::abs(sample->distance_m) > depth_.allowed_m(depth_.at(u, v));
  }
  FusedPixel seen(int u, int v) const {
    if (depth_.known(u, v) && !differs(u, v)) return {depth_.at(u, v)};
    const Vector3f w = eye_.ray(u, v);
    const auto hit = field_.raycast(eye_.camera.T_tag_camera.translation(), w, 0, kGather.moved_far_m);
    return hit ? FusedPixel{hit->distance_m, -hit->normal.dot(w)} : FusedPixel{};
  }

  const CameraRays& eye_;
  const CurrentDepth& depth_;
  const reconstruct::DistanceField& field_;
};

class Moved {
 public:
  Moved(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps, const CameraRays& eye,
        const CurrentDepth& depth, const CameraUpload& picture)
      : light_(light), lamps_(lamps), eye_(eye), depth_(depth), depth_m_(depth.along_z_m()), picture_(picture) {}

  /// `fused`: the room's there, which is of the same surface if depth is unknown.
  GBufferPixel pixel(int u, int v, const GBufferPixel& fused) const {
    GBufferPixel p;
    p.known = true;
    p.w = fused.w;
    p.depth_m = depth_.known(u, v) ? depth_.at(u, v) : fused.depth_m;
    p.surface.position_m = depth_.known(u, v) ? point(u, v) : fused.surface.position_m;
    p.surface.normal = p.surface.face = depth_.known(u, v) ? normal(u, v, p.w) : fused.surface.normal;
    p.albedo = p.surface.bsdf.diffuse = albedo(p.surface, picture_.radiance(depth_m_.index(u, v)));
    return p;
  }

 private:
  Vector3f point(int u, int v) const { return eye_.camera.T_tag_camera * (depth_.at(u, v) * eye_.rays.at(u, v)); }

  /// Of the plane nearest to the same surface around the pixel: its inverse depth is linear in the image.
  Vector3f normal(int u, int v, const Vector3f& w) const {
    constexpr int kReach = kGather.moved_normal_px;
    const float centre_m = depth_m_.at(u, v);
    Eigen::Matrix3f moments = Eigen::Matrix3f::Zero();
    Vector3f sums = Vector3f::Zero();
    for (int y = std::max(v - kReach, 0); y <= std::min(v + kReach, depth_m_.height - 1); ++y) {
      for (int x = std::max(u - kReach, 0); x <= std::min(u + kReach, depth_m_.width - 1); ++x) {
        const float z = depth_m_.at(x, y);
        const auto steps = static_cast<float>(std::max({std::abs(x - u), std::abs(y - v), 1}));
        if (!(z > 0) || std::abs(z - centre_m) > steps * kCompose.moved_jump * centre_m) continue;
        const Vector3f at(1, static_cast<float>(x - u), static_cast<float>(y - v));
        moments += at * at.transpose();
        sums += at / z;
      }
    }
    const Eigen::LDLT<Eigen::Matrix3f> solver(moments);
    if (!(solver.vectorD().minCoeff() > 0.5f)) return -w;  // pixels along a line
    Eigen::Matrix3f rays;                                  // of unit z, and their derivatives
    const auto ray = [&](float du, float dv) -> Vector3f {
      const Vector3f r = eye_.rays.at(u, v, {0.5f + du, 0.5f + dv});
      return r / r.z();
    };
    rays << ray(0, 0).transpose(), (ray(0.5f, 0) - ray(-0.5f, 0)).transpose(),
        (ray(0, 0.5f) - ray(0, -0.5f)).transpose();
    const Vector3f n = (eye_.camera.T_tag_camera.linear() * rays.inverse() * solver.solve(sums)).stableNormalized();
    if (!n.allFinite()) return -w;
    return n.dot(w) > 0 ? (-n).eval() : n;
  }

  Rgb albedo(const SurfaceHit& surface, const Rgb& radiance) const {
    const Rgb irradiance = unoccluded_irradiance(light_, lamps_, surface);
    return (kPi * radiance / irradiance.max(std::numeric_limits<float>::min())).min(1.0f).max(0.0f);
  }

  const reconstruct::Illumination& light_;
  const std::vector<LightSampleSet>& lamps_;
  const CameraRays& eye_;
  const CurrentDepth& depth_;
  const capture::Image<float>& depth_m_;
  const CameraUpload& picture_;
};

}  // namespace

MovedPixels moved_surfaces(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps,
                           float voxel_m, const CameraRays& eye, const CurrentDepth& depth, const CameraUpload& picture,
                           const std::vector<GBufferPixel>& seen, const ArrivedSurface* arrived) {
  const int width = eye.camera.model.width, height = eye.camera.model.height;
  std::vector<FusedPixel> fused(seen.size());
  for_each_pixel(width, height, kRows, [&](int u, int v) {
    const auto i = static_cast<std::size_t>(v * width + u);
    if (seen[i].known) {
      fused[i] = {seen[i].depth_m, -seen[i].surface.normal.dot(seen[i].w)};
    } else if (seen[i].w.isZero(0)) {
      fused[i].depth_m = depth.at(u, v);
    }
  });
  cv::Mat1b moved = moved_mask(voxel_m, eye, depth, fused);
  if (arrived && arrived->any()) add_arrived(depth, seen, *arrived, moved);
  const Moved surfaces(light, lamps, eye, depth, picture);
  MovedPixels found;
  for (int i = 0; i < width * height; ++i) {
    if (moved(i / width, i % width)) found.emplace_back(i, GBufferPixel{});
  }
  for_each_index(found.size(), kRows * width, [&](std::size_t k) {
    const auto i = static_cast<int>(found[k].first);
    found[k].second = surfaces.pixel(i % width, i / width, seen[found[k].first]);
  });
  return found;
}

capture::Image<std::uint8_t> front_mask(const MovedPixels& covered, const RoomPixels& room, const CurrentDepth& depth,
                                        int width, int height) {
  capture::Image<std::uint8_t> front(width, height, 1);
  for (const auto& [i, behind] : covered) {
    const GBufferPixel& now = room.seen[i];
    // Of the pixels of a square at an outline, some show the other surface.
    const float shown_m = behind.depth_m > now.depth_m ? now.depth_m : behind.depth_m;
    const int left = static_cast<int>(i) % room.camera.width * room.scale,
              top = static_cast<int>(i) / room.camera.width * room.scale;
    for (int v = top; v < std::min(top + room.scale, height); ++v) {
      for (int u = left; u < std::min(left + room.scale, width); ++u) {
        if (!behind.known || !depth.differs(u, v, shown_m)) front.at(u, v) = 255;
      }
    }
  }
  return front;
}

void add_moved_tiles(const CameraRays& eye, const CurrentDepth& depth, const reconstruct::DistanceField& field,
                     const ArrivedSurface& arrived, TileMask& tiles) {
  static_assert(kGather.window_px % TileMask::kEdge == 0);
  constexpr int kAcross = kGather.window_px / TileMask::kEdge;
  if (!depth.any()) return;
  FieldView(eye, depth, field).moved_squares(arrived, [&](int left, int top) {
    const int x = left / TileMask::kEdge, y = top / TileMask::kEdge;
    for (int k = 0; k < kAcross * kAcross; ++k) {
      if (x + k % kAcross < tiles.across() && y + k / kAcross < tiles.down())
        tiles.set(x + k % kAcross, y + k / kAcross);
    }
  });
}

/// In the rectangle that contains what moved, of all surfaces, since fusion may hold parts of what moved already.
std::shared_ptr<const Model> moved_shell(const CameraRays& eye, const CurrentDepth& depth, const MovedPixels& moved,
                                         const MovedPixels& fused, const Meshes& objects, bool colored) {
  const int width = eye.camera.model.width, height = eye.camera.model.height;
  cv::Rect part;
  capture::Image<float> behind_m(width, height, 1), color;
  if (colored) color = capture::Image<float>(width, height, 3);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const GBufferPixel &now = moved[i].second, &before = fused[i].second;
    const auto pixel = static_cast<int>(moved[i].first);
    part |= cv::Rect(pixel % width - 1, pixel / width - 1, 3, 3);
    if (colored) set_at(color, moved[i].first, now.albedo);
    float& end_m = behind_m.data[moved[i].first];
    const bool same = !depth.differs(pixel % width, pixel / width, before.depth_m);  // what has arrived
    end_m = before.known && !same ? before.depth_m : std::numeric_limits<float>::infinity();
    if (end_m < now.depth_m) {
      end_m = 0;
    } else if (const auto object = objects.hit(eye.camera.T_tag_camera.translation(), now.w, end_m)) {
      end_m = object->t_m;
    }
  }
  part &= cv::Rect(0, 0, width, height);
  return depth_shell(eye.rays, eye.camera.T_tag_camera, depth, part, behind_m, colored ? &color : nullptr,
                     kGather.moved_vertices);
}

MovedInField moved_in_field(const CameraRays& eye, const CurrentDepth& depth, const reconstruct::DistanceField& field,
                            const ArrivedSurface& arrived,
                            const std::function<bool(const Eigen::Vector3f&)>& may_matter,
                            const std::function<const Meshes&()>& objects) {
  const FieldView view(eye, depth, field);
  if (!depth.any() || !view.any_moved(may_matter, arrived)) return {};
  const std::vector<FusedPixel> fused = view.pixels();
  cv::Mat1b moved = moved_mask(field.voxel_m, eye, depth, fused);
  const Vector3f eye_m = eye.camera.T_tag_camera.translation();
  const auto pixel_at = [&](int u, int v, float depth_m) {
    GBufferPixel pixel;
    pixel.w = eye.ray(u, v);
    pixel.known = depth_m > 0;
    pixel.depth_m = depth_m;
    pixel.surface.position_m = eye_m + depth_m * pixel.w;
    return pixel;
  };
  if (arrived.any()) {
    for_each_pixel(moved.cols, moved.rows, kRows, [&](int u, int v) {
      const FusedPixel& p = fused[static_cast<std::size_t>(v * moved.cols + u)];
      if (moved(v, u) || !(p.depth_m > 0) || depth.differs(u, v, p.depth_m)) return;
      if (arrived.contains(eye_m + p.depth_m * eye.ray(u, v), p.depth_m)) moved(v, u) = 255;
    });
  }
  MovedInField found;
  bool matters = false;
  for (int v = 0; v < moved.rows; ++v) {
    for (int u = 0; u < moved.cols; ++u) {
      if (!moved(v, u)) continue;
      const auto i = static_cast<std::size_t>(v * moved.cols + u);
      found.fused.emplace_back(i, pixel_at(u, v, fused[i].depth_m));
      found.now.emplace_back(i, pixel_at(u, v, depth.known(u, v) ? depth.at(u, v) : fused[i].depth_m));
      matters = matters || may_matter(found.now.back().second.surface.position_m);
    }
  }
  if (!matters) return {};
  found.shell = moved_shell(eye, depth, found.now, found.fused, objects(), false);
  return found;
}

}  // namespace lumigraft::relight
