#include "tests/relight/closed_form/closed_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/camera/srgb.h"
#include "relight/quality.h"
#include "relight/reference/reference_renderer.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {
namespace {

constexpr float kFar_m = 4;

relight::VirtualObject object_of(relight::Model model, float albedo) {
  relight::VirtualObject object;
  object.name = "object";
  object.model = std::make_shared<const relight::Model>(std::move(model));
  relight::Material material;
  material.base_color.setConstant(albedo);
  material.specular = 0;
  object.material = material;
  return object;
}

}  // namespace

Eigen::Isometry3d ClosedScene::T_tag_camera() const {
  const Eigen::Vector3d forward = (look_at_m - eye_m).cast<double>().normalized();
  const Eigen::Vector3d up = std::abs(forward.z()) > 0.99 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << right, forward.cross(right), forward;
  T.translation() = eye_m.cast<double>();
  return T;
}

capture::Session session_of(int width, int height, double focal_px) {
  capture::Session s;
  s.color.model.width = width;
  s.color.model.height = height;
  s.color.model.fx = s.color.model.fy = focal_px;
  s.color.model.cx = 0.5 * (width - 1);
  s.color.model.cy = 0.5 * (height - 1);
  return s;
}

capture::Session ClosedScene::session() const { return session_of(width, height, focal_px); }

Eigen::Vector3f ClosedScene::on_plane(int u, int v, float height_m) const {
  const capture::CameraModel model = session().color.model;
  const Eigen::Vector3d w = T_tag_camera().linear() * *model.unproject({u, v});
  return (eye_m.cast<double>() + w * ((height_m - eye_m.z()) / w.z())).cast<float>();
}

capture::FrameSet ClosedScene::frame() const {
  capture::FrameSet f;
  auto color = std::make_shared<capture::Frame>();
  color->radiance = capture::Image<float>(width, height, 3, sky);
  auto depth = std::make_shared<capture::DepthFrame>();
  depth->depth_m = capture::Image<float>(width, height, 1, 0.0f);
  const capture::CameraModel model = session().color.model;
  const Eigen::Isometry3d T = T_tag_camera();
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector3d ray = *model.unproject({u, v});
      const Eigen::Vector3f w = (T.linear() * ray).cast<float>().normalized();
      float t = 0, d = 1;
      while (t < kFar_m && d > 1e-5f) t += d = distance(eye_m + t * w);
      const Eigen::Vector3f hit = eye_m + t * w;
      if (t >= kFar_m || !extent.contains(hit)) continue;
      depth->depth_m.at(u, v) = t * static_cast<float>(ray.z() / ray.norm());
      for (int c = 0; c < 3; ++c) color->radiance.at(u, v, c) = radiance(hit);
    }
  }
  f.color = color;
  f.depth = depth;
  return f;
}

reconstruct::Scene ClosedScene::scene() const {
  reconstruct::Scene scene;
  reconstruct::Pose pose;
  pose.T_tag_camera = pose.T_tag_camera_raw = T_tag_camera();
  scene.pose = pose;

  auto field = std::make_shared<reconstruct::DistanceField>();
  auto colors = std::make_shared<reconstruct::AlbedoField>();
  field->voxel_m = colors->voxel_m = voxel_m;
  field->truncation_m = 4 * voxel_m;
  field->version = colors->version = 1;
  const float brick_m = reconstruct::kBrickEdge * voxel_m;
  const Eigen::Vector3i low = (extent.min() / brick_m).array().floor().matrix().cast<int>();
  const Eigen::Vector3i high = (extent.max() / brick_m).array().floor().matrix().cast<int>();
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        auto brick = std::make_shared<reconstruct::FieldBrick>();
        reconstruct::BrickColor& color = brick->own_color();
        auto paint = std::make_shared<reconstruct::AlbedoBrick>();
        bool any = false;
        for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
          const Eigen::Vector3f p =
              Eigen::Vector3i(8 * x + i % 8, 8 * y + i / 8 % 8, 8 * z + i / 64).cast<float>() * voxel_m;
          const float d = distance(p);
          const bool near = std::abs(d) < field->truncation_m;
          const auto k = static_cast<std::size_t>(i);
          any = any || near;
          brick->distance_m[k] = std::clamp(d, -field->truncation_m, field->truncation_m);
          brick->weight[k] = d > -field->truncation_m ? 1.0f : 0.0f;
          color.weight[k] = near ? 1.0f : 0.0f;
          color.radiance[k].setConstant(near ? radiance(p) : 0.0f);
          paint->albedo[k].setConstant(albedo);
          paint->sigma[k] = near ? 0.01f : -1.0f;
        }
        if (!any) continue;
        field->bricks[{x, y, z}] = brick;
        colors->bricks[{x, y, z}] = paint;
      }
    }
  }
  scene.field = field;
  scene.albedo = colors;

  auto light = std::make_shared<reconstruct::Illumination>();
  light->probe_position_m = {0, 0, 0.3f};
  light->environment.radiance = capture::Image<float>(32, 16, 3, sky);
  light->environment_sh.fill(Eigen::Vector3f::Zero());
  light->environment_sh[0].setConstant(sky * 2 * std::sqrt(std::numbers::pi_v<float>));
  light->lights = lamps;
  light->version = 1;
  scene.illumination = light;
  return scene;
}

relight::RelitPicture ClosedScene::relit(relight::Renderer& renderer, const relight::Plan& plan) const {
  return renderer.relight(frame(), scene(), exhibit, plan, true);
}

