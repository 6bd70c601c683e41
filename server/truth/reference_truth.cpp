#include "server/truth/reference_truth.h"

#include <algorithm>

#include "capture/error.h"
#include "relight/objects/closest_point.h"
#include "relight/tracing/build_trace_scene.h"
#include "server/truth/parameters.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

void expect_size(const capture::CameraModel& camera, const capture::Image<float>& image,
                 const std::filesystem::path& path) {
  capture::refuse_if(image.width != camera.width || image.height != camera.height,
                     path.string() + ": not of the colour picture's size");
}

relight::SeenMaterials read_seen(const std::filesystem::path& folder, const capture::CameraModel& camera) {
  relight::SeenMaterials seen;
  seen.camera = camera;
  seen.T_camera_tag = read_true_pose(folder / "pose.json").inverse().cast<float>();
  seen.depth_m = read_true_depth(folder / "depth.exr");
  seen.diffuse = read_true_picture(folder / "albedo.exr");
  seen.f0 = read_true_picture(folder / "f0.exr");
  seen.alpha = read_true_depth(folder / "roughness.exr");
  expect_size(camera, seen.depth_m, folder / "depth.exr");
  expect_size(camera, seen.diffuse, folder / "albedo.exr");
  expect_size(camera, seen.f0, folder / "f0.exr");
  expect_size(camera, seen.alpha, folder / "roughness.exr");
  return seen;
}

/// Groups the model's triangles by known surface; the last group holds the others.
std::vector<std::vector<std::uint32_t>> grouped(const relight::Model& model,
                                                const std::vector<relight::KnownSurface>& known) {
  std::vector<std::unique_ptr<relight::ObjectSurface>> surfaces;
  for (const relight::KnownSurface& surface : known) {
    surfaces.push_back(std::make_unique<relight::ObjectSurface>(*surface.model));
  }
  std::vector<std::vector<std::uint32_t>> groups(known.size() + 1);
  for (std::size_t i = 0; i < model.indices.size(); i += 3) {
    const Eigen::Vector3f &a = model.positions_m[model.indices[i]], &b = model.positions_m[model.indices[i + 1]],
                          &c = model.positions_m[model.indices[i + 2]], middle = (a + b + c) / 3;
    const auto found = std::find_if(surfaces.begin(), surfaces.end(), [&](const auto& surface) {
      return surface->nearest(a, kTruth.same_surface_m) && surface->nearest(b, kTruth.same_surface_m) &&
             surface->nearest(c, kTruth.same_surface_m) && surface->nearest(middle, kTruth.same_surface_m);
    });
    auto& group = groups[static_cast<std::size_t>(found - surfaces.begin())];
    group.insert(group.end(), model.indices.begin() + static_cast<std::ptrdiff_t>(i),
                 model.indices.begin() + static_cast<std::ptrdiff_t>(i) + 3);
  }
  return groups;
}

std::vector<relight::ReferenceMesh> read_meshes(const capture::Session& session) {
  const std::shared_ptr<const relight::Model> all =
      relight::load_model(session.folder / "truth" / "real_scene.ply", 'z');
  const std::vector<relight::KnownSurface> known = relight::known_surfaces(session.real_surfaces);
  const std::vector<std::vector<std::uint32_t>> groups = grouped(*all, known);
  std::vector<relight::ReferenceMesh> meshes;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (groups[i].empty()) continue;
    auto model = std::make_shared<relight::Model>(*all);
    model->indices = groups[i];
    model->parts.assign(1, {});
    model->parts[0].material = {Eigen::Vector3f::Ones(), 0, 1, 0};
    model->parts[0].index_count = static_cast<std::uint32_t>(groups[i].size());
    relight::ReferenceMesh mesh;
    mesh.model = std::move(model);
    if (i < known.size()) mesh.material = known[i].material;
    mesh.seen = i == known.size();
    meshes.push_back(std::move(mesh));
  }
  return meshes;
}

relight::ReferenceLamp lamp_of(const TrueLamp& truth) {
  relight::ReferenceLamp lamp;
  lamp.centre_m = truth.centre_m.cast<float>();
  lamp.radiance = truth.radiance.cast<float>().array();
  lamp.radius_m = static_cast<float>(truth.radius_m);
  if (truth.normal.isZero()) return lamp;
  lamp.normal = truth.normal.cast<float>();
  lamp.shape = relight::ReferenceLamp::Shape::disc;
  if (!truth.size_m.isZero()) {
    lamp.shape = relight::ReferenceLamp::Shape::rectangle;
    // Truth gives only the normal: the first edge is horizontal, along x for a horizontal lamp.
    const Eigen::Vector3d level = Eigen::Vector3d::UnitZ().cross(truth.normal);
    const Eigen::Vector3d u = level.norm() > 1e-3 ? level.normalized() : Eigen::Vector3d::UnitX();
    lamp.half_u_m = (0.5 * truth.size_m.x() * u).cast<float>();
    lamp.half_v_m = (0.5 * truth.size_m.y() * truth.normal.cross(u).normalized()).cast<float>();
  }
  return lamp;
}

}  // namespace

TrueRoom::TrueRoom(const capture::Session& session) : session_(session), meshes_(read_meshes(session)) {
  take(truth_folder(session.folder, 0));
}

void TrueRoom::take(const std::filesystem::path& folder) {
  auto next = std::make_shared<relight::ReferenceScene>();
  next->real = meshes_;
  for (const TrueLamp& lamp : read_true_lamps(folder / "lights.json")) next->lamps.push_back(lamp_of(lamp));
  const TrueSky sky = read_true_sky(folder / "lights.json");
  next->background = sky.constant.cast<float>().array();
  if (sky.is_picture) next->environment.radiance = read_true_picture(session_.folder / "truth" / "environment.exr");
  // A frame without material pictures uses those of the first frame, which has all.
  const bool own = std::filesystem::exists(folder / "albedo.exr");
  next->seen = std::make_shared<const relight::SeenMaterials>(
      read_seen(own ? folder : truth_folder(session_.folder, 0), session_.color.model));
  scene_ = std::move(next);
  folder_ = folder;
}

std::shared_ptr<const relight::ReferenceScene> TrueRoom::at(const capture::FrameSet& frame) {
  const std::filesystem::path folder = truth_folder(session_.folder, frame.index);
  if (folder != folder_) take(folder);
  return scene_;
}

}  // namespace lumigraft::server
