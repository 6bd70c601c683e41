#include "server/truth/oracle.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <utility>

#include "capture/camera/radiance.h"
#include "capture/error.h"
#include "server/truth/parameters.h"

namespace lumigraft::server {
namespace {

/// Bilinear interpolation of the picture, as fusion samples radiance; the nearest pixel where the four neighbours show
/// several surfaces. Empty where its depth differs from `z_m` by more than `same_m`.
std::optional<Eigen::Vector3f> picture_at(const capture::Image<float>& picture, const capture::Image<float>& depth_m,
                                          const Eigen::Vector2d& pixel, double z_m, double same_m) {
  const auto shows = [&](int u, int v) { return std::abs(depth_m.at(u, v) - z_m) <= same_m; };
  const auto color = [&](int u, int v) -> Eigen::Vector3f {
    return {picture.at(u, v, 0), picture.at(u, v, 1), picture.at(u, v, 2)};
  };
  const int u = static_cast<int>(std::floor(pixel.x())), v = static_cast<int>(std::floor(pixel.y()));
  if (u >= 0 && v >= 0 && u + 1 < picture.width && v + 1 < picture.height && shows(u, v) && shows(u + 1, v) &&
      shows(u, v + 1) && shows(u + 1, v + 1)) {
    const auto a = static_cast<float>(pixel.x() - u), b = static_cast<float>(pixel.y() - v);
    return (1 - b) * ((1 - a) * color(u, v) + a * color(u + 1, v)) +
           b * ((1 - a) * color(u, v + 1) + a * color(u + 1, v + 1));
  }
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  return shows(x, y) ? std::optional(color(x, y)) : std::nullopt;
}

reconstruct::PointLight true_light(const TrueLamp& lamp, const Eigen::Vector3d& probe_m) {
  reconstruct::PointLight light;
  const Eigen::Vector3d to_lamp = lamp.centre_m - probe_m;
  const double distance_m = to_lamp.norm();
  light.direction = (to_lamp / distance_m).cast<float>();
  light.irradiance = (lamp.radiance * (lamp.seen_area_m2(probe_m) / (distance_m * distance_m))).cast<float>();
  light.distance_known = true;
  light.position_m = lamp.centre_m.cast<float>();
  light.intensity = (lamp.radiance * lamp.seen_area_m2(probe_m)).cast<float>();
  light.radius_m = static_cast<float>(lamp.radius_m);
  light.flat = !lamp.normal.isZero() && light.intensity.maxCoeff() > 0;
  if (light.flat) light.normal = lamp.normal.cast<float>();
  light.angular_radius_rad = static_cast<float>(std::atan(lamp.radius_m / distance_m));
  return light;
}

std::shared_ptr<const capture::Frame> fisheye_frame(const capture::FrameSet& frame, capture::Image<float> radiance) {
  auto picture = std::make_shared<capture::Frame>();
  picture->stamp.time_ns = frame.time_ns;
  picture->stream = capture::Stream::fisheye;
  picture->radiance = std::move(radiance);
  return picture;
}

}  // namespace

OracleParts parse_oracle_parts(const std::string& list) {
  OracleParts parts;
  std::istringstream names(list);
  for (std::string name; std::getline(names, name, ',');) {
    const auto part =
        std::find_if(kOracleParts.begin(), kOracleParts.end(), [&](const auto& p) { return name == p.first; });
    capture::refuse_if(part == kOracleParts.end(),
                       "--oracle: found \"" + name + "\", allowed: pose, geometry, light, albedo, with commas between");
    parts.*part->second = true;
  }
  return parts;
}

std::string name_of(const OracleParts& parts) {
  std::string name;
  for (const auto& [part, taken] : kOracleParts) {
    if (parts.*taken) name += (name.empty() ? "" : "+") + std::string(part);
  }
  return name.empty() ? "none" : name;
}

reconstruct::Illumination with_true_lamps(const reconstruct::Illumination& split, const std::vector<TrueLamp>& lamps,
                                          const std::vector<reconstruct::PointLight>& far,
                                          const capture::FisheyeCamera& fisheye) {
  reconstruct::Illumination result = split;
  const Eigen::Vector3d probe_m = split.probe_position_m.cast<double>();
  int next_id = 0;
  for (const reconstruct::PointLight& light : split.lights) next_id = std::max(next_id, light.id + 1);
  const auto add_if_out_of_view = [&](reconstruct::PointLight light) {
    const Eigen::Vector3d seen_along = fisheye.T_tag_fisheye.rotation().transpose() * light.direction.cast<double>();
    const std::optional<Eigen::Vector2d> pixel = fisheye.model.project(seen_along);
    if (pixel && fisheye.model.inside(*pixel)) return;
    light.id = next_id++;
    result.lights.push_back(light);
  };
  for (const TrueLamp& lamp : lamps) {
    reconstruct::PointLight light = true_light(lamp, probe_m);
    const auto shows_it = [&](const reconstruct::PointLight& found) {
      const float angle_rad = std::acos(std::clamp(found.direction.dot(light.direction), -1.0f, 1.0f));
      return !found.distance_known && angle_rad < light.angular_radius_rad + kTruth.same_lamp_rad;
    };
    const auto found = std::find_if(result.lights.begin(), result.lights.end(), shows_it);
    if (found != result.lights.end()) {
      light.id = found->id;
      light.outline_u = found->outline_u;
      light.outline_v = found->outline_v;
      std::erase_if(result.lights, shows_it);
      result.lights.push_back(light);
      continue;
    }
    add_if_out_of_view(light);
  }
  for (const reconstruct::PointLight& lamp : far) add_if_out_of_view(lamp);
  std::ranges::stable_sort(result.lights, std::greater(),
                           [](const reconstruct::PointLight& light) { return light.irradiance.sum(); });
  return result;
}

Oracle::Oracle(const capture::Session& session, const OracleParts& parts)
    : session_(session), parts_(parts), light_(session) {
  if (parts.pose) read_true_pose(file(0, "pose.json"));
  if (parts.geometry) {
    read_true_depth(file(0, "depth.exr"));
    const std::filesystem::path room = session.folder / "truth" / "real_scene.ply";
    if (std::filesystem::exists(room)) surface_.emplace(room);
  }
  if (parts.light) {
    read_true_lamps(file(0, "lights.json"));
    capture::refuse_if(!session.fisheye,
                       "--oracle light: " + session.name + " has no [fisheye], allowed: a session with one");
    if (read_true_sky(file(0, "lights.json")).is_picture) environment_.emplace(session);
  }
  if (parts.albedo) {
    read_true_picture(file(0, "albedo.exr"));
    read_true_depth(file(0, "depth.exr"));
  }
}

std::filesystem::path Oracle::file(std::uint64_t index, const char* name) const {
  return truth_folder(session_.folder, index) / name;
}

reconstruct::Pose Oracle::pose(const capture::FrameSet& frame) const {
  reconstruct::Pose pose;
  pose.T_tag_camera = read_true_pose(file(frame.index, "pose.json"));
  pose.T_tag_camera_raw = pose.T_tag_camera;
  pose.time_ns = frame.time_ns;
  return pose;
}

capture::FrameSet Oracle::with_true_depth(const capture::FrameSet& frame) const {
  capture::FrameSet with = frame;
  const std::filesystem::path path = file(frame.index, "depth.exr");
  if (!std::filesystem::exists(path)) {
    with.depth = nullptr;
    return with;
  }
  auto depth = std::make_shared<capture::DepthFrame>();
  depth->stamp = frame.depth ? frame.depth->stamp : frame.color->stamp;
  depth->depth_m = read_true_depth(path);
  const capture::CameraModel& camera = session_.color.model;
  capture::refuse_if(depth->depth_m.width != camera.width || depth->depth_m.height != camera.height,
                     path.string() + ": not of the colour picture's size");
  with.depth = std::move(depth);
  return with;
}

/// The fish-eye picture to extract light from; see Oracle::illumination.
capture::FisheyeFrames Oracle::fisheye(const capture::FrameSet& frame) const {
  capture::FisheyeFrames frames = frame.fisheye;
  for (const std::uint64_t index :
       {frame.index, std::uint64_t{0}}) {  // the fish-eye's truth may exist for frame 0 only
    const std::filesystem::path path = file(index, "fisheye.exr");
    if (std::filesystem::exists(path)) {
      frames = {fisheye_frame(frame, read_true_picture(path))};
      break;
    }
  }
  if (!environment_ || frames.empty()) return frames;
  capture::RadianceImage picture = capture::merge_bracket(frames, session_.fisheye->response);
  if (picture.clipped_fraction == 0) return frames;
  if (frames.front()->radiance.empty()) {
    capture::undo_vignetting(picture, capture::vignetting_gain(session_.fisheye->vignetting, session_.fisheye->model));
  }
  environment_->complete(picture);
  return {fisheye_frame(frame, std::move(picture.radiance))};
}

std::shared_ptr<const reconstruct::Illumination> Oracle::illumination(const capture::FrameSet& frame) {
  capture::FrameSet lit = frame;
  lit.fisheye = fisheye(frame);
  const std::shared_ptr<const reconstruct::Illumination> split = light_.extract(lit).illumination;
  if (!split) return nullptr;
  const std::vector<reconstruct::PointLight> far =
      environment_ ? environment_->lamps() : std::vector<reconstruct::PointLight>{};
  return std::make_shared<const reconstruct::Illumination>(
      with_true_lamps(*split, read_true_lamps(file(frame.index, "lights.json")), far, *session_.fisheye));
}

std::shared_ptr<const reconstruct::Enclosure> Oracle::enclosure(const reconstruct::Illumination& light) const {
  if (!surface_) return nullptr;
  const std::optional<reconstruct::Enclosure> room =
      reconstruct::close_room(surface_->seen_from(light.probe_position_m), light, {});
  return room ? std::make_shared<const reconstruct::Enclosure>(*room) : nullptr;
}

std::shared_ptr<const reconstruct::AlbedoField> Oracle::albedo(const capture::FrameSet& frame,
                                                               const reconstruct::Pose& pose,
                                                               const reconstruct::DistanceField& field) {
  auto next =
      albedo_ ? std::make_shared<reconstruct::AlbedoField>(*albedo_) : std::make_shared<reconstruct::AlbedoField>();
  const std::filesystem::path path = file(frame.index, "albedo.exr");
  if (albedo_ && !std::filesystem::exists(path)) return albedo_;
  const capture::Image<float> albedo = read_true_picture(path);
  const capture::Image<float> depth_m = read_true_depth(file(frame.index, "depth.exr"));
  const capture::CameraModel& camera = session_.color.model;
  const Eigen::Isometry3d T_camera_tag = pose.T_tag_camera.inverse();
  next->voxel_m = field.voxel_m;
  ++next->version;
  for (const auto& [key, brick] : field.bricks) {
    std::shared_ptr<reconstruct::AlbedoBrick> seen;
    for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
      if (brick->weight[i] <= 0 || std::abs(brick->distance_m[i]) > kTruth.band_voxels * field.voxel_m) continue;
      const Eigen::Vector3d p = T_camera_tag * (field.voxel_m * reconstruct::voxel_in(key, i).cast<double>());
      const std::optional<Eigen::Vector2d> pixel = p.z() > 0 ? camera.project(p) : std::nullopt;
      if (!pixel || !camera.inside(*pixel)) continue;
      const std::optional<Eigen::Vector3f> seen_albedo =
          picture_at(albedo, depth_m, *pixel, p.z(), kTruth.same_surface_voxels * field.voxel_m);
      if (!seen_albedo) continue;
      if (!seen) {
        const auto before = next->bricks.find(key);
        seen = before != next->bricks.end() ? std::make_shared<reconstruct::AlbedoBrick>(*before->second)
                                            : std::make_shared<reconstruct::AlbedoBrick>();
        if (before == next->bricks.end()) seen->sigma.fill(-1.0f);
      }
      seen->albedo[i] = *seen_albedo;
      seen->sigma[i] = kTruth.albedo_sigma;
    }
    if (seen) next->bricks[key] = std::move(seen);
  }
  albedo_ = next;
  return next;
}

reconstruct::SceneOverrides overrides_of(const std::shared_ptr<Oracle>& oracle) {
  reconstruct::SceneOverrides overrides;
  if (!oracle) return overrides;
  const OracleParts parts = oracle->parts();
  if (parts.pose) overrides.pose = [oracle](const capture::FrameSet& frame) { return oracle->pose(frame); };
  if (parts.geometry) {
    overrides.frame = [oracle](const capture::FrameSet& frame) { return oracle->with_true_depth(frame); };
    overrides.enclosure = [oracle](const reconstruct::Illumination& light) { return oracle->enclosure(light); };
  }
  if (parts.light) overrides.light = [oracle](const capture::FrameSet& frame) { return oracle->illumination(frame); };
  if (parts.albedo) {
    overrides.albedo = [oracle](const capture::FrameSet& frame, const reconstruct::Pose& pose,
                                const reconstruct::DistanceField& field) { return oracle->albedo(frame, pose, field); };
  }
  return overrides;
}

}  // namespace lumigraft::server