relight::Plan careful_plan(int volume, int bounces) {
  relight::Plan plan;
  plan.volume = volume;
  plan.trace_scale = 1;
  plan.bounces = bounces;
  return plan;
}

relight::Plan live_plan(int volume) {
  relight::Plan plan = careful_plan(volume);
  plan.trace_scale = 4;
  return plan;
}

relight::Plan coarse_plan() {
  relight::Plan plan = careful_plan(32, 1);
  plan.trace_scale = 2;
  relight::Quality coarse = relight::quality_of(plan);
  coarse.delta_cones = coarse.change_cones = coarse.hemisphere_cones = 6;
  coarse.voxel_cones = 4;
  coarse.lamp_maps = 12;
  plan.quality = std::make_shared<const relight::Quality>(coarse);
  return plan;
}

relight::Plan rays_plan(int trace_scale, int rays, int bounces) {
  relight::Plan plan;
  plan.method = "rays";
  plan.trace_scale = trace_scale;
  plan.rays = rays;
  plan.bounces = bounces;
  return plan;
}

ClosedScene box_on_floor() {
  ClosedScene scene;
  scene.width = 112;
  scene.height = 84;
  scene.focal_px = 90;
  scene.sky = 0.2f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.25f; };
  scene.lamps = {lamp_at({0.3f, 0.1f, 0.5f}, 0.03f, 0.2f)};
  scene.exhibit.objects = {box_object({-0.1f, -0.05f, 0.01f}, {0.1f, 0.05f, 0.2f}, 0.9f)};
  return scene;
}

reconstruct::PointLight lamp_at(const Eigen::Vector3f& position_m, float radius_m, float intensity) {
  reconstruct::PointLight lamp;
  lamp.distance_known = true;
  lamp.position_m = position_m;
  lamp.radius_m = radius_m;
  lamp.intensity.setConstant(intensity);
  return lamp;
}

float irradiance(const reconstruct::PointLight& lamp, const Eigen::Vector3f& at_m, const Eigen::Vector3f& normal) {
  const Eigen::Vector3f to = lamp.position_m - at_m;
  const float d2 = to.squaredNorm();
  return lamp.emission(-to.normalized()) * lamp.intensity.x() * std::max(normal.dot(to), 0.0f) / (d2 * std::sqrt(d2));
}

relight::VirtualObject sphere_object(float radius_m, const Eigen::Vector3f& centre_m, float albedo) {
  relight::Model model = model_of(sphere(radius_m, 40));
  for (std::size_t i = 0; i < model.normals.size(); ++i) model.normals[i] = model.positions_m[i].normalized();
  relight::VirtualObject object = object_of(std::move(model), albedo);
  object.position_m = centre_m.cast<double>();
  return object;
}

relight::VirtualObject box_object(const Eigen::Vector3f& low_m, const Eigen::Vector3f& high_m, float albedo) {
  return object_of(model_of(box(low_m, high_m)), albedo);
}

ClosedScene ball_under_lamp() {
  ClosedScene scene;
  scene.lamps = {lamp_at({0.2f, 0.1f, 0.9f}, 0.05f, 1)};
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.7f)};
  return scene;
}

ClosedScene ball_under_lamp_and_sky() {
  ClosedScene scene = ball_under_lamp();
  scene.width = 32;
  scene.height = 24;
  scene.focal_px = 80;
  scene.look_at_m = {0, 0, 0.12f};
  scene.extent.min().head<2>().setConstant(-0.5f);
  scene.extent.max().head<2>().setConstant(0.5f);
  scene.radiance = [lamp = scene.lamps[0], albedo = scene.albedo](const Eigen::Vector3f& p) {
    return albedo * (irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ()) / std::numbers::pi_v<float> + 1);
  };
  return scene;
}

ClosedScene floor_under_lamp() {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 45;
  scene.eye_m = {0, -0.5f, 0.35f};
  scene.look_at_m = {0, 0, 0.06f};
  scene.sky = 0.3f;
  scene.lamps = {lamp_at({0.3f, -0.3f, 0.6f}, 0.03f, 0.3f)};
  scene.radiance = [lamp = scene.lamps[0], albedo = scene.albedo, sky = scene.sky](const Eigen::Vector3f& p) {
    return albedo * (irradiance(lamp, p, Eigen::Vector3f::UnitZ()) / std::numbers::pi_v<float> + sky);
  };
  return scene;
}

float box_distance(const Eigen::AlignedBox3f& box, const Eigen::Vector3f& p_m) {
  const Eigen::Vector3f q = (p_m - box.center()).cwiseAbs() - 0.5f * box.sizes();
  return q.cwiseMax(0.0f).norm() + std::min(q.maxCoeff(), 0.0f);
}

float picture_radiance(const relight::RelitPicture& picture, int u, int v) {
  return capture::srgb_to_linear(static_cast<float>(picture.srgb.at(u, v, 0)) / 255.0f);
}

double mean_of_objects(const relight::RelitPicture& picture) {
  double sum = 0;
  int count = 0;
  for (int v = 0; v < picture.srgb.height; ++v) {
    for (int u = 0; u < picture.srgb.width; ++u) {
      if (picture.maps->mask.at(u, v) < 1) continue;
      sum += static_cast<double>(picture_radiance(picture, u, v));
      ++count;
    }
  }
  EXPECT_GT(count, 50);
  return sum / std::max(count, 1);
}

relight::RelitPicture traced(const ClosedScene& scene, int samples) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = samples;
  relight::ReferenceRenderer renderer(scene.session());
  return scene.relit(renderer, plan);
}

}  // namespace lumigraft::test
