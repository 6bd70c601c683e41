#include "reconstruct/fusion.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "reconstruct/fusion_brick.h"
#include "reconstruct/fusion_colour.h"
#include "reconstruct/fusion_reading.h"
#include "reconstruct/fusion_sight.h"
#include "reconstruct/fusion_view.h"

namespace lumigraft {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector2f;
using Eigen::Vector3f;
using Row = Eigen::Array<float, kBrickEdge, 1>;

constexpr float kNearestM = 0.05f;    // nothing is fused closer to the camera
constexpr float kShellVoxels = 1.5f;  // colour, and solidity at a rim, reach this far from the surface
/// A brick that many pictures have told about learns little from one more. From kSettled on it looks at every second,
/// and at half as many whenever it has seen twice as many, down to one in kLongestRest; but at every one for a while
/// after a picture showed so many voxels far from where they were.
constexpr std::uint32_t kSettled = 12, kLongestRest = 8, kLivelyLooks = 8;
constexpr int kLivelyVoxels = 24;
/// While the camera has moved less than this since all surfaces were looked through for new bricks, a share of them is.
constexpr float kSteadyM = 0.01f, kSteadyRad = 0.01f;
constexpr int kShares = 4;
constexpr std::uint32_t kWait = 8;  ///< pictures, that slight changes are held back to be published together
constexpr float kPlaceM = 0.25f;    // apart, as places from where the camera looked
constexpr std::size_t kMostPlaces = 64;

bool same_picture(const std::shared_ptr<const Picture>& a, const std::shared_ptr<const Picture>& b) {
  if (a == b) return true;
  return a && b && a->exposure == b->exposure && a->encoded.data == b->encoded.data &&
         a->radiance.data == b->radiance.data;
}

bool same_depth(const std::shared_ptr<const DepthPicture>& a, const std::shared_ptr<const DepthPicture>& b) {
  return a == b || (a && b && a->depth_m.data == b->depth_m.data);
}

/// Running mean; the past counts for `cap` at most.
template <typename Value>
void average(Value& mean, float& weight, const Value& value, float share, float cap) {
  mean += (share / (weight + share)) * (value - mean);
  weight = std::min(weight + share, cap);
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

  void look_from(const Vector3f& camera_m);
  void allocate(const Isometry3f& T_tag_camera);
  bool rests(const WorkingBrick& brick, std::size_t place) const;
  bool update(WorkingBrick& brick, float hidden_m, const DepthReader& depth, const ColourReader& colour,
              const Isometry3f& T_camera_tag) const;
  bool clear(WorkingBrick& brick, const Isometry3f& T_camera_tag) const;
  void publish();

  CameraModel camera;
  Response response;
  float voxel_m, truncation_m, weight_cap;
  PixelMap map;
  DepthPreparation preparation;
  DepthView view;

  std::uint32_t pictures = 0, last_publication = 0;
  Isometry3f searched_from = Isometry3f::Identity();  ///< camera when all surfaces were last looked through
  std::vector<WorkingBrick*> waiting;                 ///< to be published
  bool plain = false;                                 ///< one of them at once
  std::vector<std::unique_ptr<WorkingBrick>> bricks;  ///< in the order in which they came
  std::unordered_map<BrickKey, std::size_t, BrickKeyHash> places;
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const DepthPicture> last_depth;
  std::shared_ptr<const Picture> last_color;
  std::vector<Vector3f> seen_from_m;  ///< the one that was left longest ago first
  Eigen::Isometry3d last_pose = Eigen::Isometry3d::Identity();
};

/// Remembers the place. While the camera moves on, places of wrong poses are forgotten in time.
void FusionStage::State::look_from(const Vector3f& camera_m) {
  const auto place = std::find_if(seen_from_m.begin(), seen_from_m.end(),
                                  [&](const Vector3f& p) { return (p - camera_m).norm() < kPlaceM; });
  if (place != seen_from_m.end()) {
    std::rotate(place, place + 1, seen_from_m.end());
    return;
  }
  if (seen_from_m.size() == kMostPlaces) seen_from_m.erase(seen_from_m.begin());
  seen_from_m.push_back(camera_m);
}

void FusionStage::State::allocate(const Isometry3f& T_tag_camera) {
  const bool moved = pictures == 0 || (T_tag_camera.translation() - searched_from.translation()).norm() > kSteadyM ||
                     Eigen::AngleAxisf(searched_from.linear().transpose() * T_tag_camera.linear()).angle() > kSteadyRad;
  if (moved) searched_from = T_tag_camera;
  const int shares = moved ? 1 : kShares;
  for (const BrickKey& key : bricks_on_surfaces(view, preparation, T_tag_camera, voxel_m, truncation_m,
                                                {shares, static_cast<int>(pictures) % shares})) {
    if (places.contains(key)) continue;
    places.emplace(key, bricks.size());
    bricks.push_back(std::make_unique<WorkingBrick>());
    bricks.back()->key = key;
  }
}

bool FusionStage::State::rests(const WorkingBrick& brick, std::size_t place) const {
  if (brick.looks < brick.lively_until) return false;
  std::uint32_t rest = 1;
  while (rest < kLongestRest && brick.looks >= kSettled * rest) rest *= 2;
  return (pictures + place) % rest != 0;
}

/// Free space in front of everything. False where that was known.
bool FusionStage::State::clear(WorkingBrick& brick, const Isometry3f& T_camera_tag) const {
  if (brick.open) return false;
  const Vector3f centre =
      T_camera_tag * (voxel_m * (Eigen::Map<const Eigen::Vector3i>(brick.key.data()).cast<float>() * kBrickEdge +
                                 Vector3f::Constant(0.5f * (kBrickEdge - 1))));
  const Vector2f pixel = map.pixel(centre.x() / centre.z(), centre.y() / centre.z());
  const float weight = view.block_of(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())).weight;
  if (weight <= 0) return false;
  float least = truncation_m;
  for (int i = 0; i < kBrickVoxels; ++i) {
    average(brick.now.distance_m[i], brick.now.weight[i], truncation_m, weight, weight_cap);
    least = std::min(least, brick.now.distance_m[i]);
  }
  brick.open = least > 0.99f * truncation_m;
  return true;
}

