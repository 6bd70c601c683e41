#include "reconstruct/fusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "capture/radiance.h"
#include "reconstruct/fusion_view.h"

namespace lumigraft {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kNearestM = 0.05f;    // nothing is fused closer to the camera
constexpr float kBehindSteep = 2.5f;  // how far along a grazing ray, in truncation distances, a surface is solid
constexpr float kShellVoxels = 1.5f;  // colour, and solidity at a rim, reach this far from the surface
constexpr float kRimTrust = 0.25f;    // weight of a pixel next to a jump in depth

bool same_picture(const std::shared_ptr<const Picture>& a, const std::shared_ptr<const Picture>& b) {
  if (a == b) return true;
  return a && b && a->exposure == b->exposure && a->encoded.data == b->encoded.data &&
         a->radiance.data == b->radiance.data;
}

bool same_depth(const std::shared_ptr<const DepthPicture>& a, const std::shared_ptr<const DepthPicture>& b) {
  return a == b || (a && b && a->depth_m.data == b->depth_m.data);
}

/// What one measurement says about one voxel.
struct Reading {
  float distance_m = 0;
  float weight = 0;  ///< 0 = nothing
  float facing = 0;
  bool rim = false;
};

/// One frame as voxels see it.
struct Frame {
  const DepthView& view;
  const PixelMap& map;
  float truncation_m;
  float shell_m;

  Reading read(const Vector3f& in_camera, const Vector2f& pixel) const;
  Reading measure(const Vector3f& in_camera, float inverse_depth, const DepthView::Pixel& at) const;
};

Reading Frame::measure(const Vector3f& in_camera, float inverse_depth, const DepthView::Pixel& at) const {
  Reading reading;
  const float along = 1 / inverse_depth - in_camera.z();
  reading.distance_m = std::min(along * at.plane, truncation_m);
  if (reading.distance_m < -truncation_m || along < -kBehindSteep * truncation_m) return reading;
  reading.weight = at.weight;
  reading.facing = at.facing;
  return reading;
}

Reading Frame::read(const Vector3f& in_camera, const Vector2f& pixel) const {
  const int u = static_cast<int>(pixel.x()), v = static_cast<int>(pixel.y());
  const std::size_t i = view.index(u, v);
  const float s = pixel.x() - static_cast<float>(u), t = pixel.y() - static_cast<float>(v);
  const std::size_t nearest = i + (s > 0.5f ? 1 : 0) + (t > 0.5f ? view.width : 0);
  const float nearest_inverse = view.inverse_depth[nearest];
  // Hidden for certain: neighbouring pixels of one surface differ by 2 % of depth at the most.
  if (in_camera.z() * nearest_inverse > 1.02f + kBehindSteep * truncation_m * nearest_inverse) return {};
  const DepthView::Pixel& at = view.pixels[nearest];
  if (at.weight <= 0) return {};
  if (view.smooth[i]) {
    const float* q = &view.inverse_depth[i];
    const float inverse_depth =
        (1 - t) * ((1 - s) * q[0] + s * q[1]) + t * ((1 - s) * q[view.width] + s * q[view.width + 1]);
    Reading reading = measure(in_camera, inverse_depth, at);
    if (view.near_rim[nearest] && reading.distance_m < -shell_m) reading.weight = 0;
    return reading;
  }
  // Depth jumps between these four pixels: only the nearest is believed, and free space only where none of them sees a
  // surface there. Far behind the rim nothing is said, or every silhouette would grow a fin along the line of sight.
  Reading reading = measure(in_camera, nearest_inverse, at);
  reading.rim = true;
  reading.weight *= kRimTrust;
  if (reading.distance_m < -shell_m) reading.weight = 0;
  if (reading.distance_m >= truncation_m) {
    for (const std::size_t other : {i, i + 1, i + view.width, i + view.width + 1}) {
      const float inverse_depth = view.inverse_depth[other];
      if (inverse_depth > 0 && (1 / inverse_depth - in_camera.z()) * view.pixels[other].plane < truncation_m)
        reading.weight = 0;
    }
  }
  return reading;
}

/// Radiance at a sub-pixel place; false where any pixel it needs is clipped.
bool colour_at(const RadiancePicture& picture, const Vector2f& pixel, bool rim, Vector3f& colour) {
  const Image<float>& light = picture.radiance;
  const auto read = [&](int u, int v) { return Eigen::Map<const Vector3f>(&light.data[light.index(u, v)]); };
  if (rim) {
    const int u = static_cast<int>(pixel.x() + 0.5f), v = static_cast<int>(pixel.y() + 0.5f);
    if (picture.clipped.at(u, v)) return false;
    colour = read(u, v);
    return true;
  }
  const int u = static_cast<int>(pixel.x()), v = static_cast<int>(pixel.y());
  const auto& clipped = picture.clipped;
  if (clipped.at(u, v) || clipped.at(u + 1, v) || clipped.at(u, v + 1) || clipped.at(u + 1, v + 1)) return false;
  const float s = pixel.x() - static_cast<float>(u), t = pixel.y() - static_cast<float>(v);
  colour =
      (1 - t) * ((1 - s) * read(u, v) + s * read(u + 1, v)) + t * ((1 - s) * read(u, v + 1) + s * read(u + 1, v + 1));
  return true;
}

}  // namespace

