#include "reconstruct/fusion/real_surface.h"

#include <algorithm>
#include <cmath>

#include "capture/message_text.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/pose/icp.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Isometry3f;
using Eigen::Vector3f;

bool is_mirror(const capture::RealSurface& surface) {
  return surface.metallic >= kRealSurface.mirror_min_metallic && surface.roughness < kRealSurface.mirror_max_roughness;
}

}  // namespace

RealSurfaces::RealSurfaces(const capture::Session& session, float voxel_m)
    : voxel_m_(voxel_m),
      noise_(session.depth_noise()),
      step_(std::max(1, session.color.model.width / kRealSurface.columns)),
      columns_(session.color.model.width / step_),
      rows_(session.color.model.height / step_) {
  for (const capture::RealSurface& surface : session.real_surfaces) {
    models_.push_back(
        {field_of(read_triangles(surface), kRealSurface.model_voxel * voxel_m, kRealSurface.band_voxels * voxel_m),
         is_mirror(surface)});
    found_.push_back({surface.name});
  }
  for (int r = 0; r < rows_ && !models_.empty(); ++r)
    for (int c = 0; c < columns_; ++c) {
      const auto ray = session.color.model.unproject({c * step_ + step_ / 2 + 0.0, r * step_ + step_ / 2 + 0.0});
      rays_.push_back(ray && ray->z() > 0 ? Vector3f((*ray / ray->z()).cast<float>()) : Vector3f(Vector3f::Zero()));
    }
}

DepthGrid RealSurfaces::sample(const capture::Image<float>& depth_m) const {
  DepthGrid grid{
      .columns = columns_, .rows = rows_, .step = step_, .points = std::vector<DepthGrid::Point>(rays_.size())};
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const int at = static_cast<int>(i), u = at % columns_ * step_ + step_ / 2, v = at / columns_ * step_ + step_ / 2;
    const float depth = depth_m.at(u, v);
    if (!(depth > 0) || depth > kRealSurface.far_m) continue;
    grid.points[i].position = depth * rays_[i];
    const float inverse_depth = 1 / depth;
    grid.points[i].sigma_m = noise_.axial_sigma_m(1 / inverse_depth);  // rounded as where depth is stored inverted
  }
  return grid;
}

/// Observation of a model in a depth image.
struct RealSurfaces::Observation {
  DepthGrid near;           ///< points near enough to the model for ICP
  int on = 0, through = 0;  ///< rays that end on the model, and that pass through it
};

RealSurfaces::Observation RealSurfaces::observe(const Model& model, const DepthGrid& grid,
                                                const Isometry3d& T_model_camera) const {
  Observation result{grid};
  const Isometry3f T = T_model_camera.cast<float>();
  for (DepthGrid::Point& point : result.near.points) {
    if (point.position.z() == 0) continue;
    const Vector3f ray = T.linear() * point.position;
    const float length = ray.norm();
    const auto slope = model.field.slope(T.translation() + ray);
    const auto hit = model.field.raycast(T.translation(), ray / length, kRealSurface.min_range_m,
                                         length + kRealSurface.band_voxels * voxel_m_);
    const float slack_m = kRealSurface.noise_sigmas * point.sigma_m + kRealSurface.agree_voxels * voxel_m_;
    // Distance to the plane, not along the ray.
    const float behind_m = hit ? -(length - hit->distance_m) * hit->normal.dot(ray) / length : 0;
    if (hit && behind_m > slack_m) ++result.through;
    if (hit && std::abs(behind_m) <= slack_m) ++result.on;
    if (!slope || !hit || std::abs(behind_m) > kRealSurface.band_voxels * voxel_m_) point.position.z() = 0;
  }
  return result;
}

bool RealSurfaces::register_models(const capture::Image<float>& depth_m, const Isometry3d& T_tag_camera) {
  bool changed = false;
  std::optional<DepthGrid> grid;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    Found& found = found_[m];
    if (found.state == State::rejected || found.frames >= kRealSurface.max_frames) continue;
    if (!grid) grid = sample(depth_m);
    const Observation as_configured = observe(models_[m], *grid, T_tag_camera);
    if (models_[m].mirror && as_configured.on + as_configured.through >= kRealSurface.min_mirror_points) {
      // It has no depth of its own: the pose in the session is used.
      found.state = State::used;
      found.frames = kRealSurface.max_frames;
      changed = true;
      continue;
    }
    PoseEstimate expected{T_tag_camera,
                          PoseCovariance::Identity() * kRealSurface.prior_sigma_m * kRealSurface.prior_sigma_m};
    expected.covariance.bottomRightCorner<3, 3>().setIdentity();
    expected.covariance.bottomRightCorner<3, 3>() *= kRealSurface.prior_sigma_rad * kRealSurface.prior_sigma_rad;
    const auto fit = align_to_field(as_configured.near, models_[m].field, expected);
    const Observation aligned = fit ? observe(models_[m], *grid, fit->pose.T_tag_camera) : as_configured;
    if (aligned.on + aligned.through < kRealSurface.min_points) continue;
    if (aligned.through > aligned.on || !fit) {
      // A model that was found before is kept: noise may contradict it for some frames.
      if (found.state == State::unobserved && aligned.through > aligned.on) {
        found.state = State::rejected;
        changed = true;
      }
      continue;
    }
    const Isometry3d offset = T_tag_camera * fit->pose.T_tag_camera.inverse();
    ++found.frames;
    const double weight = 1.0 / found.frames;
    const Eigen::Quaterniond rotation(found.T_tag_model.linear());
    found.T_tag_model.translation() += weight * (offset.translation() - found.T_tag_model.translation());
    found.T_tag_model.linear() =
        rotation.slerp(weight, Eigen::Quaterniond(offset.linear())).normalized().toRotationMatrix();
    found.state = State::used;
    changed = true;
  }
  return changed;
}

