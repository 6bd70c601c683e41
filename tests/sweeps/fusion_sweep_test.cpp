// Limits of depth fusion: thin plates, holes, grazing views, distance, wrong poses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "reconstruct/fusion/fusion.h"
#include "tests/reconstruct/fusion/fusion_views.h"
#include "tests/reconstruct/fusion/real_surface_views.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Rays along a direction from a grid of origins: how many miss the surface or hit it more than 10 mm away, and the
/// error of the others.
struct Found {
  double missed_percent = 0, off_mm = 0;
};
Found find(const reconstruct::DistanceField& field, const std::vector<Vector3f>& from, const Vector3f& direction,
           float reach_m, const Shape& shape) {
  int missed = 0;
  double off_m = 0;
  for (const Vector3f& start : from) {
    const auto hit = field.raycast(start, direction, 0, reach_m);
    const double away = hit ? std::abs(shape(hit->position_m.cast<double>())) : 1;
    if (away > 0.01)
      ++missed;
    else
      off_m += away;
  }
  const double met = static_cast<double>(from.size()) - missed;
  return {100.0 * missed / static_cast<double>(from.size()), met > 0 ? 1e3 * off_m / met : 0};
}

/// A grid of points on the plane z = height.
std::vector<Vector3f> grid(float reach_m, float step_m, float height_m) {
  std::vector<Vector3f> places;
  for (float x = -reach_m; x <= reach_m; x += step_m)
    for (float y = -reach_m; y <= reach_m; y += step_m) places.emplace_back(x, y, height_m);
  return places;
}

TEST(FusionSweep, ThinPlate) {
  Sweep sweep{.stem = "fusion-plate",
              .title = "A standing plate; voxels of 8 mm, pictures with half the noise of a Kinect",
              .x_label = "thickness, mm",
              .y_label = "percent of rays that miss it; mm off",
              .x = {2, 4, 8, 16, 40},
              .curves = {{"one side: missed"}, {"all round: missed"}, {"all round: mm off"}},
              .logarithmic = true};
  const capture::CameraModel camera = small_camera();
  const Vector3d middle(0, 0, 0.25);
  std::vector<Vector3f> front, back;
  for (float x = -0.19f; x < 0.2f; x += 0.021f)
    for (float z = 0.12f; z < 0.39f; z += 0.021f) {
      front.emplace_back(x, -0.2f, z);
      back.emplace_back(x, 0.2f, z);
    }
  for (const double thickness_mm : sweep.x) {
    const Vector3d half(0.25, 0.5e-3 * thickness_mm, 0.2);
    const Shape plate = [&](const Vector3d& p) { return std::min(table(p), box(p, middle, half)); };
    const auto fused = [&](unsigned pictures, double first_degrees, double step_degrees) {
      reconstruct::FusionStage stage(session_with(camera), {});
      std::shared_ptr<const reconstruct::DistanceField> field;
      for (unsigned i = 0; i < pictures; ++i) {
        const Isometry3d T =
            looking_at_tag(1.1, 65 * kDegree, (first_degrees + step_degrees * i) * kDegree, {0, 0, 0.2});
        field = stage.fuse(frame_of(plate, camera, T, i, {0.5, i + 1}), pose_at(T));
      }
      return field;
    };
    const Found one_side = find(*fused(4, -111, 14), front, Vector3f::UnitY(), 0.3f, plate);
    const auto field = fused(12, -90, 75);
    const Found a = find(*field, front, Vector3f::UnitY(), 0.3f, plate);
    const Found b = find(*field, back, -Vector3f::UnitY(), 0.3f, plate);
    const double missed = (a.missed_percent + b.missed_percent) / 2, off_mm = (a.off_mm + b.off_mm) / 2;
    sweep.curves[0].y.push_back(one_side.missed_percent);
    sweep.curves[1].y.push_back(missed);
    sweep.curves[2].y.push_back(off_mm);
    EXPECT_EQ(one_side.missed_percent, 0) << thickness_mm;
    // A plate thinner than half a voxel may lie between voxels that are all outside it.
    EXPECT_LT(missed, thickness_mm < 4 ? 60 : thickness_mm < 8 ? 10 : 2) << thickness_mm;
    EXPECT_LT(off_mm, thickness_mm < 40 ? 3.5 : 0.2) << thickness_mm;
  }
  write_sweep(sweep);
}