struct FusionStage::State {
  State(const Session& session, const FusionSettings& settings)
      : camera(session.color.model),
        response(session.color.response),
        voxel_m(static_cast<float>(settings.voxel_m)),
        truncation_m(static_cast<float>(settings.voxel_m * settings.truncation_voxels)),
        weight_cap(static_cast<float>(settings.weight_cap)),
        map(session.color.model),
        preparation(session.color.model, settings.voxel_m, settings.far_m) {}

  std::vector<BrickKey> bricks_on_surfaces(const DepthView& view, const Isometry3f& T_tag_camera) const;
  std::vector<BrickKey> bricks_in_sight(const DepthView& view, const Isometry3f& T_camera_tag) const;
  std::shared_ptr<const FieldBrick> update(const BrickKey& key, const Frame& frame, const RadiancePicture* light,
                                           const Isometry3f& T_camera_tag) const;

  CameraModel camera;
  Response response;
  float voxel_m, truncation_m, weight_cap;
  PixelMap map;
  DepthPreparation preparation;

  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const DepthPicture> last_depth;
  std::shared_ptr<const Picture> last_color;
  Eigen::Isometry3d last_pose = Eigen::Isometry3d::Identity();
};

/// Bricks that any depth pixel's truncation band touches, in order, each once.
std::vector<BrickKey> FusionStage::State::bricks_on_surfaces(const DepthView& view,
                                                             const Isometry3f& T_tag_camera) const {
  std::vector<BrickKey> keys;
  // Most points fall into a brick seen a moment ago: a small table of recent keys keeps the list short.
  std::array<BrickKey, 4096> recent;
  recent.fill({INT32_MAX, 0, 0});
  const auto touch = [&](const BrickKey& key) {
    BrickKey& slot = recent[BrickKeyHash{}(key) % recent.size()];
    if (slot == key) return;
    slot = key;
    keys.push_back(key);
  };
  const auto brick_of = [](float voxel) {
    const float brick = voxel * (1.0f / kBrickEdge);
    const int toward_zero = static_cast<int>(brick);
    return toward_zero - (brick < static_cast<float>(toward_zero) ? 1 : 0);
  };
  const float focal = static_cast<float>(camera.fx);
  for (int v = 0; v < view.height; ++v)
    for (int u = 0; u < view.width; ++u) {
      const DepthView::Pixel& pixel = view.pixels[view.index(u, v)];
      if (pixel.weight <= 0) continue;
      // Pixels closer together on the surface than the three voxels each of them covers tell nothing new.
      const float inverse_depth = view.inverse_depth[view.index(u, v)];
      const float pixels_per_step = 3 * voxel_m * focal * inverse_depth * pixel.facing;
      const int stride = pixels_per_step >= 8 ? 8 : pixels_per_step >= 4 ? 4 : pixels_per_step >= 2 ? 2 : 1;
      if ((u | v) & (stride - 1)) continue;
      const Vector3f ray = T_tag_camera.linear() * preparation.ray(u, v).homogeneous();
      const float z = 1 / inverse_depth;
      const Vector3f origin = T_tag_camera.translation() / voxel_m;
      const Vector3f surface = origin + z / voxel_m * ray;
      // Every cell around the surface needs all its voxels.
      BrickKey low, high;
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = brick_of(surface[axis] - 1.5f);
        high[axis] = brick_of(surface[axis] + 1.5f);
      }
      for (int c = low[2]; c <= high[2]; ++c)
        for (int b = low[1]; b <= high[1]; ++b)
          for (int a = low[0]; a <= high[0]; ++a) touch({a, b, c});
      const float band = std::min(truncation_m / pixel.plane, kBehindSteep * truncation_m);
      const int steps = static_cast<int>(std::ceil(band / (4 * voxel_m)));
      for (int i = -steps; i <= steps; ++i) {
        const Vector3f p = origin + (z + band * static_cast<float>(i) / static_cast<float>(steps)) / voxel_m * ray;
        touch({brick_of(p.x()), brick_of(p.y()), brick_of(p.z())});
      }
    }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

