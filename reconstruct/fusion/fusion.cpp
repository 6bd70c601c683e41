#include "reconstruct/fusion/fusion.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>

#include "reconstruct/fusion/brick_pages.h"
#include "reconstruct/fusion/brick_selection.h"
#include "reconstruct/fusion/brick_update.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/image_lookup.h"
#include "reconstruct/fusion/real_surface.h"
#include "reconstruct/fusion/working_brick.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

/// Frames without an update after which a brick is updated in any case.
constexpr std::uint32_t kMaxSkipped = 1u << kUpdateSchedule.settled_updates.size();
/// Largest change of an element of the pose's matrix (metres for its position) that counts as the same pose.
constexpr double kSamePose = 1e-5;

/// Camera motion between two poses in units: translation over `unit_m` plus rotation over `unit_rad`.
float motion(const Isometry3f& from, const Isometry3f& to, float unit_m, float unit_rad) {
  return (to.translation() - from.translation()).norm() / unit_m +
         Eigen::AngleAxisf(from.linear().transpose() * to.linear()).angle() / unit_rad;
}

bool same_frame(const std::shared_ptr<const capture::Frame>& a, const std::shared_ptr<const capture::Frame>& b) {
  if (a == b) return true;
  return a && b && a->exposure == b->exposure && a->encoded.data == b->encoded.data &&
         a->radiance.data == b->radiance.data;
}

bool same_depth(const std::shared_ptr<const capture::DepthFrame>& a,
                const std::shared_ptr<const capture::DepthFrame>& b) {
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
        preprocessor(session.color.model, settings.voxel_m, settings.far_m),
        surfaces(session, voxel_m) {}

  void add_viewpoint(const Isometry3f& T_tag_camera);
  WorkingBrick& brick_at(const BrickKey& key);
  void allocate(const Isometry3f& T_tag_camera);
  void update_models();
  void queue(WorkingBrick& brick);
  void record_pose(const Isometry3f& T_tag_camera);
  bool skipped(const WorkingBrick& brick, std::size_t index) const;
  BrickUpdate::Skip skipped_rows(const WorkingBrick& brick) const;
  void record_change(WorkingBrick& brick, bool open, const BrickUpdate::Change& change);
  bool publication_due() const { return frames - last_publication >= kPublication.interval_frames || new_viewpoint; }
  void forget_light(WorkingBrick& brick) const;
  void relight_unseen(const std::function<Eigen::Array3f(const Vector3f&)>& light_ratio);
  void copy_drifted(WorkingBrick& brick) const;
  void publish();

  capture::CameraModel camera;
  capture::Response response;
  float voxel_m, truncation_m, weight_cap;
  PixelMap map;
  DepthPreprocessor preprocessor;
  PreparedDepth view;
  RealSurfaces surfaces;

  std::uint32_t frames = 0, last_publication = 0;
  std::array<Isometry3f, kMaxSkipped> T_tag_camera_at{};  ///< of the last frames, by frame number modulo the size
  std::array<float, kMaxSkipped> motion_since{};          ///< since so many frames ago, in new views (UpdateSchedule)
  RecentBricks found_bricks;                              ///< by earlier searches
  Isometry3f search_pose = Isometry3f::Identity();        ///< camera at the last search with larger subsets
  std::vector<WorkingBrick*> publication_queue;
  bool urgent = false;         ///< one of them is to be published at once
  bool new_viewpoint = false;  ///< in seen_from_m, not yet published
  WorkingBricks bricks;
  FieldBrickMaker maker;  ///< of published bricks
  std::unordered_map<BrickKey, std::size_t, BrickKeyHash> index_of;
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const capture::DepthFrame> last_depth;
  std::shared_ptr<const capture::Frame> last_color;
  std::vector<Vector3f> seen_from_m;                         ///< least recently used first
  std::vector<std::shared_ptr<const SeenSpace>> seen_space;  ///< from there
  Eigen::Isometry3d last_pose = Eigen::Isometry3d::Identity();
  double light_variance = 0;  ///< sum of the squared relative changes of light so far
};

