#include "reconstruct/fusion/fusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "reconstruct/fusion/brick_pages.h"
#include "reconstruct/fusion/brick_selection.h"
#include "reconstruct/fusion/brick_update.h"
#include "reconstruct/fusion/color_lookup.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/real_surface.h"
#include "reconstruct/fusion/working_brick.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

/// A brick that many pictures have told about learns little from one more out of the same place. From so many looks on
/// it takes every second, fourth and eighth; but every one for a while after a picture showed so many voxels far from
/// where they were, and more of them as soon as the camera has moved on as far as makes it see anew.
constexpr std::array<std::uint32_t, 3> kSettled = {6, 12, 40};
constexpr std::uint32_t kLongestRest = 1u << kSettled.size(), kLivelyLooks = 8;
constexpr float kAnewM = 0.02f, kAnewRad = 0.03f;
constexpr float kUnmoved = 0.5f;  ///< times that: rows that told nothing tell nothing again
constexpr float kFarAnew = 8;     ///< times that: another view altogether, that nothing rests for
constexpr int kLivelyVoxels = 24;
/// How far the camera has moved since surfaces were looked through for new bricks says how large a share of them is
/// looked through now: all of another view, half of a moving one, a quarter at rest.
constexpr float kSteadyM = 0.01f, kSteadyRad = 0.01f;
constexpr float kFarSteady = 8;  ///< times that
constexpr int kMovingShares = 2, kShares = 4;
constexpr int kUrgentVoxels = 8;     ///< far from where they were: published at once
constexpr std::uint32_t kYoung = 4;  ///< pictures of a room just begun: all of each is searched, and told at once
constexpr int kNewVoxels = 64;       ///< newly known: likewise
constexpr std::uint32_t kWait = 4;   ///< pictures, that slight changes are held back to be published together
constexpr float kPlaceM = 0.25f;     // apart, as places from where the camera looked
constexpr std::size_t kMostPlaces = 64;

bool same_picture(const std::shared_ptr<const capture::Picture>& a, const std::shared_ptr<const capture::Picture>& b) {
  if (a == b) return true;
  return a && b && a->exposure == b->exposure && a->encoded.data == b->encoded.data &&
         a->radiance.data == b->radiance.data;
}

bool same_depth(const std::shared_ptr<const capture::DepthPicture>& a,
                const std::shared_ptr<const capture::DepthPicture>& b) {
  return a == b || (a && b && a->depth_m.data == b->depth_m.data);
}

}  // namespace

struct FusionStage::State {
  State(const capture::Session& session, const FusionSettings& settings)
      : camera(session.color.model),
        response(session.color.response),
        voxel_m(static_cast<float>(settings.voxel_m)),
        truncation_m(static_cast<float>(settings.voxel_m * settings.truncation_voxels)),
        weight_cap(static_cast<float>(settings.weight_cap)),
        map(session.color.model),
        preparation(session.color.model, settings.voxel_m, settings.far_m),
        surfaces(session, voxel_m) {}

  void look_from(const Vector3f& camera_m);
  WorkingBrick& brick_at(const BrickKey& key);
  void allocate(const Isometry3f& T_tag_camera);
  void lay_surfaces();
  void await_publication(WorkingBrick& brick);
  void remember(const Isometry3f& T_tag_camera);
  bool rests(const WorkingBrick& brick, std::size_t place) const;
  BrickUpdate::Wait may_wait(const WorkingBrick& brick) const;
  void consider(WorkingBrick& brick, bool open, const BrickUpdate::Told& told);
  bool publication_due() const { return pictures - last_publication >= kWait || new_place; }
  void renew(WorkingBrick& brick) const;
  void publish();

  capture::CameraModel camera;
  capture::Response response;
  float voxel_m, truncation_m, weight_cap;
  PixelMap map;
  DepthPreparation preparation;
  PreparedDepth view;
  RealSurfaces surfaces;

  std::uint32_t pictures = 0, last_publication = 0;
  std::array<Isometry3f, kLongestRest> T_tag_camera_at{};  ///< by picture, the last ones
  std::array<float, kLongestRest> moved_since{};           ///< by how many pictures ago
  RecentBricks found;                                      ///< that were looked for before
  Isometry3f searched_from = Isometry3f::Identity();       ///< camera when all surfaces were last looked through
  std::vector<WorkingBrick*> waiting;                      ///< to be published
  bool urgent = false;                                     ///< one of them at once
  bool new_place = false;                                  ///< in seen_from_m, not published yet
  WorkingBricks bricks;
  FieldBrickMaker maker;  ///< of those that are published
  std::unordered_map<BrickKey, std::size_t, BrickKeyHash> places;
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const capture::DepthPicture> last_depth;
  std::shared_ptr<const capture::Picture> last_color;
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
  new_place = true;
}