/// False where the frame says nothing about the brick.
bool FusionStage::State::update(WorkingBrick& brick, float hidden_m, const DepthReader& depth,
                                const ColourReader& colour, const Isometry3f& T_camera_tag) const {
  const Vector3f corner =
      T_camera_tag * (voxel_m * kBrickEdge * Eigen::Map<const Eigen::Vector3i>(brick.key.data()).cast<float>());
  const Eigen::Matrix3f step = voxel_m * T_camera_tag.linear();
  const Row along = Row::LinSpaced(kBrickEdge, 0, kBrickEdge - 1);
  const float shell_m = kShellVoxels * voxel_m;
  bool told = false;
  int moved = 0;
  for (int z = 0; z < kBrickEdge; ++z)
    for (int y = 0; y < kBrickEdge; ++y) {
      const Vector3f row = corner + static_cast<float>(y) * step.col(1) + static_cast<float>(z) * step.col(2);
      if (std::min(row.z(), row.z() + kBrickEdge * step(2, 0)) > hidden_m) continue;
      const Row px = row.x() + along * step(0, 0), py = row.y() + along * step(1, 0), pz = row.z() + along * step(2, 0);
      const Row inverse_z = 1 / pz, x_over_z = px * inverse_z, y_over_z = py * inverse_z;
      for (int x = 0; x < kBrickEdge; ++x) {
        if (pz[x] < kNearestM) continue;
        const Vector2f pixel = map.pixel(x_over_z[x], y_over_z[x]);
        const Reading reading = depth.read({px[x], py[x], pz[x]}, pixel);
        if (reading.weight <= 0) continue;
        told = true;
        const int i = x + kBrickEdge * (y + kBrickEdge * z);
        moved += std::abs(brick.now.distance_m[i] - reading.distance_m) > truncation_m && brick.now.weight[i] > 0;
        average(brick.now.distance_m[i], brick.now.weight[i], reading.distance_m, reading.weight, weight_cap);

        if (std::abs(reading.distance_m) > shell_m || !colour || !reading.in_sight) continue;
        Vector3f radiance;
        if (colour.read(pixel, reading.edge, radiance))
          average(brick.now.radiance[i], brick.now.radiance_weight[i], radiance,
                  reading.facing * (reading.edge ? kEdgeTrust : 1), weight_cap);
      }
    }
  if (!told) return false;
  brick.open = false;
  if (moved > kLivelyVoxels) brick.lively_until = brick.looks + kLivelyLooks;
  return true;
}

