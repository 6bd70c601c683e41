#include "relight/view_motion.h"

#include <gtest/gtest.h>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::relight {
namespace {

constexpr std::int64_t kFrame_ns = 33'333'333;

class Film {
 public:
  /// Whether the camera moves after so many frames, in which it moves by a step along x.
  bool moves(int frames, double step_m) {
    bool found = false;
    for (int i = 0; i < frames; ++i) {
      T_tag_camera_.translation().x() += step_m;
      found = motion_.moves(exhibit_, T_tag_camera_, time_ns_ += kFrame_ns);
    }
    return found;
  }
  void begin_again() { time_ns_ = 0; }
  void hide_objects() { exhibit_.objects[0].visible = false; }

 private:
  ViewMotion motion_{test::session_of(640, 480, 500).color.model};
  Exhibit exhibit_{.objects = {VirtualObject{}}};
  Eigen::Isometry3d T_tag_camera_ =
      Eigen::Translation3d(0, 0, 1) * Eigen::AngleAxisd(EIGEN_PI, Eigen::Vector3d::UnitX());
  std::int64_t time_ns_ = 0;
};

TEST(ViewMotion, BeginsAtOnceAndEndsAfterASecondOfRest) {
  Film film;
  EXPECT_FALSE(film.moves(3, 0)) << "at the start";
  EXPECT_TRUE(film.moves(1, 0.01));
  EXPECT_TRUE(film.moves(25, 0)) << "it halts for a moment";
  EXPECT_FALSE(film.moves(10, 0));
  EXPECT_FALSE(film.moves(60, 1e-6)) << "less than an eighth of a pixel";
  EXPECT_TRUE(film.moves(1, 0.01));
  film.begin_again();
  EXPECT_FALSE(film.moves(32, 0)) << "a recording that begins again";
}

TEST(ViewMotion, WithoutObjectsNothingIsSeenOfIt) {
  Film film;
  film.hide_objects();
  EXPECT_FALSE(film.moves(10, 0.01));
}

}  // namespace
}  // namespace lumigraft::relight
