#include "reconstruct/fusion/real_surface.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "reconstruct/field/real_surface_field.h"
#include "reconstruct/fusion/depth_noise.h"
#include "reconstruct/pose/icp.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Isometry3f;
using Eigen::Vector3f;

constexpr float kBandVoxels = 3;      // around the mesh, as far as ICP reaches
constexpr float kFineness = 0.5f;     // voxels of models over those of the room: a plate may be thin
constexpr float kMergeVoxels = 2.5f;  // and as far as it is merged
constexpr float kAgreeVoxels = 1.5f;
constexpr float kModelWeight = 8;  // of a model: 1σ of 0.4 mm
constexpr float kMirrorRoughness = 0.3f, kMirrorMetallic = 0.5f;
constexpr int kColumns = 160;  // points in a row: a model may be small
constexpr int kFewest = 100;   // points that show a model
constexpr int kFewestOfMirror = 20;
constexpr int kPictures = 8;                              // that its place is the mean of
constexpr double kPlaceSigmaM = 0.01, kTurnSigma = 0.02;  // of what the session says
constexpr double kNotedM = 0.005, kNotedRad = 0.01;       // an offset worth a word
constexpr float kFarM = 5;
constexpr float kSurelyNoise = 3;  // σ

bool is_mirror(const capture::RealSurface& surface) {
  return surface.metallic >= kMirrorMetallic && surface.roughness < kMirrorRoughness;
}

std::string offset_text(const Isometry3d& offset) {
  char text[64];
  std::snprintf(text, sizeof text, "%.0f mm and %.1f degrees", 1e3 * offset.translation().norm(),
                Eigen::AngleAxisd(offset.linear()).angle() * 180 / M_PI);
  return text;
}

}  // namespace

RealSurfaces::RealSurfaces(const capture::Session& session, float voxel_m)
    : voxel_m_(voxel_m),
      step_(std::max(1, session.color.model.width / kColumns)),
      columns_(session.color.model.width / step_),
      rows_(session.color.model.height / step_) {
  for (const capture::RealSurface& surface : session.real_surfaces) {
    models_.push_back(
        {field_of(read_triangles(surface), kFineness * voxel_m, kBandVoxels * voxel_m), is_mirror(surface)});
    found_.push_back({surface.name});
  }
  for (int r = 0; r < rows_ && !models_.empty(); ++r)
    for (int c = 0; c < columns_; ++c) {
      const auto ray = session.color.model.unproject({c * step_ + step_ / 2 + 0.0, r * step_ + step_ / 2 + 0.0});
      rays_.push_back(ray && ray->z() > 0 ? Vector3f((*ray / ray->z()).cast<float>()) : Vector3f(Vector3f::Zero()));
    }
}

DepthGrid RealSurfaces::sample(const capture::Image<float>& depth_m) const {
  DepthGrid grid;
  grid.step = step_;
  grid.columns = columns_;
  grid.rows = rows_;
  grid.points.resize(rays_.size());
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const int at = static_cast<int>(i), u = at % columns_ * step_ + step_ / 2, v = at / columns_ * step_ + step_ / 2;
    const float depth = depth_m.at(u, v);
    if (!(depth > 0) || depth > kFarM) continue;
    grid.points[i].place = depth * rays_[i];
    grid.points[i].sigma_m = straight_sigma_m(1 / depth);
  }
  return grid;
}

/// What depth shows of a model: points on it, near enough for ICP, and pixels that see through where it should be.
struct RealSurfaces::Sight {
  DepthGrid near;
  int on = 0, through = 0;
};

RealSurfaces::Sight RealSurfaces::sight_of(const Model& model, const DepthGrid& grid,
                                           const Isometry3d& T_model_camera) const {
  Sight sight{grid};
  const Isometry3f T = T_model_camera.cast<float>();
  for (DepthGrid::Point& point : sight.near.points) {
    if (point.place.z() == 0) continue;
    const Vector3f way = T.linear() * point.place;
    const float length = way.norm();
    const auto slope = model.field.slope(T.translation() + way);
    const auto hit = model.field.raycast(T.translation(), way / length, 0.05f, length + kBandVoxels * voxel_m_);
    const float slack_m = kSurelyNoise * point.sigma_m + kAgreeVoxels * voxel_m_;
    // To the plane, not along the ray.
    const float behind_m = hit ? -(length - hit->distance_m) * hit->normal.dot(way) / length : 0;
    if (hit && behind_m > slack_m) ++sight.through;
    if (hit && std::abs(behind_m) <= slack_m) ++sight.on;
    if (!slope || !hit || std::abs(behind_m) > kBandVoxels * voxel_m_) point.place.z() = 0;
  }
  return sight;
}

