#include "server/bench/work.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace lumigraft::server {
namespace {

/// Total area of the triangles in the tag frame.
double area_m2(const relight::Exhibit& exhibit) {
  double sum = 0;
  for (const relight::VirtualObject& object : exhibit.objects) {
    const Eigen::Affine3d T_tag_model = object.T_tag_model(0);
    const std::vector<std::uint32_t>& indices = object.model->indices;
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      const auto corner = [&](std::size_t j) -> Eigen::Vector3d {
        return T_tag_model * object.model->positions_m[indices[i + j]].cast<double>();
      };
      sum += 0.5 * (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
    }
  }
  return sum;
}

/// A square of two triangles on the ground, a picture of 32 by 24, one lamp.
class BenchWork : public testing::Test {
 protected:
  BenchWork() {
    auto model = std::make_shared<relight::Model>();
    model->positions_m = {{-0.1f, -0.1f, 0}, {0.1f, -0.1f, 0}, {0.1f, 0.1f, 0}, {-0.1f, 0.1f, 0}};
    model->normals.assign(4, Eigen::Vector3f::UnitZ());
    model->texcoords.assign(4, Eigen::Vector2f::Zero());
    model->colors.assign(4, Eigen::Vector3f::Ones());
    model->indices = {0, 1, 2, 0, 2, 3};
    model->parts.resize(1);
    model->parts[0].index_count = 6;
    exhibit_.objects.resize(1);
    exhibit_.objects[0].model = model;
    exhibit_.objects[0].position_m = {0.3, 0.2, 0};
    session_.color.model.width = 32;
    session_.color.model.height = 24;
    session_.color.model.fx = session_.color.model.fy = 30;
    session_.color.model.cx = 15.5;
    session_.color.model.cy = 11.5;
    auto color = std::make_shared<capture::Frame>();
    color->encoded = capture::Image<std::uint8_t>(32, 24, 3, 100);
    auto depth = std::make_shared<capture::DepthFrame>();
    depth->depth_m = capture::Image<float>(32, 24, 1, 1.0f);
    scene_.frame.color = color;
    scene_.frame.depth = depth;
    auto light = std::make_shared<reconstruct::Illumination>();
    light->lights.resize(1);
    light->lights[0].direction = Eigen::Vector3f(1, 0, 1).normalized();
    light->lights[0].irradiance = {8, 4, 2};
    scene_.scene.illumination = light;
    for (const WorkCase& work : work_cases(session_, scene_, exhibit_, plan_)) {
      by_work_[work.work].push_back(work);
    }
  }

  capture::Session session_;
  BenchScene scene_;
  relight::Exhibit exhibit_;
  relight::Plan plan_;
  std::map<std::string, std::vector<WorkCase>> by_work_;
};

TEST_F(BenchWork, EveryKindGrows) {
  EXPECT_EQ(by_work_.size(), 6u);
  for (const auto& [kind, cases] : by_work_) {
    int bases = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      bases += cases[i].base ? 1 : 0;
      EXPECT_TRUE(i == 0 || cases[i].amount > cases[i - 1].amount || kind == "triangles") << kind;
    }
    EXPECT_EQ(bases, kind == "lights" ? 0 : 1) << kind;
  }
}

TEST_F(BenchWork, PixelsShowTheSameView) {
  for (const WorkCase& work : by_work_["pixels"]) {
    const capture::CameraModel& camera = work.session.color.model;
    EXPECT_EQ(work.amount, camera.width * camera.height);
    EXPECT_EQ(work.frame.color->encoded.width, camera.width);
    EXPECT_EQ(work.frame.depth->depth_m.height, camera.height);
    const Eigen::Vector2d corner = *camera.project(*session_.color.model.unproject({-0.5, -0.5}));
    EXPECT_TRUE(corner.isApprox(Eigen::Vector2d(-0.5, -0.5), 1e-9));
  }
}

TEST_F(BenchWork, TrianglesKeepTheShape) {
  const WorkCase& last = by_work_["triangles"].back();
  EXPECT_EQ(last.amount, 8);
  EXPECT_NEAR(area_m2(last.exhibit), area_m2(exhibit_), 1e-9);
  const relight::Model& model = *last.exhibit.objects[0].model;
  EXPECT_EQ(model.positions_m.size(), 9u);  // shared along edges
  EXPECT_EQ(model.parts[0].index_count, model.indices.size());
}

TEST_F(BenchWork, LightsKeepThePower) {
  for (const WorkCase& work : by_work_["lights"]) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const reconstruct::PointLight& light : work.scene.illumination->lights) {
      sum += light.irradiance;
      EXPECT_NEAR(light.direction.z(), std::sqrt(0.5f), 1e-6f);
    }
    EXPECT_TRUE(sum.isApprox(Eigen::Vector3f(8, 4, 2)));
    EXPECT_EQ(work.amount, static_cast<double>(work.scene.illumination->lights.size()));
  }
}

TEST_F(BenchWork, ObjectsShareTheGround) {
  for (const WorkCase& work : by_work_["objects"]) {
    EXPECT_NEAR(area_m2(work.exhibit), area_m2(exhibit_), 1e-9);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const relight::VirtualObject& object : work.exhibit.objects) {
      mean += object.position_m / work.amount;
    }
    EXPECT_TRUE(mean.isApprox(exhibit_.objects[0].position_m));
  }
}

}  // namespace
}  // namespace lumigraft::server