TEST(FusionSweep, Hole) {
  Sweep sweep{.stem = "fusion-hole",
              .title = "A black patch of a table gives no depth; 12 pictures from many sides",
              .x_label = "radius of the patch, mm",
              .y_label = "percent of it, from two voxels off its rim",
              .x = {20, 30, 50, 100, 200},
              .curves = {{"known"}, {"solid"}, {"known, seen before it was black"}},
              .logarithmic = true};
  constexpr unsigned kPictures = 12, kComplete = 4;
  const capture::CameraModel camera = small_camera();
  std::vector<capture::FrameSet> frames;
  const auto pose_of = [](unsigned i) { return looking_at_tag(0.85, 50 * kDegree, (-90 + 10.0 * i) * kDegree); };
  for (unsigned i = 0; i < kPictures; ++i) frames.push_back(frame_of(table, camera, pose_of(i), i, {0.5, i + 1}));
  for (const double radius_mm : sweep.x) {
    const double radius = 1e-3 * radius_mm, inner = radius - 0.016;
    reconstruct::FusionStage always(session_with(camera), {}), later(session_with(camera), {});
    std::shared_ptr<const reconstruct::DistanceField> field, seen_before;
    for (unsigned i = 0; i < kPictures; ++i) {
      const Isometry3d T = pose_of(i);
      auto depth = std::make_shared<capture::DepthFrame>(*frames[i].depth);
      for (int v = 0; v < camera.height; ++v)
        for (int u = 0; u < camera.width; ++u) {
          const Vector3d direction = T.linear() * *camera.unproject({static_cast<double>(u), static_cast<double>(v)});
          const Vector3d p = T.translation() - T.translation().z() / direction.z() * direction;
          if (p.head<2>().norm() < radius) depth->depth_m.at(u, v) = 0;
        }
      capture::FrameSet holed = frames[i];
      holed.depth = depth;
      field = always.fuse(holed, pose_at(T));
      seen_before = later.fuse(i < kComplete ? frames[i] : holed, pose_at(T));
    }
    int points = 0, known = 0, solid = 0, kept = 0;
    for (const float z : {-0.02f, -0.012f, -0.004f, 0.004f, 0.012f, 0.02f})
      for (const Vector3f& p : grid(static_cast<float>(inner), 0.004f, z)) {
        if (p.head<2>().norm() > inner) continue;
        const auto sample = field->sample(p);
        ++points;
        known += sample.has_value();
        solid += sample && sample->distance_m < 0;
        kept += seen_before->sample(p).has_value();
      }
    for (std::size_t c = 0; c < 3; ++c)
      sweep.curves[c].y.push_back(100.0 * (c == 0 ? known : c == 1 ? solid : kept) / points);
    EXPECT_LE(known, 0.01 * points) << radius_mm << ": neither free nor solid";
    EXPECT_EQ(solid, 0) << radius_mm;
    EXPECT_GT(kept, 0.99 * points) << radius_mm << ": what is not seen now is not forgotten";
  }
  write_sweep(sweep);
}

