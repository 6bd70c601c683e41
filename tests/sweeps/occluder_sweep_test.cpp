// A wall that the camera sees edge-on: its faces were never measured, only its shadow.
#include <gtest/gtest.h>

#include <memory>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/albedo/shadow_carving.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/fusion/fusion.h"
#include "tests/reconstruct/pose/pose_room.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// A wall in the plane x = 0 on a floor, a lamp on its right, and the fish-eye, too.
reconstruct::TestRoom walled_room(float thickness_m) {
  reconstruct::TestRoom room;
  room.half_m = 0.7f;
  room.boxes = {{{-thickness_m / 2, -0.25f, 0.0f}, {thickness_m / 2, 0.25f, 0.25f}}};
  room.lamps = {{{0.5f, 0.0f, 0.4f}, {1.2f, 1.0f, 0.8f}, 0.03f}};
  room.ambient = Vector3f::Constant(0.08f);
  room.probe = {0.3f, -0.3f, 0.03f};
  return room;
}

/// What fusion makes of some frames of a camera in the plane of the wall.
std::shared_ptr<const reconstruct::DistanceField> seen_edge_on(const reconstruct::TestRoom& room,
                                                               const capture::Session& session) {
  reconstruct::FusionStage fuse(session, {});
  std::shared_ptr<const reconstruct::DistanceField> field;
  const Eigen::Isometry3d T_tag_camera = looking_at_tag(0.9, 0.7, -90 * kDegree);
  const capture::CameraModel& camera = session.color.model;
  for (unsigned i = 0; i < 8; ++i) {
    capture::FrameSet frame;
    frame.index = i;
    frame.time_ns = i * kFrameNs;
    auto depth = std::make_shared<capture::DepthFrame>(depth_of_room(room, camera, T_tag_camera, i, 0.3));
    auto color = std::make_shared<capture::Frame>();
    color->radiance = capture::Image<float>(camera.width, camera.height, 3);
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const float z = depth->depth_m.at(u, v);
        const auto ray = camera.unproject({static_cast<double>(u), static_cast<double>(v)});
        if (!(z > 0) || !ray) continue;
        const Vector3f p = (T_tag_camera * (*ray * (z / ray->z()))).cast<float>(), n = room.normal(p);
        const Vector3f on = p - room.distance(p) * n;
        const Vector3f radiance = room.albedo(on).cwiseProduct(room.irradiance(on, n)) / reconstruct::kTestPi;
        for (int c = 0; c < 3; ++c) color->radiance.at(u, v, c) = radiance[c];
      }
    }
    frame.depth = depth;
    frame.color = color;
    reconstruct::Pose pose;
    pose.T_tag_camera = pose.T_tag_camera_raw = T_tag_camera;
    field = fuse.fuse(frame, pose);
  }
  return field;
}

struct Shares {
  double shadowed = 0, lit = 0;  ///< of the points that the lamp does not (does) reach, those for which rays say so
};

Shares correct_shares(const reconstruct::TestRoom& room, const reconstruct::DistanceField& field) {
  const reconstruct::FieldRays rays(field);
  const Vector3f lamp = room.lamps[0].position;
  int shadowed = 0, lit = 0, blocked = 0, free = 0;
  for (float x = -0.3f; x < 0.35f; x += 0.05f) {
    for (float y = -0.3f; y < 0.35f; y += 0.05f) {
      for (float z = 0.02f; z < 0.3f; z += 0.03f) {
        const Vector3f p(x, y, z);
        if (room.boxes[0].distance(p) < 0.03f) continue;
        const bool occluded = room.boxes[0].blocks(p, lamp), said = !rays.free(p, lamp);
        (occluded ? shadowed : lit) += 1;
        blocked += occluded && said;
        free += !occluded && !said;
      }
    }
  }
  return {static_cast<double>(blocked) / shadowed, static_cast<double>(free) / lit};
}

TEST(OccluderSweep, WallSeenEdgeOn) {
  Sweep sweep{.stem = "occluder-wall",
              .title = "A wall seen edge-on, with a lamp behind it",
              .x_label = "thickness of the wall, mm",
              .y_label = "fraction of the space that is right",
              .x = {1, 2, 3, 5, 8, 13, 20, 50},
              .curves = {{"in shadow"}, {"lit"}, {"in shadow, measured surfaces alone"}},
              .logarithmic = true,
              .min = 0.85};
  capture::Session session;
  session.color.model = small_camera();
  for (const double thickness_mm : sweep.x) {
    const reconstruct::TestRoom room = walled_room(static_cast<float>(1e-3 * thickness_mm));
    const auto field = seen_edge_on(room, session);
    const auto result = reconstruct::AlbedoStage(session).solve(*field, room.illumination());
    const Shares with = correct_shares(room, *reconstruct::OccluderMerge().merged(field, result.occluders));
    sweep.curves[0].y.push_back(with.shadowed);
    sweep.curves[1].y.push_back(with.lit);
    sweep.curves[2].y.push_back(correct_shares(room, *field).shadowed);
    // A thinner edge lies between pixels, which are 3.4 mm apart there: no depth shows that anything hides space.
    if (thickness_mm > 2.5) {
      EXPECT_GT(with.shadowed, sweep.min) << thickness_mm;
    }
    EXPECT_GT(with.lit, 0.97) << thickness_mm;
  }
  write_sweep(sweep);
}

}  // namespace
}  // namespace lumigraft::test