/// Adds the camera position to the viewpoints, or marks a near one as most recent. The limit removes positions of wrong
/// poses in time.
void FusionStage::State::add_viewpoint(const Isometry3f& T_tag_camera) {
  const Vector3f camera_m = T_tag_camera.translation();
  const auto near = std::find_if(seen_from_m.begin(), seen_from_m.end(), [&](const Vector3f& p) {
    return (p - camera_m).norm() < kPublication.viewpoint_spacing_m;
  });
  const auto seen = [&] {
    return std::make_shared<const SeenSpace>(preprocessor.rays(), view.inverse_depth, view.width, T_tag_camera,
                                             voxel_m);
  };
  if (near != seen_from_m.end()) {
    const auto space = seen_space.begin() + (near - seen_from_m.begin());
    if (frames % kPublication.seen_space_frames == 0) *space = seen();
    std::rotate(near, near + 1, seen_from_m.end());
    std::rotate(space, space + 1, seen_space.end());
    return;
  }
  if (seen_from_m.size() == kPublication.max_viewpoints) {
    seen_from_m.erase(seen_from_m.begin());
    seen_space.erase(seen_space.begin());
  }
  seen_from_m.push_back(camera_m);
  seen_space.push_back(seen());
  new_viewpoint = true;
}

WorkingBrick& FusionStage::State::brick_at(const BrickKey& key) {
  const auto [entry, is_new] = index_of.emplace(key, bricks.size());
  if (is_new) {
    WorkingBrick& brick = bricks.add();
    brick.key = key;
    brick.light_variance = light_variance;
  }
  return bricks[entry->second];
}

void FusionStage::State::allocate(const Isometry3f& T_tag_camera) {
  const float moved = motion(search_pose, T_tag_camera, kSearchSchedule.still_m, kSearchSchedule.still_rad);
  const int subsets = frames < kSearchSchedule.initial_frames || moved > kSearchSchedule.other_view ? 1
                      : moved > 1 ? kSearchSchedule.moving_subsets
                                  : kSearchSchedule.still_subsets;
  if (subsets < kSearchSchedule.still_subsets) search_pose = T_tag_camera;
  for (const BrickKey& key : bricks_on_surfaces(view, preprocessor, T_tag_camera, voxel_m, truncation_m,
                                                {subsets, static_cast<int>(frames) % subsets}, found_bricks)) {
    brick_at(key);
  }
}

/// Assigns the models of real surfaces to bricks, after a surface was found or its pose changed.
void FusionStage::State::update_models() {
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    WorkingBrick& brick = bricks[i];
    if (!brick.model) continue;
    brick.model = nullptr;
    queue(brick);
  }
  for (const auto& [key, model] : surfaces.bricks()) {
    WorkingBrick& brick = brick_at(key);
    brick.model = model;
    if (!brick.published) brick.urgent = urgent = true;
    queue(brick);
  }
}

void FusionStage::State::queue(WorkingBrick& brick) {
  if (brick.queued) return;
  brick.queued = true;
  publication_queue.push_back(&brick);
}

/// Computes the motion since earlier frames and stores the pose.
void FusionStage::State::record_pose(const Isometry3f& T_tag_camera) {
  for (std::uint32_t ago = 1; ago < kMaxSkipped; ++ago) {
    const Isometry3f& then = T_tag_camera_at[(frames + kMaxSkipped - ago) % kMaxSkipped];
    motion_since[ago] = motion(then, T_tag_camera, kUpdateSchedule.new_view_m, kUpdateSchedule.new_view_rad);
  }
  T_tag_camera_at[frames % kMaxSkipped] = T_tag_camera;
}

/// Whether a settled brick is not updated in this frame. `index`: of the brick.
bool FusionStage::State::skipped(const WorkingBrick& brick, std::size_t index) const {
  const std::uint32_t ago = frames - brick.last_update;
  if (brick.update_count < brick.active_until || ago >= kMaxSkipped || brick.light_variance < light_variance)
    return false;
  constexpr std::uint32_t kTurns = kUpdateSchedule.patience_turns;
  const float patience =
      kUpdateSchedule.patience_min + kUpdateSchedule.patience_spread * static_cast<float>(index % kTurns) / kTurns;
  constexpr const auto& kSettled = kUpdateSchedule.settled_updates;
  auto steps = std::upper_bound(kSettled.begin(), kSettled.end(), brick.update_count) - kSettled.begin();
  if (motion_since[ago] > kUpdateSchedule.other_view) return false;
  if (motion_since[ago] > patience) steps = steps > 1 ? 1 : 0;
  return ((frames + index) & ((1u << steps) - 1)) != 0;
}