/// Bricks of the field that the camera may see, free space in front of surfaces included, in order.
std::vector<BrickKey> FusionStage::State::bricks_in_sight(const DepthView& view, const Isometry3f& T_camera_tag) const {
  std::vector<BrickKey> keys;
  const float radius_m = voxel_m * 0.5f * std::sqrt(3.0f) * (kBrickEdge - 1);
  for (const auto& [key, brick] : field->bricks) {
    const Vector3f middle = Eigen::Map<const Eigen::Vector3i>(key.data()).cast<float>() * kBrickEdge +
                            Vector3f::Constant(0.5f * (kBrickEdge - 1));
    const Vector3f centre = T_camera_tag * (voxel_m * middle);
    const float nearest = centre.z() - radius_m;
    if (centre.z() + radius_m < kNearestM) continue;
    float furthest = 0;
    if (nearest > radius_m) {
      const Vector2f pixel = map.pixel(centre.x() / centre.z(), centre.y() / centre.z());
      const float reach = radius_m / nearest * static_cast<float>(std::max(camera.fx, camera.fy)) * 1.5f + 1;
      const int tile = DepthView::kTile;
      const int low_u = std::max(0, static_cast<int>(std::floor((pixel.x() - reach) / tile))),
                high_u = std::min(view.tile_far_m.width - 1, static_cast<int>(std::floor((pixel.x() + reach) / tile))),
                low_v = std::max(0, static_cast<int>(std::floor((pixel.y() - reach) / tile))),
                high_v = std::min(view.tile_far_m.height - 1, static_cast<int>(std::floor((pixel.y() + reach) / tile)));
      for (int y = low_v; y <= high_v; ++y)
        for (int x = low_u; x <= high_u; ++x) furthest = std::max(furthest, view.tile_far_m.at(x, y));
      if (nearest > furthest + kBehindSteep * truncation_m) continue;
    }
    keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

/// The brick with this frame in it; null where the frame says nothing about it. Bricks once published never change.
std::shared_ptr<const FieldBrick> FusionStage::State::update(const BrickKey& key, const Frame& frame,
                                                             const RadiancePicture* light,
                                                             const Isometry3f& T_camera_tag) const {
  std::shared_ptr<FieldBrick> brick;
  const auto begin = [&] {
    const FieldBrick* old = field->brick(key);
    brick = old ? std::make_shared<FieldBrick>(*old) : std::make_shared<FieldBrick>();
  };
  const Vector3f corner =
      T_camera_tag * (voxel_m * kBrickEdge * Eigen::Map<const Eigen::Vector3i>(key.data()).cast<float>());
  const Eigen::Matrix3f step = voxel_m * T_camera_tag.linear();
  const float last_u = static_cast<float>(frame.view.width - 1), last_v = static_cast<float>(frame.view.height - 1);
  for (int z = 0; z < kBrickEdge; ++z)
    for (int y = 0; y < kBrickEdge; ++y) {
      const Vector3f row = corner + static_cast<float>(y) * step.col(1) + static_cast<float>(z) * step.col(2);
      for (int x = 0; x < kBrickEdge; ++x) {
        const Vector3f p = row + static_cast<float>(x) * step.col(0);
        if (p.z() < kNearestM) continue;
        const float inverse_z = 1 / p.z();
        const Vector2f pixel = map.pixel(p.x() * inverse_z, p.y() * inverse_z);
        if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < last_u && pixel.y() < last_v)) continue;
        const Reading reading = frame.read(p, pixel);
        if (reading.weight <= 0) continue;

        if (!brick) begin();
        const int i = x + kBrickEdge * (y + kBrickEdge * z);
        float& weight = brick->weight[i];
        float& distance_m = brick->distance_m[i];
        distance_m = (distance_m * weight + reading.distance_m * reading.weight) / (weight + reading.weight);
        weight = std::min(weight + reading.weight, weight_cap);

        Vector3f colour;
        if (!light || std::abs(reading.distance_m) > frame.shell_m || !colour_at(*light, pixel, reading.rim, colour))
          continue;
        const float share = reading.facing * (reading.rim ? kRimTrust : 1);
        float& colour_weight = brick->radiance_weight[i];
        Vector3f& radiance = brick->radiance[i];
        radiance = (radiance * colour_weight + colour * share) / (colour_weight + share);
        colour_weight = std::min(colour_weight + share, weight_cap);
      }
    }
  return brick;
}

