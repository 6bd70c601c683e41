#include "relight/objects/standing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "relight/objects/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

struct Shape {
  Vector3f low, high;  ///< of the whole object: along two horizontal axes and up
  Vector3f foot_low, foot_high;
};

Shape shape_of(const std::vector<Vector3f>& points) {
  Shape s;
  s.low = s.foot_low.setConstant(std::numeric_limits<float>::infinity());
  s.high = s.foot_high.setConstant(-std::numeric_limits<float>::infinity());
  for (const Vector3f& p : points) {
    s.low = s.low.cwiseMin(p);
    s.high = s.high.cwiseMax(p);
  }
  const float foot_m = s.low.z() + kObjects.foot_height * (s.high.z() - s.low.z());
  for (const Vector3f& p : points) {
    if (p.z() > foot_m) continue;
    s.foot_low = s.foot_low.cwiseMin(p);
    s.foot_high = s.foot_high.cwiseMax(p);
  }
  return s;
}

/// By how much an object at this place is to be raised.
std::optional<float> raise_onto(const reconstruct::DistanceField& field, const Model& model,
                                const Eigen::Affine3d& T_tag_model, const Vector3f& place_m, const Vector3f& up) {
  const Eigen::Matrix3f R_tag_level = Eigen::Quaternionf::FromTwoVectors(Vector3f::UnitZ(), up).toRotationMatrix();
  const Eigen::Affine3f T_level_model = R_tag_level.transpose() * T_tag_model.cast<float>();
  std::vector<Vector3f> points;
  for (const Vector3f& p : model.positions_m) points.push_back(T_level_model * p);
  const Shape shape = shape_of(points);
  const float from_height_m = up.dot(place_m) + shape.high.z() - shape.low.z();
  const auto across = static_cast<float>(kObjects.foot_rays);
  std::vector<float> heights_m;
  for (int j = 0; j < kObjects.foot_rays; ++j) {
    for (int i = 0; i < kObjects.foot_rays; ++i) {
      const Eigen::Vector2f at((static_cast<float>(i) + 0.5f) / across, (static_cast<float>(j) + 0.5f) / across);
      const Eigen::Vector2f xy =
          shape.foot_low.head<2>() + (at.array() * (shape.foot_high - shape.foot_low).head<2>().array()).matrix();
      const Vector3f from_m = R_tag_level * Vector3f(xy.x(), xy.y(), from_height_m);
      const float far_m = shape.high.z() - shape.low.z() + Standing::kMaxDrop_m;
      if (const auto hit = field.raycast(from_m, -up, 0, far_m)) heights_m.push_back(up.dot(hit->position_m));
    }
  }
  if (heights_m.size() < kObjects.min_foot_rays) return std::nullopt;
  const auto middle = heights_m.begin() + static_cast<std::ptrdiff_t>(heights_m.size() / 2);
  std::ranges::nth_element(heights_m, middle);
  return *middle - shape.low.z();
}

}  // namespace

Exhibit Standing::placed(Exhibit exhibit, const reconstruct::DistanceField* field, const Eigen::Vector3f& up,
                         double time_s) {
  for (VirtualObject& object : exhibit.objects) {
    if (!object.stands || !object.model) continue;
    Held& held = held_[object.name];
    const Eigen::Affine3d T_tag_model = object.T_tag_model(time_s);
    const Vector3f place_m = (T_tag_model * object.origin_m).cast<float>();
    const bool same_place = held.model == object.model.get() && held.T_tag_model.isApprox(T_tag_model);
    if (field && (!same_place || held.field_version != field->version)) {
      const std::optional<float> raised_m = raise_onto(*field, *object.model, T_tag_model, place_m, up);
      if (!same_place)
        held.raised_m = raised_m.value_or(0);
      else if (raised_m && std::abs(*raised_m - held.raised_m) > 0.5f * field->voxel_m)
        held.raised_m = *raised_m;
      held.T_tag_model = T_tag_model;
      held.model = object.model.get();
      held.field_version = field->version;
    }
    const Eigen::Vector3d raise_m = (held.raised_m * up).cast<double>();
    object.position_m += raise_m;
    for (KeyFrame& key : object.motion) key.position_m += raise_m;
  }
  return exhibit;
}

}  // namespace lumigraft::relight
