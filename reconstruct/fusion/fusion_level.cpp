#include "reconstruct/fusion/fusion_level.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>

#include "reconstruct/fusion/brick_pages.h"
#include "reconstruct/fusion/brick_selection.h"
#include "reconstruct/fusion/brick_update.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/image_lookup.h"
#include "reconstruct/fusion/real_surface.h"
#include "reconstruct/fusion/update_schedule.h"
#include "reconstruct/fusion/working_brick.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3f;
using Eigen::Vector3f;

/// Largest change of an element of the pose's matrix (metres for its position) that counts as the same pose.
constexpr double kSamePose = 1e-5;

/// Camera motion between two poses in units: translation over `unit_m` plus rotation over `unit_rad`.
float motion(const Isometry3f& from, const Isometry3f& to, float unit_m, float unit_rad) {
  return (to.translation() - from.translation()).norm() / unit_m +
         Eigen::AngleAxisf(from.linear().transpose() * to.linear()).angle() / unit_rad;
}

/// Voxels that were not observed get the distances of another brick.
void fill_unknown(FieldBrick& brick, const FieldBrick& from) {
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (brick.weight[i] > 0) continue;
    brick.distance_m[i] = from.distance_m[i];
    brick.weight[i] = from.weight[i];
  }
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

struct FusionLevel::State {
  State(const capture::Session& session, const FusionSettings& settings, const FusionScope& in)
      : scope(in),
        camera(session.color.model),
        response(session.color.response),
        voxel_m(static_cast<float>(settings.voxel_m)),
        truncation_m(static_cast<float>(settings.voxel_m * settings.truncation_voxels)),
        weight_cap(static_cast<float>(settings.weight_cap)),
        map(session.color.model),
        preprocessor(session.color.model, settings.voxel_m, settings.voxel_m * settings.truncation_voxels,
                     scope.depth_to_m, true, session.depth_noise()),
        surfaces(session, voxel_m) {
    set_max_memory(settings.max_memory_mb);
  }

  void set_max_memory(double mb) { max_bytes = static_cast<std::size_t>(1e6 * std::max(mb, 0.0)); }
  void begin_field();
  void restore(BrickMap<FieldBrick> kept);
  void add_viewpoint(const Isometry3f& T_tag_camera);
  WorkingBrick& brick_at(const BrickKey& key);
  std::size_t count_bytes();
  /// Memory that a frame may need for copies.
  std::size_t reserve() const {
    constexpr std::size_t kBricks = kUpdateSchedule.max_bricks;
    return std::min(kBricks * (FieldBrickMaker::kBrick_bytes + FieldBrickMaker::kColor_bytes), max_bytes / 2);
  }
  void evict();
  void allocate(const Isometry3f& T_tag_camera);
  void update_models();
  void queue(WorkingBrick& brick);
  std::vector<VisibleBrick> bricks_to_update(const Isometry3f& T_tag_camera, const Isometry3f& T_camera_tag);
  using LightRatio = std::function<Eigen::Array3f(const Vector3f&)>;
  /// `light_ratio`: may be empty.
  void update_brick(const BrickUpdate& update, const VisibleBrick& visible, bool with_color,
                    const LightRatio& light_ratio);
  void record_change(WorkingBrick& brick, bool open, const BrickUpdate::Change& change);
  bool publication_due() const { return frames - last_publication >= kPublication.interval_frames || new_viewpoint; }
  void follow_light(WorkingBrick& brick, const LightRatio& light_ratio) const;
  void follow_light(const LightRatio& light_ratio);
  void copy_drifted(WorkingBrick& brick) const;
  void publish();

  const FusionScope scope;
  capture::CameraModel camera;
  capture::Response response;
  float voxel_m, truncation_m, weight_cap;
  std::size_t max_bytes = 0;  ///< of bricks, working and published
  PixelMap map;
  DepthPreprocessor preprocessor;
  PreparedDepth view;
  RealSurfaces surfaces;

