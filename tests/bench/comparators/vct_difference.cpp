#include "tests/bench/comparators/vct_difference.h"

#include <utility>

#include "capture/camera/response.h"

namespace lumigraft::comparators {
namespace {

constexpr double kMicrometre_m = 1e-6;
constexpr float kEmptyVoxels = 64;  // along the room, of a field without bricks: its index stays small

/// The room is virtual: nothing is known by other ways.
Session without_surfaces(Session session) {
  session.real_surfaces.clear();
  return session;
}

std::shared_ptr<const DistanceField> empty_field(const Model& room) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : room.positions_m) box.extend(p);
  auto field = std::make_shared<DistanceField>();
  field->version = 1;
  field->voxel_m = box.sizes().maxCoeff() / kEmptyVoxels;
  return field;
}

VirtualObject object_of(std::shared_ptr<const Model> model, double shift_m) {
  VirtualObject object;
  object.name = "room";
  object.model = std::move(model);
  object.position_m.z() = shift_m;
  return object;
}

}  // namespace

VctDifference::VctDifference(const std::shared_ptr<gpu::Device>& device, const Session& session,
                             std::shared_ptr<const Model> room)
    : session_(without_surfaces(session)),
      nothing_(empty_field(*room)),
      room_(object_of(room, 0)),
      moved_room_(object_of(room, kMicrometre_m)),
      with_(device, session_),
      without_(device, session_) {}

Image<float> VctDifference::with(const FrameSet& frame, const Scene& scene, const Exhibit& exhibit, const Plan& plan) {
  Exhibit all = exhibit;
  all.objects.push_back(room_);
  return drawn(with_, frame, scene, all, plan);
}

Image<float> VctDifference::without(const FrameSet& frame, const Scene& scene, const Plan& plan) {
  return drawn(without_, frame, scene, Exhibit{.objects = {moved_ ? moved_room_ : room_}}, plan);
}

void VctDifference::forget_without() { moved_ = !moved_; }

Image<float> VctDifference::drawn(Relighter& relighter, const FrameSet& frame, const Scene& scene,
                                  const Exhibit& exhibit, const Plan& plan) const {
  FrameSet seen = frame;
  seen.depth = nullptr;
  Scene empty = scene;
  empty.field = nothing_;
  empty.albedo = nullptr;
  const RelitPicture picture = relighter.relight(seen, empty, exhibit, plan);
  Image<float> radiance(picture.srgb.width, picture.srgb.height, 3);
  for (std::size_t i = 0; i < radiance.data.size(); ++i) {
    radiance.data[i] =
        srgb_to_linear(static_cast<float>(picture.srgb.data[i]) / 255) / static_cast<float>(session_.color.exposure);
  }
  return radiance;
}

}  // namespace lumigraft::comparators