/// Rows take turns only in settled bricks that are updated often.
BrickUpdate::Skip FusionStage::State::skipped_rows(const WorkingBrick& brick) const {
  const std::uint32_t ago = frames - brick.last_update;
  if (brick.update_count < kUpdateSchedule.settled_updates.front() || brick.update_count < brick.active_until ||
      brick.light_variance < light_variance || ago == 0 || ago > kUpdateSchedule.frequent_frames)
    return BrickUpdate::Skip::none;
  return motion_since[ago] < kUpdateSchedule.same_view ? BrickUpdate::Skip::free_and_unobserved
                                                       : BrickUpdate::Skip::free;
}

/// Updates the brick's counters and queues it for publication if it may have drifted.
void FusionStage::State::record_change(WorkingBrick& brick, bool open, const BrickUpdate::Change& change) {
  if (!open) {
    brick.open = false;
    if (change.moved_voxels > kUpdateSchedule.active_moved_voxels)
      brick.active_until = brick.update_count + kUpdateSchedule.active_updates;
  }
  ++brick.update_count;
  brick.last_update = frames;
  const int urgent_new_voxels =
      frames < kSearchSchedule.initial_frames ? kPublication.urgent_moved_voxels : kPublication.urgent_new_voxels;
  brick.urgent |= !brick.published || change.new_voxels >= urgent_new_voxels ||
                  change.moved_voxels >= kPublication.urgent_moved_voxels;
  urgent |= brick.urgent;
  brick.add_drift(change.new_voxels > 0 || change.new_color, change.drift, change.radiance_drift);
  if (brick.urgent || brick.model || brick.may_have_drifted()) queue(brick);
}

/// What was seen under earlier light is less certain now.
void FusionStage::State::forget_light(WorkingBrick& brick) const {
  brick.forget_radiance(light_variance - brick.light_variance);
  brick.light_variance = light_variance;
}

/// The colours of surface that this frame does not show follow the light, to first order.
void FusionStage::State::relight_unseen(const std::function<Eigen::Array3f(const Vector3f&)>& light_ratio) {
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    WorkingBrick& brick = bricks[i];
    if (brick.open || !brick.published || !(brick.light_variance < light_variance)) continue;
    const Eigen::Array3f ratio = light_ratio(brick_centre(brick.key, voxel_m));
    forget_light(brick);
    for (Vector3f& radiance : brick.now.radiance) radiance = (radiance.array() * ratio).matrix();
    brick.urgent = urgent = true;
    queue(brick);
  }
}

/// Copies a queued brick for publication if it has drifted.
void FusionStage::State::copy_drifted(WorkingBrick& brick) const {
  std::optional<FieldBrick> with_model;
  if (brick.model) with_model = merge_model(brick.now, *brick.model, voxel_m);
  const FieldBrick& result = with_model ? *with_model : brick.now;
  const bool drifted = brick.urgent || brick.drifted(result, voxel_m);
  brick.queued = brick.urgent = false;
  if (!drifted) return;
  brick.published = maker.copy(result);
  brick.drift = WorkingBrick::kDriftUnknown;
  brick.copied = true;
}

void FusionStage::State::publish() {
  const bool due = publication_due();
  if (!urgent && !(due && (new_viewpoint || !publication_queue.empty()))) return;
  auto next = std::make_shared<DistanceField>(*field);
  next->version += 1;
  next->seen_from_m = seen_from_m;
  next->seen_space = seen_space;
  bool changed = new_viewpoint;
  std::erase_if(publication_queue, [&](WorkingBrick* brick) {
    if (brick->queued) {
      if (!due && !brick->urgent) return false;
      copy_drifted(*brick);
    }
    if (!brick->copied) return true;
    brick->copied = false;
    next->bricks[brick->key] = brick->published;
    changed = true;
    return true;
  });
  urgent = false;
  if (due) last_publication = frames;
  if (!changed) return;
  new_viewpoint = false;
  field = std::move(next);
}

FusionStage::FusionStage(const capture::Session& session, const FusionSettings& settings)
    : state_(std::make_unique<State>(session, settings)) {}

