#include "reconstruct/pose/tag_map.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Step = Eigen::Matrix<double, 6, 1>;

/// Four tags around a room, of which only neighbours are seen together.
class TagRing : public testing::Test {
 protected:
  TagRing() {
    for (int t = 0; t < 4; ++t) {
      Isometry3d T = Isometry3d::Identity();
      T.translation() = Vector3d(t == 1 || t == 2 ? 1.5 : 0, t > 1 ? 1.2 : 0, 0.1 * t);
      T.linear() = (Eigen::AngleAxisd(0.6 * t, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.3 * t, Vector3d::UnitX()))
                       .toRotationMatrix();
      T_world_tag.push_back(T);
    }
  }
  void see(TagMap& map, std::size_t a, std::size_t b, int frames) {
    std::normal_distribution<double> gauss(0, 1);
    for (int i = 0; i < frames; ++i) {
      Step noise;
      for (int k = 0; k < 6; ++k) noise[k] = (k < 3 ? 0.002 : 0.004) * gauss(random);
      map.add_pair(a, b, apply_step(T_world_tag[a].inverse() * T_world_tag[b], noise));
    }
  }
  double off_mm(const TagMap& map, std::size_t t) const {
    return map.T_world_tag(t) ? test::millimetres_apart(*map.T_world_tag(t), T_world_tag[t]) : 1e9;
  }

  capture::Tag tag{"tag36h11", 1, 0.16, {{2, 0.16, {}}, {3, 0.16, {}}, {4, 0.16, {}}}};
  std::vector<Isometry3d> T_world_tag;
  std::mt19937 random{3};
};

TEST_F(TagRing, ChainsLocateTagsThatWereNeverSeenWithTheFirst) {
  TagMap map(tag);
  see(map, 2, 3, 20);  // before anything connects them to the first
  EXPECT_FALSE(map.T_world_tag(2));
  EXPECT_EQ(map.warning(2), "tag 3: not used until it is seen together with others");
  see(map, 0, 1, 20);
  see(map, 1, 2, 20);
  for (std::size_t t = 1; t < 4; ++t) {
    EXPECT_LT(off_mm(map, t), 8) << t;
    EXPECT_TRUE(map.warning(t).empty()) << t;
  }
}

TEST_F(TagRing, AClosedRingIsMoreCertainAndItsCovarianceCovers) {
  double open_mm = 0, closed_mm = 0, sigmas = 0, before = 0, after = 0;
  const Isometry3d T_camera_tag = Isometry3d(Eigen::Translation3d(0, 0, 1));
  constexpr int kRings = 40;
  for (int i = 0; i < kRings; ++i) {
    TagMap map(tag);
    for (std::size_t a = 0; a < 3; ++a) see(map, a, a + 1, 12);
    open_mm += off_mm(map, 3) / kRings;
    before += position_sigma_m(map.uncertainty(3, T_camera_tag)) / kRings;
    see(map, 0, 3, 12);
    closed_mm += off_mm(map, 3) / kRings;
    const PoseCovariance of_tag = map.uncertainty(3, Isometry3d::Identity());
    after += position_sigma_m(map.uncertainty(3, T_camera_tag)) / kRings;
    sigmas += squared_mahalanobis(step_between(*map.T_world_tag(3), T_world_tag[3]), of_tag) / 6 / kRings;
  }
  std::printf(
      "pose: ring of tags: %.2f mm off, closed %.2f; 1 sigma of a camera %.2f mm, then %.2f; errors %.2f of the "
      "covariance\n",
      open_mm, closed_mm, 1e3 * before, 1e3 * after, std::sqrt(sigmas));
  EXPECT_LT(closed_mm, 0.7 * open_mm);
  EXPECT_LT(after, before);
  EXPECT_GT(sigmas, 0.4);
  EXPECT_LT(sigmas, 1.6);
}

TEST_F(TagRing, AWrongConfigurationIsOverruledAndReported) {
  Isometry3d wrong = T_world_tag[1];
  wrong.translation().x() += 0.05;
  tag.extra[0].T_tag_extra = wrong;
  TagMap map(tag);
  EXPECT_NEAR(off_mm(map, 1), 50, 1e-6);
  see(map, 0, 1, 30);
  EXPECT_LT(off_mm(map, 1), 2);
  EXPECT_NE(map.warning(1).find("from its configured pose"), std::string::npos) << map.warning(1);
}

TEST_F(TagRing, AMovedTagIsLearntAnewAndTheOthersStay) {
  TagMap map(tag);
  for (std::size_t a = 0; a < 3; ++a) see(map, a, a + 1, 20);
  T_world_tag[3].translation().x() += 0.2;
  see(map, 2, 3, 16);
  EXPECT_FALSE(map.T_world_tag(3));
  see(map, 2, 3, 10);
  for (std::size_t t = 1; t < 4; ++t) EXPECT_LT(off_mm(map, t), 8) << t;
  // The link between the first and two others was moved: these stay, and it is known as well as before and better.
  const double before_m = position_sigma_m(map.uncertainty(1, Isometry3d::Identity()));
  T_world_tag[1].translation().z() += 0.1;
  see(map, 0, 1, 200);
  see(map, 2, 3, 20);
  for (std::size_t t = 1; t < 4; ++t) EXPECT_LT(off_mm(map, t), 8) << t;
  EXPECT_LT(position_sigma_m(map.uncertainty(1, Isometry3d::Identity())), 0.8 * before_m);
  // The first was moved while depth showed the camera: the others hold the frame of reference.
  T_world_tag[0].translation().y() += 0.1;
  map.move(0, T_world_tag[0]);
  EXPECT_EQ(map.warning(0), "tag 1: it was moved by 100 mm, objects stay where they were");
  see(map, 0, 1, 20);
  for (std::size_t t = 1; t < 4; ++t) EXPECT_LT(off_mm(map, t), 8) << t;
}

}  // namespace
}  // namespace lumigraft::reconstruct