FusionStage::FusionStage(const Session& session, const FusionSettings& settings)
    : state_(std::make_unique<State>(session, settings)) {}

FusionStage::~FusionStage() = default;

std::shared_ptr<const DistanceField> FusionStage::fuse(const FrameSet& frame, const Pose& pose) {
  State& state = *state_;
  if (!frame.depth || pose.age_ns != 0) return state.field;
  if (frame.depth->depth_m.width != state.camera.width || frame.depth->depth_m.height != state.camera.height)
    return state.field;
  const bool same_pose = (pose.T_tag_camera.matrix() - state.last_pose.matrix()).cwiseAbs().maxCoeff() < 1e-5;
  if (state.field && same_pose && same_depth(frame.depth, state.last_depth) &&
      same_picture(frame.color, state.last_color))
    return state.field;

  const DepthView view = state.preparation.prepare(frame.depth->depth_m);
  const Isometry3f T_tag_camera = pose.T_tag_camera.cast<float>();
  const Isometry3f T_camera_tag = pose.T_tag_camera.inverse().cast<float>();
  RadiancePicture light;
  if (frame.color) light = to_radiance(*frame.color, state.response);
  const bool has_light = light.radiance.width == view.width && light.radiance.height == view.height;

  if (!state.field) {
    auto empty = std::make_shared<DistanceField>();
    empty->voxel_m = state.voxel_m;
    empty->truncation_m = state.truncation_m;
    state.field = empty;
  }
  std::vector<BrickKey> keys = state.bricks_on_surfaces(view, T_tag_camera);
  const std::vector<BrickKey> in_sight = state.bricks_in_sight(view, T_camera_tag);
  const auto middle = keys.insert(keys.end(), in_sight.begin(), in_sight.end());
  std::inplace_merge(keys.begin(), middle, keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

  const Frame seen{view, state.map, state.truncation_m, kShellVoxels * state.voxel_m};
  std::vector<std::pair<BrickKey, std::shared_ptr<const FieldBrick>>> changed;
  for (const BrickKey& key : keys)
    if (auto brick = state.update(key, seen, has_light ? &light : nullptr, T_camera_tag))
      changed.emplace_back(key, std::move(brick));

  if (!changed.empty()) {
    auto next = std::make_shared<DistanceField>(*state.field);
    next->version += 1;
    for (auto& [key, brick] : changed) next->bricks.insert_or_assign(key, std::move(brick));
    state.field = std::move(next);
  }
  state.last_depth = frame.depth;
  state.last_color = frame.color;
  state.last_pose = pose.T_tag_camera;
  return state.field;
}

void FusionStage::reset() {
  state_->field.reset();
  state_->last_depth.reset();
  state_->last_color.reset();
}

}  // namespace lumigraft