std::map<BrickKey, std::shared_ptr<const SurfaceBrick>> RealSurfaces::bricks() const {
  std::map<BrickKey, std::shared_ptr<SurfaceBrick>> bricks;
  const float edge_m = kBrickEdge * voxel_m_, model_edge_m = kRealSurface.model_voxel * edge_m;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    if (found_[m].state != State::used) continue;
    const Isometry3f T_model_tag = found_[m].T_tag_model.inverse().cast<float>();
    const Isometry3f T_tag_model = T_model_tag.inverse();
    for (const auto& model_brick : models_[m].field.bricks) {
      const Vector3f first = model_edge_m * Eigen::Map<const Eigen::Vector3i>(model_brick.first.data()).cast<float>();
      // Bounding box of the model's brick in the tag frame.
      Eigen::AlignedBox3f box;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3i towards(corner & 1, (corner >> 1) & 1, corner >> 2);
        box.extend(T_tag_model * (first + model_edge_m * towards.cast<float>()));
      }
      const Eigen::Vector3i from = (box.min() / edge_m).array().floor().matrix().cast<int>();
      const Eigen::Vector3i to = (box.max() / edge_m).array().floor().matrix().cast<int>();
      for (int z = from.z(); z <= to.z(); ++z)
        for (int y = from.y(); y <= to.y(); ++y)
          for (int x = from.x(); x <= to.x(); ++x) bricks.try_emplace({x, y, z});
    }
    for (auto& [key, brick] : bricks) {
      if (!brick) brick = std::make_shared<SurfaceBrick>();
      for (int i = 0; i < kBrickVoxels; ++i) {
        const Vector3f p = voxel_m_ * voxel_in(key, i).cast<float>();
        const auto sample = models_[m].field.sample(T_model_tag * p);
        if (!sample || std::abs(sample->distance_m) > kRealSurface.merge_voxels * voxel_m_) continue;
        const auto at = static_cast<std::size_t>(i);
        if (brick->weight[at] > 0 && brick->distance_m[at] <= sample->distance_m) continue;
        brick->distance_m[at] = sample->distance_m;
        brick->weight[at] = kRealSurface.model_weight;
        brick->mirror |= models_[m].mirror;
      }
    }
  }
  std::map<BrickKey, std::shared_ptr<const SurfaceBrick>> result;
  for (auto& [key, brick] : bricks)
    if (*std::max_element(brick->weight.begin(), brick->weight.end()) > 0) result.emplace(key, std::move(brick));
  return result;
}

bool RealSurfaces::behind_mirror(const Vector3f& camera_m, const Vector3f& point_m) const {
  for (std::size_t m = 0; m < models_.size(); ++m) {
    if (!models_[m].mirror || found_[m].state != State::used) continue;
    const Vector3f ray = point_m - camera_m;
    const float length = ray.norm();
    if (models_[m].field.raycast(camera_m, ray / length, kRealSurface.min_range_m, length)) return true;
  }
  return false;
}

std::vector<std::string> RealSurfaces::warnings() const {
  std::vector<std::string> warnings;
  for (const Found& found : found_) {
    if (found.state == State::rejected)
      warnings.push_back("real surface \"" + found.name +
                         "\": depth shows no surface at its pose in the session; it is not used");
    if (found.state != State::used) continue;
    const double offset_m = found.T_tag_model.translation().norm();
    const double offset_rad = Eigen::AngleAxisd(found.T_tag_model.linear()).angle();
    if (offset_m > kRealSurface.warn_offset_m || offset_rad > kRealSurface.warn_offset_rad)
      warnings.push_back(
          capture::formatted("real surface \"%s\" is %.0f mm and %.1f degrees from its pose in the session",
                             found.name.c_str(), 1e3 * offset_m, offset_rad * 180 / M_PI));
  }
  return warnings;
}

FieldBrick merge_model(const FieldBrick& brick, const SurfaceBrick& model, float voxel_m) {
  FieldBrick result = brick;
  const float agree_m = kRealSurface.agree_voxels * voxel_m, front_m = model.mirror ? agree_m : 0;
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (model.weight[i] <= 0) continue;
    const float model_m = model.distance_m[i];
    float &distance_m = result.distance_m[i], &weight = result.weight[i];
    if (weight > 0 ? distance_m < model_m + agree_m : model_m > front_m) continue;
    distance_m = model_m;
    weight = model.weight[i];
  }
  return result;
}

}  // namespace lumigraft::reconstruct
