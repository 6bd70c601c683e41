// A real plaster bust in window light, photographed from two sides: compares the light estimated from its shading in
// each view, and tests its albedo. LUMIGRAFT_EXTRA names a folder that contains data/sokrates-bust.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "capture/camera/srgb.h"
#include "capture/formats/picture_file.h"
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/light/environment.h"
#include "tests/reconstruct/albedo/albedo_room.h"
#include "tests/reconstruct/real_data.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr int kStep = 3;                // pixel step in the photographs
constexpr std::array kViews = {1, 34};  // front view, and from the lower left
constexpr float kPlaster = 0.5f;        ///< assumed albedo: the scale of light is unknown

capture::CameraModel camera() {
  capture::CameraModel model;
  model.width = 1139 / kStep;
  model.height = 1709 / kStep;
  model.fx = model.fy = 4071.93 / kStep;
  model.cx = (570.058 - 1) / kStep;
  model.cy = (849.925 - 1) / kStep;
  return model;
}

struct View {
  capture::FrameSet frame;
  Pose pose;
};

View read_view(const std::filesystem::path& folder, int number) {
  char name[40];
  std::snprintf(name, sizeof(name), "%06d.png", number);
  const auto codes = capture::read_encoded(folder / (std::string("color") + name));
  const auto counts = capture::read_depth(folder / (std::string("depth") + name));
  const capture::CameraModel model = camera();
  auto depth = std::make_shared<capture::DepthFrame>();
  depth->depth_m = capture::Image<float>(model.width, model.height, 1);
  auto color = std::make_shared<capture::Frame>();
  color->encoded = capture::Image<std::uint8_t>(model.width, model.height, 3);
  for (int v = 0; v < model.height; ++v)
    for (int u = 0; u < model.width; ++u) {
      depth->depth_m.at(u, v) = 0.001f * counts.at(kStep * u + 1, kStep * v + 1);
      for (int c = 0; c < 3; ++c) color->encoded.at(u, v, c) = codes.at(kStep * u + 1, kStep * v + 1, c);
    }
  View view;
  view.frame.index = static_cast<std::uint64_t>(number);
  view.frame.time_ns = number * 1'000'000'000ll;
  view.frame.depth = depth;
  view.frame.color = color;
  std::ifstream in(folder / "pose.txt");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    int index = 0;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    words >> index >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
    if (index != number) continue;
    view.pose.T_tag_camera.translation() = t;
    view.pose.T_tag_camera.linear() = q.normalized().toRotationMatrix();
  }
  view.pose.T_tag_camera_raw = view.pose.T_tag_camera;
  return view;
}

struct Sample {
  Vector3f place, normal, radiance;
};

std::shared_ptr<const DistanceField> fuse(const std::vector<const View*>& views) {
  capture::Session session;
  session.color.model = camera();
  FusionSettings settings;
  settings.voxel_m = 0.004;
  FusionStage fusion(session, settings);
  std::shared_ptr<const DistanceField> field;
  for (const View* view : views) field = fusion.fuse(view->frame, view->pose);
  return field;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Vector3f radiance(const View& view, int u, int v) {
  const capture::Frame& picture = *view.frame.color;
  Vector3f light;
  for (int c = 0; c < 3; ++c) light[c] = capture::srgb_to_linear(picture.encoded.at(u, v, c) / 255.0f);
  return light / static_cast<float>(picture.exposure);
}

std::vector<Sample> samples(const DistanceField& field, const View& view) {
  const capture::CameraModel model = camera();
  std::vector<Sample> all;
  for (int v = 0; v < model.height; v += 3)
    for (int u = 0; u < model.width; u += 3) {
      if (view.frame.depth->depth_m.at(u, v) <= 0) continue;
      const Eigen::Vector3d ray = view.pose.T_tag_camera.linear() * *model.unproject(Eigen::Vector2d(u, v));
      const Vector3f from = view.pose.T_tag_camera.translation().cast<float>();
      const auto hit = field.raycast(from, ray.cast<float>(), 0.1f, 5);
      if (!hit || hit->normal.dot(ray.cast<float>()) > -0.3f) continue;
      all.push_back({hit->position_m, hit->normal, radiance(view, u, v)});
    }
  return all;
}

/// Ratios of radiance `b` / `a` at common surface points.
std::vector<double> ratios(const DistanceField& field, const View& a, const View& b) {
  std::vector<double> all;
  const Eigen::Isometry3d T_camera_tag = b.pose.T_tag_camera.inverse();
  for (const Sample& s : samples(field, a)) {
    const Eigen::Vector3d p = T_camera_tag * s.place.cast<double>();
    const auto pixel = camera().project(p);
    if (!pixel || !camera().inside(*pixel)) continue;
    const int u = static_cast<int>(std::lround(pixel->x())), v = static_cast<int>(std::lround(pixel->y()));
    if (std::abs(b.frame.depth->depth_m.at(u, v) - p.z()) > 0.003) continue;
    const Vector3f way = (b.pose.T_tag_camera.translation().cast<float>() - s.place).normalized();
    if (way.dot(s.normal) < 0.4f) continue;
    all.push_back(radiance(b, u, v).mean() / s.radiance.mean());
  }
  return all;
}

/// Nine spherical harmonics of light, by least squares from the samples' radiance with a uniform albedo.
Sh9 light_of(const std::vector<Sample>& of) {
  Eigen::MatrixXd rows(of.size() + 9, 9);
  Eigen::MatrixXd radiance = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(of.size()) + 9, 3);
  rows.setZero();
  for (std::size_t s = 0; s < of.size(); ++s) {
    for (std::size_t i = 0; i < 9; ++i) {
      Sh9 one;
      one.fill(Vector3f::Zero());
      one[i] = Vector3f::Ones();
      rows(s, i) = kPlaster / 3.14159265 * sh_irradiance(one, of[s].normal).x();
    }
    radiance.row(s) = of[s].radiance.cast<double>().transpose();
  }
  for (int i = 0; i < 9; ++i) rows(of.size() + i, i) = 1e-2 * std::sqrt(static_cast<double>(of.size()));
  const Eigen::MatrixXd found = rows.colPivHouseholderQr().solve(radiance);
  Sh9 light;
  for (std::size_t i = 0; i < 9; ++i) light[i] = found.row(i).transpose().cast<float>();
  return light;
}