// Depth of a mirror is that of the reflection. Unless the operator declares the mirror, it becomes a room behind a hole
// in the wall.
TEST(FusionSweep, Mirror) {
  Sweep sweep{
      .stem = "fusion-mirror",
      .title = "A mirror in a wall, with what it reflects behind it",
      .x_label = "edge of the mirror, mm",
      .y_label = "percent of rays",
      .x = {100, 200, 400},
      .curves = {{"wall around it: missed"}, {"mirror: missed"}, {"ghosts"}, {"named: missed"}, {"named: ghosts"}},
      .logarithmic = true};
  constexpr double kWall = 0.5;
  const capture::CameraModel camera = small_camera();
  const Isometry3d T = looking_at_tag(1.1, 70 * kDegree, -90 * kDegree, {0, 0.3, 0.25});
  for (const double edge_mm : sweep.x) {
    const double half = 0.5e-3 * edge_mm, height = 0.25;
    const Shape room = [](const Vector3d& p) { return ball_on_table(p); };
    const auto outside = [&](const Vector3d& p) { return std::max(std::abs(p.x()), std::abs(p.z() - height)) - half; };
    const Shape seen = [&](const Vector3d& p) {
      const double wall = std::max(std::max(kWall - p.y(), p.y() - kWall - 0.01), -outside(p));
      const double mirrored = room(Vector3d(p.x(), 2 * kWall - p.y(), p.z()));
      return std::min({std::max(room(p), p.y() - kWall), wall, std::max(mirrored, kWall - p.y())});
    };
    const auto fused = [&](bool named) {
      capture::Session session = session_with(camera);
      if (named) {
        session.real_surfaces = {real_surface("mirror", box_faces({0, kWall + 0.01, height}, {half, 0.01, half}))};
        session.real_surfaces[0].metallic = 1;
        session.real_surfaces[0].roughness = 0.02f;
      }
      reconstruct::FusionStage stage(session, {});
      std::shared_ptr<const reconstruct::DistanceField> field;
      for (unsigned i = 0; i < 5; ++i) field = stage.fuse(frame_of(seen, camera, T, i, {0.5, i + 1}), pose_at(T));
      EXPECT_TRUE(stage.warnings().empty());
      return field;
    };
    struct Rays {
      double missed_outside = 0, missed = 0, ghosts = 0;
    };
    const auto rays_of = [&](const reconstruct::DistanceField& field) {
      Rays rays;
      int all_outside = 0, all = 0;
      for (double x = -0.3; x <= 0.3; x += 0.013)
        for (double z = 0.06; z <= 0.44; z += 0.013) {
          const Vector3d aim(x, kWall, z), direction = (aim - T.translation()).normalized();
          const double away = outside(aim);
          if (std::abs(away) < 0.012) continue;
          const auto hit = field.raycast(T.translation().cast<float>(), direction.cast<float>(), 0.05f, 6);
          const bool before = hit && hit->position_m.y() < kWall - 0.012f;  // the ball
          if (before) continue;
          const bool missed = !hit || hit->position_m.y() > kWall + 0.012f;
          ++(away > 0 ? all_outside : all);
          (away > 0 ? rays.missed_outside : rays.missed) += missed;
          if (away < 0) rays.ghosts += hit && missed;
        }
      rays.missed_outside *= 100.0 / all_outside;
      rays.missed *= 100.0 / all;
      rays.ghosts *= 100.0 / all;
      return rays;
    };
    const Rays plain = rays_of(*fused(false)), named = rays_of(*fused(true));
    sweep.curves[0].y.push_back(std::max(plain.missed_outside, named.missed_outside));
    sweep.curves[1].y.push_back(plain.missed);
    sweep.curves[2].y.push_back(plain.ghosts);
    sweep.curves[3].y.push_back(named.missed);
    sweep.curves[4].y.push_back(named.ghosts);
    EXPECT_LT(sweep.curves[0].y.back(), 1) << edge_mm << ": what is real is not carved";
    EXPECT_LT(named.missed, 1) << edge_mm;
    EXPECT_LT(named.ghosts, 1) << edge_mm;
  }
  write_sweep(sweep);
}