WorkingBrick& FusionStage::State::brick_at(const BrickKey& key) {
  const auto [place, is_new] = places.emplace(key, bricks.size());
  if (is_new) {
    bricks.add().key = key;
  }
  return bricks[place->second];
}

void FusionStage::State::allocate(const Isometry3f& T_tag_camera) {
  const float moved =
      (T_tag_camera.translation() - searched_from.translation()).norm() / kSteadyM +
      Eigen::AngleAxisf(searched_from.linear().transpose() * T_tag_camera.linear()).angle() / kSteadyRad;
  const int shares = pictures < kYoung || moved > kFarSteady ? 1 : moved > 1 ? kMovingShares : kShares;
  if (shares < kShares) searched_from = T_tag_camera;
  for (const BrickKey& key : bricks_on_surfaces(view, preparation, T_tag_camera, voxel_m, truncation_m,
                                                {shares, static_cast<int>(pictures) % shares}, found)) {
    brick_at(key);
  }
}

/// Where real surfaces were found, or are found to lie elsewhere.
void FusionStage::State::lay_surfaces() {
  for (std::size_t place = 0; place < bricks.size(); ++place) {
    WorkingBrick& brick = bricks[place];
    if (!brick.model) continue;
    brick.model = nullptr;
    await_publication(brick);
  }
  for (const auto& [key, model] : surfaces.bricks()) {
    WorkingBrick& brick = brick_at(key);
    brick.model = model;
    if (!brick.published) brick.urgent = urgent = true;
    await_publication(brick);
  }
}

void FusionStage::State::await_publication(WorkingBrick& brick) {
  if (brick.waiting) return;
  brick.waiting = true;
  waiting.push_back(&brick);
}

/// How far the camera has moved since so many pictures, over what makes it see anew.
void FusionStage::State::remember(const Isometry3f& T_tag_camera) {
  for (std::uint32_t ago = 1; ago < kLongestRest; ++ago) {
    const Isometry3f& then = T_tag_camera_at[(pictures + kLongestRest - ago) % kLongestRest];
    const float way = (then.translation() - T_tag_camera.translation()).norm() / kAnewM;
    const float turn = Eigen::AngleAxisf(then.linear().transpose() * T_tag_camera.linear()).angle() / kAnewRad;
    moved_since[ago] = way + turn;
  }
  T_tag_camera_at[pictures % kLongestRest] = T_tag_camera;
}

bool FusionStage::State::rests(const WorkingBrick& brick, std::size_t place) const {
  const std::uint32_t ago = pictures - brick.last_look;
  if (brick.update_count < brick.active_until || ago >= kLongestRest) return false;
  // Not all bricks at once.
  constexpr std::uint32_t kTurns = 8;
  const float patience = 0.75f + 0.5f * static_cast<float>(place % kTurns) / kTurns;
  auto steps = std::upper_bound(kSettled.begin(), kSettled.end(), brick.update_count) - kSettled.begin();
  if (moved_since[ago] > kFarAnew) return false;
  if (moved_since[ago] > patience) steps = steps > 1 ? 1 : 0;
  return ((pictures + place) & ((1u << steps) - 1)) != 0;
}

/// Of what is looked at often; what rests is looked at all over, or a visitor would stay in its corners.
BrickUpdate::Wait FusionStage::State::may_wait(const WorkingBrick& brick) const {
  constexpr std::uint32_t kOften = 2;
  const std::uint32_t ago = pictures - brick.last_look;
  if (brick.update_count < kSettled.front() || brick.update_count < brick.active_until || ago == 0 || ago > kOften)
    return BrickUpdate::Wait::nothing;
  return moved_since[ago] < kUnmoved ? BrickUpdate::Wait::free_and_silent : BrickUpdate::Wait::free;
}