void FusionStage::State::publish() {
  if (waiting.empty() || (!plain && pictures - last_publication < kWait)) return;
  auto next = std::make_shared<DistanceField>(*field);
  next->version += 1;
  next->seen_from_m = seen_from_m;
  for (WorkingBrick* brick : waiting) {
    brick->waiting = false;
    brick->published = std::make_shared<FieldBrick>(brick->now);
    next->bricks.insert_or_assign(brick->key, brick->published);
  }
  waiting.clear();
  plain = false;
  last_publication = pictures;
  field = std::move(next);
}

FusionStage::FusionStage(const Session& session, const FusionSettings& settings)
    : state_(std::make_unique<State>(session, settings)) {}

FusionStage::~FusionStage() = default;

std::shared_ptr<const DistanceField> FusionStage::fuse(const FrameSet& frame, const Pose& pose) {
  State& s = *state_;
  if (!frame.depth || pose.age_ns != 0) return s.field;
  if (frame.depth->depth_m.width != s.camera.width || frame.depth->depth_m.height != s.camera.height) return s.field;
  const bool same_pose = (pose.T_tag_camera.matrix() - s.last_pose.matrix()).cwiseAbs().maxCoeff() < 1e-5;
  if (s.field && same_pose && same_depth(frame.depth, s.last_depth) && same_picture(frame.color, s.last_color))
    return s.field;
  if (!s.field) {
    auto empty = std::make_shared<DistanceField>();
    empty->voxel_m = s.voxel_m;
    empty->truncation_m = s.truncation_m;
    s.field = empty;
  }

  s.preparation.prepare(frame.depth->depth_m, s.view);
  const Isometry3f T_camera_tag = pose.T_tag_camera.inverse().cast<float>();
  s.look_from(pose.T_tag_camera.translation().cast<float>());
  s.allocate(pose.T_tag_camera.cast<float>());
  const ColourReader colour(frame.color.get(), s.response, s.camera.width, s.camera.height);
  const DepthReader depth(s.view, s.preparation, s.map, s.voxel_m, s.truncation_m, kShellVoxels * s.voxel_m);
  const float focal = static_cast<float>(std::max(s.camera.fx, s.camera.fy));
  for (std::size_t place = 0; place < s.bricks.size(); ++place) {
    WorkingBrick& brick = *s.bricks[place];
    if (s.rests(brick, place)) continue;
    const Sight sight = sight_of(brick.key, s.view, s.map, focal, T_camera_tag, s.voxel_m, s.truncation_m);
    if (sight.kind == Sight::Kind::hidden) continue;
    const bool told = sight.kind == Sight::Kind::open ? s.clear(brick, T_camera_tag)
                                                      : s.update(brick, sight.far_m, depth, colour, T_camera_tag);
    if (!told) continue;
    ++brick.looks;
    const WorkingBrick::Drift drift = brick.drift(s.voxel_m);
    s.plain |= drift == WorkingBrick::Drift::plain;
    if (drift == WorkingBrick::Drift::none || brick.waiting) continue;
    brick.waiting = true;
    s.waiting.push_back(&brick);
  }
  s.publish();
  ++s.pictures;
  s.last_depth = frame.depth;
  s.last_color = frame.color;
  s.last_pose = pose.T_tag_camera;
  return s.field;
}

void FusionStage::reset() {
  State& s = *state_;
  s.field.reset();
  s.waiting.clear();
  s.plain = false;
  s.bricks.clear();
  s.places.clear();
  s.pictures = s.last_publication = 0;
  s.last_depth.reset();
  s.last_color.reset();
  s.seen_from_m.clear();
}

}  // namespace lumigraft