  std::uint32_t frames = 0, last_publication = 0;
  RecentBricks found_bricks;                        ///< by earlier searches
  Isometry3f search_pose = Isometry3f::Identity();  ///< camera at the last search with larger subsets
  std::vector<WorkingBrick*> publication_queue;
  bool urgent = false;         ///< one of them is to be published at once
  bool new_viewpoint = false;  ///< in seen_from_m, not yet published
  WorkingBricks bricks;
  std::vector<BrickKey> evicted;  ///< not yet removed from the published field
  std::size_t evicted_count = 0;
  bool unfinished = false;  ///< the last frame had more bricks to update than a call may
  std::size_t free_bytes = 0;
  bool scarce = false;  ///< less memory was free than a frame may need
  FieldBrickMaker maker;
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const capture::DepthFrame> last_depth;
  std::shared_ptr<const capture::Frame> last_color;
  bool only_predicted = false;                               ///< colours, in the light of the last call
  std::vector<Vector3f> seen_from_m;                         ///< least recently used first
  std::vector<std::shared_ptr<const SeenSpace>> seen_space;  ///< from there
  Eigen::Isometry3d last_pose = Eigen::Isometry3d::Identity();
  double light_variance = 0;  ///< sum of the squared relative changes of light so far
};

void FusionLevel::State::begin_field() {
  if (field) return;
  auto empty = std::make_shared<DistanceField>();
  empty->voxel_m = voxel_m;
  empty->truncation_m = truncation_m;
  field = empty;
}

/// Bricks near the tag come first where memory is short, as they are evicted last. All count as out of view for long,
/// so that those that no frame shows give way to those that one does.
void FusionLevel::State::restore(BrickMap<FieldBrick> kept) {
  begin_field();
  auto next = std::make_shared<DistanceField>(*field);
  next->version += 1;
  for (const BrickKey& key : std::exchange(evicted, {})) next->bricks.erase(key);
  std::vector<std::pair<float, BrickKey>> order;  // squared distance
  for (const auto& [key, brick] : kept) order.emplace_back(brick_centre(key, voxel_m).squaredNorm(), key);
  std::sort(order.begin(), order.end());
  const std::size_t used = count_bytes() + reserve();
  std::size_t free = (max_bytes - std::min(used, max_bytes)) / FieldBrickMaker::kBrick_bytes;
  for (const auto& [squared, key] : order) {
    if (free == 0) break;
    WorkingBrick& brick = brick_at(key);
    if (brick.now || brick.published || brick.model) {
      free -= !brick.now || brick.now == brick.published ? 1 : 0;
      brick.prepare_change(maker);
      fill_unknown(*brick.now, *kept.at(key));
      brick.solid = true;
      brick.urgent = urgent = true;
      queue(brick);
    } else {
      brick.publish(maker.copy(*kept.at(key)));
      brick.now = brick.published;
      brick.solid = true;
      brick.last_update = frames - kMemory.keep_frames;
      next->bricks[key] = brick.published;
      --free;
    }
    kept.erase(key);  // now, so that not all are in memory twice
  }
  field = std::move(next);
}

