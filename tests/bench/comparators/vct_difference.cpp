#include "tests/bench/comparators/vct_difference.h"

#include <utility>

#include "capture/camera/srgb.h"

namespace lumigraft::comparators {
namespace {

constexpr double kMicrometre_m = 1e-6;
constexpr float kEmptyVoxels = 64;  // voxels along the room in a field without bricks, for a small index

/// The room is virtual: removes the session's known surfaces.
capture::Session without_surfaces(capture::Session session) {
  session.real_surfaces.clear();
  return session;
}

std::shared_ptr<const reconstruct::DistanceField> empty_field(const relight::Model& room) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : room.positions_m) box.extend(p);
  auto field = std::make_shared<reconstruct::DistanceField>();
  field->version = 1;
  field->voxel_m = box.sizes().maxCoeff() / kEmptyVoxels;
  return field;
}

relight::VirtualObject object_of(std::shared_ptr<const relight::Model> model, double shift_m) {
  relight::VirtualObject object;
  object.name = "room";
  object.model = std::move(model);
  object.position_m.z() = shift_m;
  return object;
}

}  // namespace

VctDifference::VctDifference(const std::shared_ptr<relight::gpu::Device>& device, const capture::Session& session,
                             std::shared_ptr<const relight::Model> room)
    : session_(without_surfaces(session)),
      nothing_(empty_field(*room)),
      room_(object_of(room, 0)),
      moved_room_(object_of(room, kMicrometre_m)),
      with_(device, session_),
      without_(device, session_) {}

capture::Image<float> VctDifference::with(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                          const relight::Exhibit& exhibit, const relight::Plan& plan) {
  relight::Exhibit all = exhibit;
  all.objects.push_back(room_);
  return drawn(with_, frame, scene, all, plan);
}

capture::Image<float> VctDifference::without(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                             const relight::Plan& plan) {
  return drawn(without_, frame, scene, relight::Exhibit{.objects = {moved_ ? moved_room_ : room_}}, plan);
}

void VctDifference::forget_without() { moved_ = !moved_; }

capture::Image<float> VctDifference::drawn(relight::Relighter& relighter, const capture::FrameSet& frame,
                                           const reconstruct::Scene& scene, const relight::Exhibit& exhibit,
                                           const relight::Plan& plan) const {
  capture::FrameSet seen = frame;
  seen.depth = nullptr;
  reconstruct::Scene empty = scene;
  empty.field = nothing_;
  empty.albedo = nullptr;
  const relight::RelitPicture picture = relighter.relight(seen, empty, exhibit, plan);
  capture::Image<float> radiance(picture.srgb.width, picture.srgb.height, 3);
  for (std::size_t i = 0; i < radiance.data.size(); ++i) {
    radiance.data[i] = capture::srgb_to_linear(static_cast<float>(picture.srgb.data[i]) / 255) /
                       static_cast<float>(session_.color.exposure);
  }
  return radiance;
}

}  // namespace lumigraft::comparators