bool RealSurfaces::look(const capture::Image<float>& depth_m, const Isometry3d& T_tag_camera) {
  bool changed = false;
  std::optional<DepthGrid> grid;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    Found& found = found_[m];
    if (found.state == State::refused || found.pictures >= kPictures) continue;
    if (!grid) grid = sample(depth_m);
    const Sight said = sight_of(models_[m], *grid, T_tag_camera);
    if (models_[m].mirror && said.on + said.through >= kFewestOfMirror) {
      // It shows no depth of its own: it is where the session says.
      found.state = State::used;
      found.pictures = kPictures;
      changed = true;
      continue;
    }
    PoseEstimate expected{T_tag_camera, PoseCovariance::Identity() * kPlaceSigmaM * kPlaceSigmaM};
    expected.covariance.bottomRightCorner<3, 3>().setIdentity();
    expected.covariance.bottomRightCorner<3, 3>() *= kTurnSigma * kTurnSigma;
    const auto fit = align_to_field(said.near, models_[m].field, expected);
    const Sight now = fit ? sight_of(models_[m], *grid, fit->pose.T_tag_camera) : said;
    if (now.on + now.through < kFewest) continue;
    if (now.through > now.on || !fit) {
      // Once found, it may be hidden for a while by what noise makes of it.
      if (found.state == State::unseen && now.through > now.on) {
        found.state = State::refused;
        changed = true;
      }
      continue;
    }
    const Isometry3d offset = T_tag_camera * fit->pose.T_tag_camera.inverse();
    ++found.pictures;
    const double share = 1.0 / found.pictures;
    const Eigen::Quaterniond turn(found.T_tag_model.linear());
    found.T_tag_model.translation() += share * (offset.translation() - found.T_tag_model.translation());
    found.T_tag_model.linear() = turn.slerp(share, Eigen::Quaterniond(offset.linear())).normalized().toRotationMatrix();
    found.state = State::used;
    changed = true;
  }
  return changed;
}

std::map<BrickKey, std::shared_ptr<const SurfaceBrick>> RealSurfaces::bricks() const {
  std::map<BrickKey, std::shared_ptr<SurfaceBrick>> bricks;
  const float edge_m = kBrickEdge * voxel_m_, model_edge_m = kFineness * edge_m;
  for (std::size_t m = 0; m < models_.size(); ++m) {
    if (found_[m].state != State::used) continue;
    const Isometry3f T_model_tag = found_[m].T_tag_model.inverse().cast<float>();
    const Isometry3f T_tag_model = T_model_tag.inverse();
    for (const auto& model_brick : models_[m].field.bricks) {
      const Vector3f first = model_edge_m * Eigen::Map<const Eigen::Vector3i>(model_brick.first.data()).cast<float>();
      // Where its corners come to lie in the tag's grid.
      Vector3f low = Vector3f::Constant(1e9f), high = -low;
      for (int corner = 0; corner < 8; ++corner) {
        const Vector3f at = T_tag_model * (first + model_edge_m * Vector3f(static_cast<float>(corner & 1),
                                                                           static_cast<float>((corner >> 1) & 1),
                                                                           static_cast<float>(corner >> 2)));
        low = low.cwiseMin(at);
        high = high.cwiseMax(at);
      }
      const Eigen::Vector3i from = (low / edge_m).array().floor().matrix().cast<int>();
      const Eigen::Vector3i to = (high / edge_m).array().floor().matrix().cast<int>();
      for (int z = from.z(); z <= to.z(); ++z)
        for (int y = from.y(); y <= to.y(); ++y)
          for (int x = from.x(); x <= to.x(); ++x) bricks.try_emplace({x, y, z});
    }
    for (auto& [key, brick] : bricks) {
      if (!brick) brick = std::make_shared<SurfaceBrick>();
      for (int i = 0; i < kBrickVoxels; ++i) {
        const Vector3f p = voxel_m_ * Vector3f(static_cast<float>(kBrickEdge * key[0] + i % 8),
                                               static_cast<float>(kBrickEdge * key[1] + i / 8 % 8),
                                               static_cast<float>(kBrickEdge * key[2] + i / 64));
        const auto sample = models_[m].field.sample(T_model_tag * p);
        if (!sample || std::abs(sample->distance_m) > kMergeVoxels * voxel_m_) continue;
        const auto at = static_cast<std::size_t>(i);
        if (brick->weight[at] > 0 && brick->distance_m[at] <= sample->distance_m) continue;
        brick->distance_m[at] = sample->distance_m;
        brick->weight[at] = kModelWeight;
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
    const Vector3f way = point_m - camera_m;
    const float length = way.norm();
    if (models_[m].field.raycast(camera_m, way / length, 0.05f, length)) return true;
  }
  return false;
}

std::vector<std::string> RealSurfaces::warnings() const {
  std::vector<std::string> warnings;
  for (const Found& found : found_) {
    if (found.state == State::refused)
      warnings.push_back("real surface \"" + found.name +
                         "\": depth goes through where the session says it is; it is not used");
    if (found.state != State::used) continue;
    const bool far = found.T_tag_model.translation().norm() > kNotedM ||
                     Eigen::AngleAxisd(found.T_tag_model.linear()).angle() > kNotedRad;
    if (far)
      warnings.push_back("real surface \"" + found.name + "\" lies " + offset_text(found.T_tag_model) +
                         " from where the session says");
  }
  return warnings;
}

FieldBrick merged(const FieldBrick& brick, const SurfaceBrick& model, float voxel_m) {
  FieldBrick result = brick;
  const float agree_m = kAgreeVoxels * voxel_m, front_m = model.mirror ? agree_m : 0;
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (model.weight[i] <= 0) continue;
    const float said = model.distance_m[i];
    float &distance_m = result.distance_m[i], &weight = result.weight[i];
    if (weight > 0 ? distance_m < said + agree_m : said > front_m) continue;
    distance_m = said;
    weight = model.weight[i];
  }
  return result;
}

}  // namespace lumigraft::reconstruct