TEST(FusionSweep, Visitor) {
  Sweep sweep{.stem = "fusion-visitor",
              .title = "A visitor's leg on a table leaves; 30 pictures a second",
              .x_label = "frames that it was there",
              .y_label = "pictures until the last of it is gone",
              .x = {3, 30, 300},
              .curves = {{"at 1 m"}, {"at 3.5 m"}},
              .logarithmic = true,
              .min = 0,
              .max = 30};
  const capture::CameraModel camera = small_camera();
  const double distances[] = {1, 3.5};
  for (std::size_t c = 0; c < 2; ++c) {
    const Isometry3d T = looking_at_tag(distances[c], 50 * kDegree, -1.3);
    const Vector3d leg(0.05, 0.15, 0);
    const Shape visited = [&](const Vector3d& p) {
      return std::min(table(p), std::max((p - leg).head<2>().norm() - 0.08, p.z() - 0.4));
    };
    std::vector<capture::FrameSet> with, without;
    for (unsigned k = 0; k < 4; ++k) {
      with.push_back(frame_of(visited, camera, T, k, {0.5, k + 1}));
      without.push_back(frame_of(table, camera, T, k, {0.5, k + 11}));
    }
    std::vector<Vector3f> towards_it;  // viewing directions of the ball's pixels
    for (int v = 2; v < camera.height; v += 4)
      for (int u = 2; u < camera.width; u += 4) {
        const Vector3d direction = T.linear() * *camera.unproject({static_cast<double>(u), static_cast<double>(v)});
        const auto along = march(visited, T.translation(), direction);
        if (along && table(T.translation() + *along * direction) > 0.05) towards_it.push_back(direction.cast<float>());
      }
    const auto left = [&](const reconstruct::DistanceField& field) {
      int met = 0;
      for (const Vector3f& direction : towards_it) {
        const auto hit = field.raycast(T.translation().cast<float>(), direction, 0.05f, 5);
        met += hit && hit->position_m.z() > 0.05f;
      }
      return met;
    };
    for (const double frames_there : sweep.x) {
      reconstruct::FusionStage stage(session_with(camera), {});
      std::shared_ptr<const reconstruct::DistanceField> field;
      unsigned i = 0;
      for (unsigned k = 0; k < 10; ++k, ++i) field = stage.fuse(without[i % 4], pose_at(T));
      EXPECT_EQ(left(*field), 0) << distances[c];
      for (unsigned k = 0; k < frames_there; ++k, ++i) field = stage.fuse(with[i % 4], pose_at(T));
      EXPECT_GT(left(*field), 10) << distances[c] << " " << frames_there;
      int gone = 0;
      for (; gone < 60 && left(*field) > 0; ++gone, ++i) field = stage.fuse(without[i % 4], pose_at(T));
      sweep.curves[c].y.push_back(gone);
      EXPECT_LE(gone, sweep.max) << distances[c] << " " << frames_there << ": within a second";
    }
  }
  write_sweep(sweep);
}

TEST(FusionSweep, Grazing) {
  Sweep sweep{.stem = "fusion-grazing",
              .title = "A table from 1.2 m; noise grows with incidence",
              .x_label = "incidence at the middle, degrees",
              .y_label = "mm off; percent of places that are missing",
              .x = {0, 30, 50, 65, 75, 80, 84, 87},
              .curves = {{"1 picture: mm"}, {"6 pictures: mm"}, {"6 pictures, missing"}}};
  const capture::CameraModel camera = small_camera();
  const std::vector<Vector3f> above = grid(0.08f, 0.016f, 0.02f);
  for (const double tilt : sweep.x) {
    reconstruct::FusionStage stage(session_with(camera), {});
    std::shared_ptr<const reconstruct::DistanceField> field;
    const Isometry3d T = looking_at_tag(1.2, tilt * kDegree, -1.3);
    Found first, last;
    for (unsigned i = 0; i < 6; ++i) {
      field = stage.fuse(frame_of(table, camera, T, i, {1, i + 1, true}), pose_at(T));
      last = find(*field, above, -Vector3f::UnitZ(), 0.05f, table);
      if (i == 0) first = last;
    }
    sweep.curves[0].y.push_back(first.off_mm);
    sweep.curves[1].y.push_back(last.off_mm);
    sweep.curves[2].y.push_back(last.missed_percent);
    if (tilt > 85) {
      EXPECT_EQ(last.missed_percent, 100) << "beyond 84 degrees nothing is taken for known";
      continue;
    }
    EXPECT_LT(first.off_mm, 1.5) << tilt;
    EXPECT_LT(last.off_mm, 0.6) << tilt;
    EXPECT_LT(last.missed_percent, tilt > 80 ? 40 : 0.1) << tilt;
  }
  write_sweep(sweep);
}