/// Adds the camera position to the viewpoints, or marks a near one as most recent. The limit removes positions of wrong
/// poses in time.
void FusionLevel::State::add_viewpoint(const Isometry3f& T_tag_camera) {
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

WorkingBrick& FusionLevel::State::brick_at(const BrickKey& key) {
  const std::size_t before = bricks.size();
  WorkingBrick& brick = bricks.at(key);
  if (bricks.size() > before) {
    brick.last_update = frames;
    brick.light_variance = light_variance;
  }
  return brick;
}

std::size_t FusionLevel::State::count_bytes() {
  std::size_t bytes = 0;
  bricks.for_each([&](WorkingBrick& brick) {
    // What has not drifted is not worth a second copy once it is out of view.
    if (unseen(brick, frames) && brick.published && brick.now != brick.published && !brick.queued && !brick.model)
      brick.revert();
    bytes += brick.bytes();
  });
  return bytes;
}

/// Keeps memory free for the bricks that a frame changes, as long as there are bricks to evict.
void FusionLevel::State::evict() {
  free_bytes = max_bytes - std::min(count_bytes(), max_bytes);
  scarce = free_bytes < reserve();
  if (!scarce) return;
  const auto slack = static_cast<std::size_t>(kMemory.slack * static_cast<double>(max_bytes));
  const std::vector<BrickKey> keys = least_needed(bricks, reserve() - free_bytes + slack, frames, voxel_m);
  const std::set<BrickKey> gone(keys.begin(), keys.end());
  bricks.remove_if([&](const WorkingBrick& brick) {
    const bool never_observed = !brick.now && !brick.model && unseen(brick, frames);
    if (!never_observed && !gone.contains(brick.key)) return false;
    found_bricks.erase(brick.key);
    return true;
  });
  evicted.insert(evicted.end(), keys.begin(), keys.end());
  evicted_count += keys.size();
}

void FusionLevel::State::allocate(const Isometry3f& T_tag_camera) {
  const float moved = motion(search_pose, T_tag_camera, kSearchSchedule.still_m, kSearchSchedule.still_rad);
  const int subsets = frames < kSearchSchedule.initial_frames || moved > kSearchSchedule.other_view ? 1
                      : moved > 1 ? kSearchSchedule.moving_subsets
                                  : kSearchSchedule.still_subsets;
  if (subsets < kSearchSchedule.still_subsets) search_pose = T_tag_camera;
  for (const BrickKey& key :
       bricks_on_surfaces(view, preprocessor, T_tag_camera, voxel_m, truncation_m,
                          {subsets, static_cast<int>(frames) % subsets}, scope.surface_m, found_bricks)) {
    brick_at(key);
  }
}

/// Assigns the models of real surfaces to bricks, after a surface was found or its pose changed.
void FusionLevel::State::update_models() {
  for (const auto& brick : bricks) {
    if (!brick->model) continue;
    brick->model = nullptr;
    queue(*brick);
  }
  for (const auto& [key, model] : surfaces.bricks()) {
    WorkingBrick& brick = brick_at(key);
    brick.model = model;
    if (!brick.published) brick.urgent = urgent = true;
    queue(brick);
  }
}

void FusionLevel::State::queue(WorkingBrick& brick) {
  if (brick.queued) return;
  brick.queued = true;
  publication_queue.push_back(&brick);
}

std::vector<VisibleBrick> FusionLevel::State::bricks_to_update(const Isometry3f& T_tag_camera,
                                                               const Isometry3f& T_camera_tag) {
  const float focal = static_cast<float>(std::max(camera.fx, camera.fy));
  std::vector<VisibleBrick> visible;
  bricks.for_each([&](WorkingBrick& brick) {
    if (!update_due(brick, frames, light_variance)) return;
    const BrickVisibility visibility =
        brick_visibility(brick.key, view, map, focal, T_camera_tag, voxel_m, truncation_m);
    if (visibility.kind == BrickVisibility::Kind::hidden ||
        (visibility.kind == BrickVisibility::Kind::open && brick.open) ||
        surfaces.behind_mirror(T_tag_camera.translation(), brick_centre(brick.key, voxel_m)))
      return;
    visible.push_back({&brick, visibility});
  });
  // Lamps and albedo are first solved from the first frame alone.
  const bool whole = frames == 0 && scope.first_frame_whole;
  unfinished = !whole && limit_work(visible, frames, light_variance, scope.max_bricks);
  std::size_t free = free_bytes;
  std::erase_if(visible, [&](const VisibleBrick& at) {
    const bool colored = at.visibility.kind == BrickVisibility::Kind::surface && !at.brick->unpublished_color;
    const std::size_t needed = (at.brick->now == at.brick->published ? FieldBrickMaker::kBrick_bytes : 0) +
                               (colored ? FieldBrickMaker::kColor_bytes : 0);
    if (needed > free) return true;
    free -= needed;
    return false;
  });
  return visible;
}

void FusionLevel::State::update_brick(const BrickUpdate& update, const VisibleBrick& visible, bool with_color,
                                      const LightRatio& light_ratio) {
  WorkingBrick& brick = *visible.brick;
  const bool open = visible.visibility.kind == BrickVisibility::Kind::open;
  const bool light_changed = !open && with_color && brick.light_variance < light_variance;
  if (light_changed && brick.now && brick.now->color) {
    follow_light(brick, light_ratio);
    brick.urgent = true;
  } else if (light_changed) {
    brick.light_variance = light_variance;
  }
  const BrickUpdate::Change change =
      open ? update.update_open(brick, maker) : update.update(brick, visible.visibility.hidden_m, maker);
  // Of its mean voxel: new ones have none yet.
  brick.update_count -= brick.update_count * static_cast<std::uint32_t>(change.new_voxels) / kBrickVoxels;
  ++brick.update_count;
  brick.last_update = frames;
  brick.misses = change.observed ? 0 : brick.misses + 1;
  if (change.observed) record_change(brick, open, change);
  // Now, while the brick is in the cache.
  if (brick.queued && (publication_due() || brick.urgent)) copy_drifted(brick);
}

/// Updates the brick's counters and queues it for publication if it may have drifted.
void FusionLevel::State::record_change(WorkingBrick& brick, bool open, const BrickUpdate::Change& change) {
  constexpr int kRows = kBrickEdge * kBrickEdge;
  const bool was_solid = brick.solid;
  brick.solid = change.solid || (brick.solid && change.rows < kRows);
  if (!open) {
    brick.open = false;
    if (change.moved_voxels > kUpdateSchedule.active_moved_voxels)
      brick.active_until = brick.update_count + kUpdateSchedule.active_updates;
  }
  const int urgent_new_voxels =
      frames < kSearchSchedule.initial_frames ? kPublication.urgent_moved_voxels : kPublication.urgent_new_voxels;
  brick.urgent |= !brick.published || change.new_voxels >= urgent_new_voxels ||
                  change.moved_voxels >= kPublication.urgent_moved_voxels || (was_solid && !brick.solid);
  urgent |= brick.urgent;
  brick.add_drift(change.new_voxels > 0 || change.new_color, change.drift, change.radiance_drift);
  if (brick.urgent || brick.model || brick.may_have_drifted()) queue(brick);
}

/// Colours seen under earlier light follow it, to first order, and are less certain by the relative change of the
/// room's light and by that at this place, which is larger near a lamp that is carried past.
void FusionLevel::State::follow_light(WorkingBrick& brick, const LightRatio& light_ratio) const {
  brick.prepare_change(maker);
  BrickColor& color = brick.prepare_color(maker);
  double variance = light_variance - brick.light_variance;
  brick.light_variance = light_variance;
  if (light_ratio) {
    const Eigen::Array3f ratio = light_ratio(brick_centre(brick.key, voxel_m));
    for (Vector3f& radiance : color.radiance) radiance = (radiance.array() * ratio).matrix();
    variance += ratio.max(kRadianceMemory.min_ratio).log().square().maxCoeff();
  }
  // An observation of weight w has a relative variance of σ²/w; both variances add.
  const float added = static_cast<float>(variance / (kRadianceMemory.log_sigma * kRadianceMemory.log_sigma));
  for (float& weight : color.weight) {
    if (weight > 0) weight /= 1 + added * weight;
  }
}

/// The colours of bricks that were not measured in the light of now follow it, to first order.
void FusionLevel::State::follow_light(const LightRatio& light_ratio) {
  for (const auto& pointer : bricks) {
    WorkingBrick& brick = *pointer;
    if (brick.open || !brick.published || !(brick.light_variance < light_variance)) continue;
    if (!brick.has_color()) {
      brick.light_variance = light_variance;
      continue;
    }
    follow_light(brick, light_ratio);
    brick.urgent = urgent = true;
    queue(brick);
  }
}

/// Copies a queued brick for publication if it has drifted.
void FusionLevel::State::copy_drifted(WorkingBrick& brick) const {
  std::optional<FieldBrick> with_model;
  if (!brick.now) brick.prepare_change(maker);  // nothing but a model
  if (brick.model) with_model = merge_model(*brick.now, *brick.model, voxel_m);
  const FieldBrick& result = with_model ? *with_model : *brick.now;
  const bool drifted = brick.urgent || brick.drifted(result, voxel_m);
  brick.queued = brick.urgent = false;
  if (!drifted) {
    if (scarce && !brick.model) brick.revert();
    return;
  }
  brick.publish(with_model ? maker.copy(result) : brick.now);
  brick.drift = WorkingBrick::kDriftUnknown;
  brick.copied = true;
}

void FusionLevel::State::publish() {
  const bool due = publication_due();
  if (!urgent && !(due && (new_viewpoint || !evicted.empty() || !publication_queue.empty()))) return;
  auto next = std::make_shared<DistanceField>(*field);
  next->version += 1;
  next->seen_from_m = seen_from_m;
  next->seen_space = seen_space;
  bool changed = new_viewpoint || !evicted.empty();
  for (const BrickKey& key : std::exchange(evicted, {})) next->bricks.erase(key);
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

FusionLevel::FusionLevel(const capture::Session& session, const FusionSettings& settings, const FusionScope& scope)
    : state_(std::make_unique<State>(session, settings, scope)) {}

FusionLevel::~FusionLevel() = default;

void FusionLevel::restore(BrickMap<FieldBrick> kept) { state_->restore(std::move(kept)); }

void FusionLevel::set_max_memory(double mb) { state_->set_max_memory(mb); }

std::shared_ptr<const DistanceField> FusionLevel::fuse(
    const capture::FrameSet& frame, const Pose& pose, double light_change,
    const std::function<Eigen::Array3f(const Eigen::Vector3f&)>& light_ratio) {
  State& s = *state_;
  s.light_variance += light_change * light_change;
  if (!frame.depth || pose.age_ns != 0) {
    if (s.field && light_change > 0 && light_ratio) {
      s.only_predicted = true;
      s.follow_light(light_ratio);
      s.publish();
    }
    return s.field;
  }
  if (frame.depth->depth_m.width != s.camera.width || frame.depth->depth_m.height != s.camera.height) return s.field;
  const bool same_pose = (pose.T_tag_camera.matrix() - s.last_pose.matrix()).cwiseAbs().maxCoeff() < kSamePose;
  const bool again =
      s.field && same_pose && same_depth(frame.depth, s.last_depth) && same_frame(frame.color, s.last_color);
  if (again && !s.unfinished) return s.field;
  s.begin_field();

  if (again)
    --s.frames;
  else
    s.preprocessor.prepare(frame.depth->depth_m, s.view);
  const Isometry3f T_tag_camera = pose.T_tag_camera.cast<float>();
  const Isometry3f T_camera_tag = pose.T_tag_camera.inverse().cast<float>();
  s.evict();
  if (!again) {
    if (s.scope.with_viewpoints) s.add_viewpoint(T_tag_camera);
    s.allocate(T_tag_camera);
  }
  if (!again && s.surfaces.any() && s.surfaces.register_models(frame.depth->depth_m, pose.T_tag_camera))
    s.update_models();
  const ColorLookup colour(frame.color_shows_room ? frame.color.get() : nullptr, s.response, s.camera.width,
                           s.camera.height, Eigen::Array3f::Map(frame.color_gain.data()), frame.color_vignetting.get());
  const BrickUpdate update(s.view, s.preprocessor, s.map, colour, T_camera_tag,
                           {s.voxel_m, s.truncation_m, s.weight_cap});
  const State::LightRatio ratio = light_change > 0 ? light_ratio : nullptr;
  // Colours that were only predicted since they were measured, while the lens was covered or no light was left, are
  // predicted back before they are measured again: a frame does not show all voxels of a brick.
  if (ratio && s.only_predicted) s.follow_light(ratio);
  const std::vector<VisibleBrick> visible = s.bricks_to_update(T_tag_camera, T_camera_tag);
  for (std::size_t i = 0; i < visible.size(); ++i) {
    if (i + 1 < visible.size() && visible[i + 1].visibility.kind == BrickVisibility::Kind::surface)
      update.prefetch(*visible[i + 1].brick, visible[i + 1].visibility);
    s.update_brick(update, visible[i], static_cast<bool>(colour), ratio);
  }
  if (ratio) s.follow_light(ratio);
  s.publish();
  ++s.frames;
  s.last_depth = frame.depth;
  s.last_color = frame.color;
  s.only_predicted = !colour;
  s.last_pose = pose.T_tag_camera;
  return s.field;
}

FusionMemory FusionLevel::memory() const {
  const State& s = *state_;
  return {s.field ? s.field->bricks.size() : 0, s.maker.used_bytes(), s.evicted_count};
}

std::vector<std::string> FusionLevel::warnings() const { return state_->surfaces.warnings(); }

}  // namespace lumigraft::reconstruct
