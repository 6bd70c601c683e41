// Shadows that what moved in the room casts on objects, by the methods on a device: closed form, and as `rays`.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using relight::RelitPicture;

/// A white box on a floor under a lamp, and a hand between lamp and box that the room does not have.
class MovedShadow : public ClosedTest {
 protected:
  MovedShadow() : scene_(box_on_floor()) {
    // Fine enough that neighbouring pixels on the hand's top are of one surface.
    scene_.width *= 3;
    scene_.height *= 3;
    scene_.focal_px *= 3;
    scene_.extent.extend(Eigen::Vector3f(0.9f, 1.6f, 0));
    room_ = scene_.scene();
    middle_m_ = 0.5f * (scene_.lamps[0].position_m + Eigen::Vector3f(0.05f, 0, 0.2f));
    const Eigen::AlignedBox3f hand(middle_m_ - Eigen::Vector3f::Constant(kHalf_m),
                                   middle_m_ + Eigen::Vector3f::Constant(kHalf_m));
    ClosedScene held = scene_;
    held.distance = [floor = scene_.distance, hand](const Eigen::Vector3f& p) {
      return std::min(floor(p), box_distance(hand, p));
    };
    held.extent.extend(hand.max() + Eigen::Vector3f::Constant(0.05f));
    empty_ = scene_.frame();
    with_hand_ = held.frame();
    relight::RayRenderer rays(scene_.session());
    by_rays_ = relit(rays, rays_plan(4), true);
  }

  struct Pictures {
    RelitPicture before, with, after;
  };
  Pictures relit(relight::Renderer& renderer, const relight::Plan& plan, bool with_maps) const {
    const auto picture = [&](const capture::FrameSet& frame) {
      return renderer.relight(frame, room_, scene_.exhibit, plan, with_maps);
    };
    Pictures p;
    p.before = picture(empty_);
    p.with = picture(with_hand_);
    p.after = picture(empty_);
    return p;
  }

  /// Whether the hand's top, which the camera sees, hides the whole lamp.
  bool in_umbra(const Eigen::Vector3f& at_m) const {
    constexpr float kBorder_m = 0.006f;  // of the top in depth: a pixel, and its noise
    const Eigen::Vector3f to_m = scene_.lamps[0].position_m - at_m;
    const float part = (middle_m_.z() + kHalf_m - at_m.z()) / to_m.z();  // of the way to the lamp
    const Eigen::Vector3f there_m = at_m + part * to_m;
    return (there_m - middle_m_).head<2>().cwiseAbs().maxCoeff() <
           kHalf_m - part * scene_.lamps[0].radius_m - kBorder_m;
  }
  bool hand_at(int u, int v) const {
    return std::abs(with_hand_.depth->depth_m.at(u, v) - empty_.depth->depth_m.at(u, v)) > 1e-3f;
  }
  bool top_at(int u, int v) const {
    return by_rays_.before.maps->mask.at(u, v) > 0.99f && by_rays_.with.maps->mask.at(u, v) > 0.99f &&
           by_rays_.before.maps->normals.at(u, v, 2) > 0.99f;
  }
  static float lost(const Pictures& p, int u, int v) {
    return picture_radiance(p.before, u, v) - picture_radiance(p.with, u, v);
  }

  /// Where the hand hides all of the lamp the top loses E ρ / π of it.
  void takes_the_lamps_light_from_the_box(const Pictures& p) const {
    double sum = 0, sum_of_rays = 0;
    int all = 0, hidden = 0;
    for (int v = 0; v < scene_.height; ++v) {
      for (int u = 0; u < scene_.width; ++u) {
        if (!top_at(u, v)) continue;
        sum += static_cast<double>(lost(p, u, v));
        sum_of_rays += static_cast<double>(lost(by_rays_, u, v));
        ++all;
        const Eigen::Vector3f at_m = scene_.on_plane(u, v, 0.2f);
        if (!in_umbra(at_m)) continue;
        const float expected =
            0.9f / std::numbers::pi_v<float> * irradiance(scene_.lamps[0], at_m, Eigen::Vector3f::UnitZ());
        EXPECT_NEAR(lost(p, u, v), expected, 0.1f * expected) << u << ", " << v;
        ++hidden;
      }
    }
    ASSERT_GT(all, 200);
    EXPECT_GT(hidden, 20);
    EXPECT_NEAR(sum / all, sum_of_rays / all, 0.1 * sum_of_rays / all);
  }

  /// Where the hand hides the lamp, the box takes none of its light from the floor: its shadow is lighter by it.
  void takes_no_light_twice_from_the_floor(const Pictures& p) const {
    double lighter = 0, lighter_by_rays = 0;
    int pixels = 0;
    for (int v = 0; v < scene_.height; ++v) {
      for (int u = 0; u < scene_.width; ++u) {
        if (by_rays_.before.maps->mask.at(u, v) > 0 || hand_at(u, v)) continue;
        if (kFloor - picture_radiance(by_rays_.before, u, v) < 0.05f) continue;
        lighter -= static_cast<double>(lost(p, u, v));
        lighter_by_rays -= static_cast<double>(lost(by_rays_, u, v));
        ++pixels;
      }
    }
    ASSERT_GT(pixels, 200) << "in the shadow of the box";
    ASSERT_GT(lighter_by_rays, 0.03 * pixels) << "many of them are in that of the hand, too";
    EXPECT_NEAR(lighter, lighter_by_rays, 0.15 * lighter_by_rays);
  }

  void goes_at_once(const Pictures& p) const {
    int most = 0;
    for (std::size_t i = 0; i < p.before.srgb.data.size(); ++i)
      most = std::max(most, std::abs(p.before.srgb.data[i] - p.after.srgb.data[i]));
    EXPECT_LE(most, 1);
  }

  static constexpr float kHalf_m = 0.06f;  ///< half the hand's edge
  static constexpr float kFloor = 0.25f;   ///< radiance of box_on_floor
  ClosedScene scene_;
  Eigen::Vector3f middle_m_;  ///< of the hand
  reconstruct::Scene room_;
  capture::FrameSet empty_, with_hand_;
  Pictures by_rays_;
};

/// Light is looked up in one plan, and computed per pixel in the other.
TEST_P(MovedShadow, IsOnObjectsAndNotTakenTwice) {
  std::vector<relight::Plan> plans{live_plan(), coarse_plan()};
  for (const relight::Plan& plan : plans) {
    SCOPED_TRACE("at 1/" + std::to_string(plan.trace_scale));
    relight::Relighter relighter(device_, scene_.session());
    const Pictures p = relit(relighter, plan, false);
    takes_the_lamps_light_from_the_box(p);
    takes_no_light_twice_from_the_floor(p);
    goes_at_once(p);
  }
}

ON_BOTH_DEVICES(MovedShadow);

}  // namespace
}  // namespace lumigraft::test