TEST(FusionSweep, Distance) {
  Sweep sweep{
      .stem = "fusion-distance",
      .title = "A wall faced squarely, with noise",
      .x_label = "distance, m",
      .y_label = "mm off; percent of places that are missing",
      .x = {0.5, 1, 2, 3, 4, 4.5},
      .curves = {{"1 picture: mm"}, {"6 pictures: mm"}, {"6 pictures, missing"}, {"noise of a pixel mm", {}, true}}};
  const capture::CameraModel camera = small_camera();
  for (const double distance : sweep.x) {
    reconstruct::FusionStage stage(session_with(camera), {});
    std::shared_ptr<const reconstruct::DistanceField> field;
    const Isometry3d T = looking_at_tag(distance, 0, 0);
    const float reach = 0.35f * static_cast<float>(distance);
    const std::vector<Vector3f> above = grid(reach, reach / 10, 0.025f);
    Found first, last;
    for (unsigned i = 0; i < 6; ++i) {
      field = fuse_all(stage, frame_of(table, camera, T, i, {1, i + 1}), pose_at(T));
      last = find(*field, above, -Vector3f::UnitZ(), 0.05f, table);
      if (i == 0) first = last;
    }
    const double noise_mm = 1e3 * capture::DepthNoise().sigma_m(distance, 0);
    sweep.curves[0].y.push_back(first.off_mm);
    sweep.curves[1].y.push_back(last.off_mm);
    sweep.curves[2].y.push_back(last.missed_percent);
    sweep.curves[3].y.push_back(noise_mm);
    EXPECT_LT(last.off_mm, 0.2 * noise_mm) << distance;
    EXPECT_LT(last.missed_percent, distance >= 3 ? 25 : 0.1) << distance;
  }
  write_sweep(sweep);
}

TEST(FusionSweep, WrongPoses) {
  Sweep sweep{.stem = "fusion-pose",
              .title = "A ball on a table from many sides; each pose is off by a chance of its own",
              .x_label = "sigma of the camera's place, mm; 0.05 degrees with each",
              .y_label = "mm off; percent of rays that miss",
              .x = {0, 1, 2, 4, 8},
              .curves = {{"surface mm"}, {"missed"}}};
  const capture::CameraModel camera = small_camera();
  constexpr unsigned kPictures = 16;
  const auto pose_of = [](unsigned i) { return looking_at_tag(0.85, 50 * kDegree, (-90 + 4.0 * i) * kDegree); };
  std::vector<capture::FrameSet> frames;
  for (unsigned i = 0; i < kPictures; ++i)
    frames.push_back(frame_of(ball_on_table, camera, pose_of(i), i, {0.5, i + 1}));
  for (const double sigma_mm : sweep.x) {
    std::mt19937 random(7);
    std::normal_distribution<double> gauss;
    const auto any = [&](double scale) -> Vector3d {
      return Vector3d(gauss(random), gauss(random), gauss(random)) * scale;
    };
    reconstruct::FusionStage stage(session_with(camera), {});
    std::shared_ptr<const reconstruct::DistanceField> field;
    for (unsigned i = 0; i < kPictures; ++i) {
      Isometry3d T = pose_of(i);
      const Vector3d shift = any(1e-3 * sigma_mm), turn = any(0.05 * kDegree * sigma_mm + 1e-12);
      T.translation() += shift;
      T.linear() = T.linear() * Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
      field = stage.fuse(frames[i], pose_at(T));
    }
    const Agreement seen = compare(*field, ball_on_table, camera, pose_of(kPictures / 2), 16);
    sweep.curves[0].y.push_back(1e3 * seen.mean_m);
    sweep.curves[1].y.push_back(100 * (1 - seen.hit_fraction));
    EXPECT_LT(1e3 * seen.mean_m, 0.6 + 0.5 * sigma_mm) << sigma_mm;
    EXPECT_GT(seen.hit_fraction, 0.97) << sigma_mm;
  }
  write_sweep(sweep);
}

}  // namespace
}  // namespace lumigraft::test
