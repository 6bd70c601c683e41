#include "reconstruct/fusion/fusion.h"

#include <algorithm>
#include <limits>

#include "reconstruct/fusion/fusion_level.h"

namespace lumigraft::reconstruct {
namespace {

/// Whether the image shows so much beyond `far_m` that it is worth a coarse field.
bool shows_far_surfaces(const capture::Image<float>& depth_m, double far_m) {
  std::size_t pixels = 0, far = 0;
  for (std::size_t i = 0; i < depth_m.data.size(); i += kCoarse.pixel_step) {
    const float depth = depth_m.data[i];
    ++pixels;
    far += depth > static_cast<float>(far_m) && depth <= kCoarse.far_m ? 1 : 0;
  }
  return static_cast<float>(far) > kCoarse.min_fraction * static_cast<float>(pixels);
}

FusionScope fine_scope(const FusionSettings& settings) {
  return {{0, static_cast<float>(settings.far_m)},
          std::max(static_cast<float>(settings.far_m), kCoarse.far_m),
          kUpdateSchedule.max_bricks,
          true,
          true};
}

}  // namespace

struct FusionStage::State {
  State(const capture::Session& in, const FusionSettings& the_settings)
      : session(in), settings(the_settings), fine(in, the_settings, fine_scope(the_settings)) {}

  void begin_coarse();
  void share_memory();
  void fuse_coarse(const capture::FrameSet& frame, const Pose& pose, double light_change,
                   const std::function<Eigen::Array3f(const Eigen::Vector3f&)>& light_ratio);

  capture::Session session;
  FusionSettings settings;
  FusionLevel fine;
  std::unique_ptr<FusionLevel> coarse;  ///< null until a frame shows far surfaces
  std::shared_ptr<const capture::DepthFrame> last_depth;
  std::uint32_t frames = 0;  ///< since there is a coarse level
  bool due = false;          ///< the last frame is one of those that are fused coarsely
  std::shared_ptr<const DistanceField> fine_field, coarse_field, field;
};

void FusionStage::State::begin_coarse() {
  capture::Session without_models = session;
  without_models.real_surfaces.clear();
  FusionSettings coarser = settings;
  coarser.voxel_m *= kCoarse.voxels;
  const FusionScope scope{{static_cast<float>(settings.far_m) - kCoarse.overlap_m, kCoarse.far_m},
                          kCoarse.far_m,
                          kCoarse.max_bricks,
                          false,
                          false};
  coarse = std::make_unique<FusionLevel>(without_models, coarser, scope);
}

/// What the fine bricks in view still take of the coarse share goes first from the coarse level.
void FusionStage::State::share_memory() {
  const double share_mb = kCoarse.memory * settings.max_memory_mb;
  fine.set_max_memory(settings.max_memory_mb - share_mb);
  coarse->set_max_memory(
      std::min(share_mb, settings.max_memory_mb - 1e-6 * static_cast<double>(fine.memory().used_bytes)));
}

void FusionStage::State::fuse_coarse(const capture::FrameSet& frame, const Pose& pose, double light_change,
                                     const std::function<Eigen::Array3f(const Eigen::Vector3f&)>& light_ratio) {
  if (frame.depth && frame.depth != last_depth) {
    last_depth = frame.depth;
    const bool measured = pose.age_ns == 0;
    if (!coarse && measured && shows_far_surfaces(frame.depth->depth_m, settings.far_m)) begin_coarse();
    due = coarse && frames++ % kCoarse.interval_frames == 0;
  }
  if (!coarse || !(due || light_change > 0)) return;
  share_memory();
  coarse_field = coarse->fuse(frame, pose, light_change, light_ratio);
}

FusionStage::FusionStage(const capture::Session& session, const FusionSettings& settings)
    : state_(std::make_unique<State>(session, settings)) {}

FusionStage::~FusionStage() = default;

std::shared_ptr<const DistanceField> FusionStage::fuse(
    const capture::FrameSet& frame, const Pose& pose, double light_change,
    const std::function<Eigen::Array3f(const Eigen::Vector3f&)>& light_ratio) {
  State& s = *state_;
  const std::shared_ptr<const DistanceField> fine_before = s.fine_field, coarse_before = s.coarse_field;
  s.fine_field = s.fine.fuse(frame, pose, light_change, light_ratio);
  s.fuse_coarse(frame, pose, light_change, light_ratio);
  if (!s.fine_field || !s.coarse_field) return s.field = s.fine_field;
  if (s.fine_field == fine_before && s.coarse_field == coarse_before) return s.field;
  auto both = std::make_shared<DistanceField>(*s.fine_field);
  both->version += s.coarse_field->version;
  both->coarse = s.coarse_field;
  return s.field = both;
}

void FusionStage::restore(DistanceField kept) {
  State& s = *state_;
  if (kept.coarse && !kept.coarse->bricks.empty()) {
    if (!s.coarse) s.begin_coarse();
    s.share_memory();
    s.coarse->restore(kept.coarse->bricks);
  }
  s.fine.restore(std::move(kept.bricks));
}

FusionStage::Memory FusionStage::memory() const {
  Memory memory = state_->fine.memory();
  if (!state_->coarse) return memory;
  const Memory coarse = state_->coarse->memory();
  return {memory.bricks + coarse.bricks, memory.used_bytes + coarse.used_bytes, memory.evicted + coarse.evicted};
}

std::vector<std::string> FusionStage::warnings() const { return state_->fine.warnings(); }

}  // namespace lumigraft::reconstruct