FusionStage::~FusionStage() = default;

std::shared_ptr<const DistanceField> FusionStage::fuse(
    const capture::FrameSet& frame, const Pose& pose, double light_change,
    const std::function<Eigen::Array3f(const Eigen::Vector3f&)>& light_ratio) {
  State& s = *state_;
  s.light_variance += light_change * light_change;
  if (!frame.depth || pose.age_ns != 0) {
    if (s.field && light_change > 0 && light_ratio) {
      s.relight_unseen(light_ratio);
      s.publish();
    }
    return s.field;
  }
  if (frame.depth->depth_m.width != s.camera.width || frame.depth->depth_m.height != s.camera.height) return s.field;
  const bool same_pose = (pose.T_tag_camera.matrix() - s.last_pose.matrix()).cwiseAbs().maxCoeff() < kSamePose;
  if (s.field && same_pose && same_depth(frame.depth, s.last_depth) && same_frame(frame.color, s.last_color))
    return s.field;
  if (!s.field) {
    auto empty = std::make_shared<DistanceField>();
    empty->voxel_m = s.voxel_m;
    empty->truncation_m = s.truncation_m;
    s.field = empty;
  }

  s.preprocessor.prepare(frame.depth->depth_m, s.view);
  const Isometry3f T_camera_tag = pose.T_tag_camera.inverse().cast<float>();
  s.add_viewpoint(pose.T_tag_camera.cast<float>());
  s.allocate(pose.T_tag_camera.cast<float>());
  if (s.surfaces.any() && s.surfaces.register_models(frame.depth->depth_m, pose.T_tag_camera)) s.update_models();
  s.record_pose(pose.T_tag_camera.cast<float>());
  const ColorLookup colour(frame.color.get(), s.response, s.camera.width, s.camera.height,
                           Eigen::Array3f::Map(frame.color_gain.data()), frame.color_vignetting.get());
  const BrickUpdate update(s.view, s.preprocessor, s.map, colour, T_camera_tag,
                           {s.voxel_m, s.truncation_m, s.weight_cap});
  const float focal = static_cast<float>(std::max(s.camera.fx, s.camera.fy));
  const Vector3f camera_m = pose.T_tag_camera.translation().cast<float>();
  std::vector<std::pair<WorkingBrick*, BrickVisibility>> visible;
  for (std::size_t i = 0; i < s.bricks.size(); ++i) {
    WorkingBrick& brick = s.bricks[i];
    if (s.skipped(brick, i)) continue;
    const BrickVisibility visibility =
        brick_visibility(brick.key, s.view, s.map, focal, T_camera_tag, s.voxel_m, s.truncation_m);
    if (visibility.kind == BrickVisibility::Kind::hidden ||
        s.surfaces.behind_mirror(camera_m, brick_centre(brick.key, s.voxel_m)))
      continue;
    visible.emplace_back(&brick, visibility);
  }
  const bool due = s.publication_due();
  for (std::size_t i = 0; i < visible.size(); ++i) {
    if (i + 1 < visible.size() && visible[i + 1].second.kind == BrickVisibility::Kind::surface)
      update.prefetch(*visible[i + 1].first, visible[i + 1].second);
    auto& [brick, visibility] = visible[i];
    const bool open = visibility.kind == BrickVisibility::Kind::open;
    const BrickUpdate::Skip skip = s.skipped_rows(*brick);
    if (!open && colour && brick->light_variance < s.light_variance) {
      s.forget_light(*brick);
      brick->urgent = true;
    }
    const BrickUpdate::Change change =
        open ? update.update_open(*brick) : update.update(*brick, visibility.far_m, skip);
    if (change.observed) s.record_change(*brick, open, change);
    // Now, while the brick is in the cache.
    if (brick->queued && (due || brick->urgent)) s.copy_drifted(*brick);
  }
  if (light_change > 0 && light_ratio) s.relight_unseen(light_ratio);
  s.publish();
  ++s.frames;
  s.last_depth = frame.depth;
  s.last_color = frame.color;
  s.last_pose = pose.T_tag_camera;
  return s.field;
}

std::vector<std::string> FusionStage::warnings() const { return state_->surfaces.warnings(); }

}  // namespace lumigraft::reconstruct
