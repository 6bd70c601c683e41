#include "relight/method_choice.h"

#include <gtest/gtest.h>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::relight {
namespace {

constexpr std::int64_t kFrame_ns = 33'333'333;

Exhibit one_object(const Material& material) {
  auto model = std::make_shared<Model>();
  model->parts.emplace_back().material = material;
  Exhibit exhibit;
  exhibit.objects.push_back({});
  exhibit.objects[0].model = model;
  return exhibit;
}

Exhibit specular() { return one_object({.specular = 1}); }

class Film {
 public:
  /// Whether rays draw after so many frames, in which the camera moves by a step along x.
  bool by_rays(const Exhibit& exhibit, int frames, double step_m) {
    bool found = false;
    for (int i = 0; i < frames; ++i) {
      pose_.T_tag_camera.translation() += Eigen::Vector3d(step_m, 0, 0);
      found = choice_.wants_rays(exhibit, pose_, time_ns_ += kFrame_ns);
    }
    return found;
  }
  void begin_again() { time_ns_ = 0; }

 private:
  static reconstruct::Pose pose() {
    reconstruct::Pose pose;
    pose.T_tag_camera = Eigen::Translation3d(0, 0, 1) * Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX());
    return pose;
  }
  MethodChoice choice_{test::session_of(640, 480, 500).color.model};
  reconstruct::Pose pose_ = pose();
  std::int64_t time_ns_ = 0;
};

TEST(MethodChoice, SpecularMaterialsAndOverridesCount) {
  EXPECT_FALSE(any_specular(one_object({.specular = 0})));
  EXPECT_TRUE(any_specular(specular()));
  EXPECT_TRUE(any_specular(one_object({.metallic = 1, .specular = 0})));
  Exhibit exhibit = specular();
  exhibit.objects[0].visible = false;
  EXPECT_FALSE(any_specular(exhibit));
  exhibit.objects[0].visible = true;
  exhibit.objects[0].material.specular = 0;
  EXPECT_FALSE(any_specular(exhibit));
  EXPECT_FALSE(any_specular({}));
}

TEST(MethodChoice, RaysDrawSpecularObjectsWhileTheCameraRests) {
  Film film;
  EXPECT_TRUE(film.by_rays(specular(), 1, 0));
  EXPECT_TRUE(film.by_rays(specular(), 10, 0.01)) << "a push of a third of a second";
  EXPECT_FALSE(film.by_rays(specular(), 60, 0.01));
  EXPECT_FALSE(film.by_rays(specular(), 10, 0)) << "it halts for a third of a second";
  film.begin_again();
  EXPECT_TRUE(film.by_rays(specular(), 60, 0));
  EXPECT_TRUE(film.by_rays(specular(), 60, 1e-6)) << "less than an eighth of a pixel";
  EXPECT_FALSE(film.by_rays(one_object({.specular = 0}), 60, 0));
}

TEST(MethodChoice, APlanOfConesBecomesOneOfRays) {
  Plan live;
  live.trace_scale = 4;
  live.look = "camera";
  EXPECT_EQ(by_rays(live).method, "rays");
  EXPECT_EQ(by_rays(live).trace_scale, 8);
  EXPECT_EQ(by_rays(live).look, "camera");
  live.user_set.insert("trace_scale");
  EXPECT_EQ(by_rays(live).trace_scale, 4) << "what the user chose stays";
}

}  // namespace
}  // namespace lumigraft::relight