/// A brick of which a picture told is to be published, now or with others.
void FusionStage::State::consider(WorkingBrick& brick, bool open, const BrickUpdate::Told& told) {
  if (!open) {
    brick.open = false;
    if (told.moved > kLivelyVoxels) brick.active_until = brick.update_count + kLivelyLooks;
  }
  ++brick.update_count;
  brick.last_look = pictures;
  // A look at what was published costs as much as an update: what is urgent is known without.
  brick.urgent |= !brick.published || told.learnt >= (pictures < kYoung ? kUrgentVoxels : kNewVoxels) ||
                  told.moved >= kUrgentVoxels;
  urgent |= brick.urgent;
  brick.add_drift(told.learnt > 0 || told.coloured, told.drift, told.radiance_drift);
  if (brick.urgent || brick.model || brick.may_have_drifted()) await_publication(brick);
}

/// What is published of a brick that awaits it, where that has drifted.
void FusionStage::State::renew(WorkingBrick& brick) const {
  std::optional<FieldBrick> with_model;
  if (brick.model) with_model = merged(brick.now, *brick.model, voxel_m);
  const FieldBrick& whole = with_model ? *with_model : brick.now;
  const bool drifted = brick.urgent || brick.drifted(whole, voxel_m);
  brick.waiting = brick.urgent = false;
  if (!drifted) return;
  brick.published = maker.copy(whole);
  brick.drift = WorkingBrick::kDriftUnknown;
  brick.renewed = true;
}

void FusionStage::State::publish() {
  const bool due = publication_due();
  if (!urgent && !(due && (new_place || !waiting.empty()))) return;
  auto next = std::make_shared<DistanceField>(*field);
  next->version += 1;
  next->seen_from_m = seen_from_m;
  bool changed = new_place;
  std::erase_if(waiting, [&](WorkingBrick* brick) {
    if (brick->waiting) {
      if (!due && !brick->urgent) return false;
      renew(*brick);
    }
    if (!brick->renewed) return true;
    brick->renewed = false;
    next->bricks.insert_or_assign(brick->key, brick->published);
    changed = true;
    return true;
  });
  urgent = false;
  if (due) last_publication = pictures;
  if (!changed) return;
  new_place = false;
  field = std::move(next);
}

FusionStage::FusionStage(const capture::Session& session, const FusionSettings& settings)
    : state_(std::make_unique<State>(session, settings)) {}

FusionStage::~FusionStage() = default;

std::shared_ptr<const DistanceField> FusionStage::fuse(const capture::FrameSet& frame, const Pose& pose) {
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
  if (s.surfaces.any() && s.surfaces.look(frame.depth->depth_m, pose.T_tag_camera)) s.lay_surfaces();
  s.remember(pose.T_tag_camera.cast<float>());
  const ColorLookup colour(frame.color.get(), s.response, s.camera.width, s.camera.height);
  const BrickUpdate picture(s.view, s.preparation, s.map, colour, T_camera_tag,
                            {s.voxel_m, s.truncation_m, s.weight_cap});
  const float focal = static_cast<float>(std::max(s.camera.fx, s.camera.fy));
  const Vector3f camera_m = pose.T_tag_camera.translation().cast<float>();
  std::vector<std::pair<WorkingBrick*, Sight>> seen;
  for (std::size_t place = 0; place < s.bricks.size(); ++place) {
    WorkingBrick& brick = s.bricks[place];
    if (s.rests(brick, place)) continue;
    const Sight sight = sight_of(brick.key, s.view, s.map, focal, T_camera_tag, s.voxel_m, s.truncation_m);
    if (sight.kind == Sight::Kind::hidden || s.surfaces.behind_mirror(camera_m, middle_of(brick.key, s.voxel_m)))
      continue;
    seen.emplace_back(&brick, sight);
  }
  const bool due = s.publication_due();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (i + 1 < seen.size() && seen[i + 1].second.kind == Sight::Kind::surface)
      picture.fetch(*seen[i + 1].first, seen[i + 1].second);
    auto& [brick, sight] = seen[i];
    const bool open = sight.kind == Sight::Kind::open;
    const BrickUpdate::Told told =
        open ? picture.clear(*brick) : picture.update(*brick, sight.far_m, s.may_wait(*brick));
    if (told.any) s.consider(*brick, open, told);
    // At once, while the brick is in the cache.
    if (brick->waiting && (due || brick->urgent)) s.renew(*brick);
  }
  s.publish();
  ++s.pictures;
  s.last_depth = frame.depth;
  s.last_color = frame.color;
  s.last_pose = pose.T_tag_camera;
  return s.field;
}

std::vector<std::string> FusionStage::warnings() const { return state_->surfaces.warnings(); }

}  // namespace lumigraft::reconstruct