TEST(AlbedoBust, LightAndAlbedoFromOtherViews) {
  const auto folder = test::data_folder("sokrates-bust");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/sokrates-bust";
  std::vector<View> views;
  for (const int number : kViews) views.push_back(read_view(*folder, number));
  // Exposures are unknown: scales the photographs so that common points have equal brightness.
  const std::vector<double> brighter = ratios(*fuse({&views[0], &views[1]}), views[0], views[1]);
  ASSERT_GT(brighter.size(), 1000u);
  auto picture = std::make_shared<capture::Frame>(*views[1].frame.color);
  picture->exposure = median(brighter);
  views[1].frame.color = picture;
  const auto field = fuse({&views[0], &views[1]});
  const auto alone = {fuse({&views[0]}), fuse({&views[1]})};
  std::vector<double> uneven;
  for (const double ratio : brighter) uneven.push_back(std::abs(ratio / picture->exposure - 1));
  std::printf("albedo: bust, %zu places in both views, of which radiance differs by %.1f %%\n", brighter.size(),
              100 * median(uneven));

  std::vector<std::vector<Sample>> seen;
  for (const View& view : views) seen.push_back(samples(*field, view));
  for (std::size_t held = 0; held < 2; ++held) {
    const Sh9 light = light_of(seen[1 - held]);
    Vector3f mean = Vector3f::Zero();
    for (const Sample& s : seen[1 - held]) mean += s.radiance / static_cast<float>(seen[1 - held].size());
    std::vector<double> off, flat;
    for (const Sample& s : seen[held]) {
      const Vector3f by = kPlaster / 3.14159265f * sh_irradiance(light, s.normal);
      off.push_back((by - s.radiance).norm() / s.radiance.norm());
      flat.push_back((mean - s.radiance).norm() / s.radiance.norm());
    }
    std::printf("    view %d by the light that the other's shading tells: %.1f %% off, by the other's mean %.1f %%\n",
                kViews[held], 100 * median(off), 100 * median(flat));
    EXPECT_LT(median(off), 0.3);
    EXPECT_LT(median(off), 0.7 * median(flat));
  }

  std::vector<Sample> all = seen[0];
  all.insert(all.end(), seen[1].begin(), seen[1].end());
  Illumination light;
  light.environment_sh = light_of(all);
  light.environment.radiance = capture::Image<float>(128, 64, 3);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 128; ++u)
      for (int c = 0; c < 3; ++c)
        light.environment.radiance.at(u, v, c) =
            std::max(0.0f, sh_radiance(light.environment_sh, environment_direction(u, v, 128, 64))[c]);
  capture::Session session;
  session.color.model = camera();
  std::vector<std::shared_ptr<const AlbedoField>> albedo;
  for (const auto& one : alone) albedo.push_back(AlbedoStage(session).solve(*one, light).albedo);
  std::vector<double> apart, level, plain;
  std::vector<double> shade;
  int within = 0;
  for (const Sample& s : all) {
    const auto [x, sx] = albedo_at(*albedo[0], s.place);
    const auto [y, sy] = albedo_at(*albedo[1], s.place);
    if (sx < 0 || sy < 0) continue;
    level.push_back(0.5 * (x + y).mean());
    shade.push_back(s.radiance.mean());
    apart.push_back((x - y).norm() / (0.5 * (x + y)).norm());
    within += (x - y).norm() < std::sqrt(3.0f) * std::hypot(sx, sy);
  }
  const double middle = median(level), shade_middle = median(shade);
  std::vector<double> spread, shade_spread;
  for (const double x : level) spread.push_back(std::abs(x / middle - 1));
  for (const double x : shade) shade_spread.push_back(std::abs(x / shade_middle - 1));
  std::printf(
      "    albedo of one view against the other's: %.1f %% apart, %.0f %% within one sigma, %.0f %% of places known to "
      "both; "
      "it varies by %.1f %%, radiance by %.1f %%\n",
      100 * median(apart), 100.0 * within / static_cast<double>(apart.size()),
      100.0 * static_cast<double>(apart.size()) / static_cast<double>(all.size()), 100 * median(spread),
      100 * median(shade_spread));
  EXPECT_GT(apart.size(), 0.85 * static_cast<double>(all.size()));
  EXPECT_LT(median(apart), 0.18);
  EXPECT_GT(within, 0.6 * static_cast<double>(apart.size()));
  EXPECT_LT(median(spread), 0.7 * median(shade_spread));
}

}  // namespace
}  // namespace lumigraft::reconstruct
