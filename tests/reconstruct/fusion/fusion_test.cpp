#include "reconstruct/fusion/fusion.h"

#include <gtest/gtest.h>

#include <utility>

#include "reconstruct/fusion/fusion_level.h"
#include "reconstruct/math/depth_noise.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using namespace test;

TEST(Fusion, WeightsAreThoseOfTheCamerasPrinciple) {
  const capture::CameraModel camera = test::small_camera();
  const double height_m = 1.6;
  const Isometry3d T_tag_camera = test::looking_at_tag(height_m, 0, 0);
  for (const auto principle : {capture::DepthPrinciple::structured_light, capture::DepthPrinciple::time_of_flight,
                               capture::DepthPrinciple::stereo}) {
    capture::Session session = session_with(camera);
    session.depth.emplace();
    session.depth->principle = principle;
    session.depth->noise_scale = 1.5;
    FusionStage stage(session, {});
    const auto field = stage.fuse(frame_of(table, camera, T_tag_camera), pose_at(T_tag_camera));
    const auto brick = field->brick({0, 0, 0});
    ASSERT_TRUE(brick);
    const double sigma_m = capture::usual_noise(principle, 1.5).sigma_m(height_m, 0);
    EXPECT_NEAR(brick->weight[0], kMinDepthSigma_m * kMinDepthSigma_m / (sigma_m * sigma_m), 2e-3)
        << capture::name_of(principle);
  }
}

TEST(Fusion, ATableFromOnePicture) {
  const capture::CameraModel camera = test::small_camera();
  for (const double tilt : {0.0, 40.0, 65.0}) {
    const Isometry3d T_tag_camera = test::looking_at_tag(0.85, tilt * kDegree, -1.3);
    FusionStage stage(session_with(camera), {});
    const auto field = stage.fuse(frame_of(table, camera, T_tag_camera), pose_at(T_tag_camera));
    ASSERT_TRUE(field);
    EXPECT_EQ(field->version, 1u);
    const Agreement seen = compare(*field, table, camera, T_tag_camera, 16);
    EXPECT_LT(seen.largest_m, 1e-4) << tilt;
    EXPECT_LT(seen.normal_deg, 0.1) << tilt;
    EXPECT_EQ(seen.hit_fraction, 1) << tilt << ": no holes";
    // Distances are to the plane, not along the ray.
    for (float z = -0.015f; z <= 0.03f; z += 0.005f) {
      const auto sample = field->sample(Vector3f(0.02f, -0.03f, z));
      ASSERT_TRUE(sample) << z;
      EXPECT_NEAR(sample->distance_m, std::min(z, 0.032f), 2e-3f) << tilt << " " << z;
    }
    EXPECT_FALSE(field->sample(Vector3f(0.02f, -0.03f, -0.05f))) << "beyond truncation nothing is known";
  }
}

TEST(Fusion, ABallOnATable) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T_tag_camera = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionStage stage(session_with(camera), {});
  const auto field = stage.fuse(frame_of(ball_on_table, camera, T_tag_camera), pose_at(T_tag_camera));
  ASSERT_TRUE(field);
  const Agreement seen = compare(*field, ball_on_table, camera, T_tag_camera);
  EXPECT_LT(seen.mean_m, 3e-4);
  EXPECT_GT(seen.hit_fraction, 0.98);
  EXPECT_LT(seen.normal_deg, 2);

  // No skirt between ball and table: points far from both are not solid.
  int inside = 0;
  for (const auto& [key, brick] : field->bricks)
    for (int i = 0; i < kBrickVoxels; ++i) {
      const Vector3d p = 0.008 * Vector3d(8 * key[0] + i % 8, 8 * key[1] + i / 8 % 8, 8 * key[2] + i / 64);
      inside += brick->weight[i] > 0 && brick->distance_m[i] < 0 && ball_on_table(p) > 0.012;
    }
  EXPECT_EQ(inside, 0);
}

TEST(Fusion, SeveralViewsCloseTheBall) {
  const capture::CameraModel camera = test::small_camera();
  FusionStage stage(session_with(camera), {});
  std::shared_ptr<const DistanceField> field;
  for (int i = 0; i < 12; ++i) {
    const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, i * 30 * kDegree, {0.1, 0.15, 0});
    field = stage.fuse(frame_of(ball_on_table, camera, T, i), pose_at(T));
  }
  EXPECT_EQ(field->version, 12u);
  double sum = 0;
  int hits = 0, rays = 0;
  for (double polar = 5; polar < 100; polar += 6)
    for (double azimuth = 0; azimuth < 360; azimuth += 20) {
      const Vector3f n(std::sin(polar * kDegree) * std::cos(azimuth * kDegree),
                       std::sin(polar * kDegree) * std::sin(azimuth * kDegree), std::cos(polar * kDegree));
      const auto hit = field->raycast(kBall.cast<float>() + 0.15f * n, -n, 0, 0.15f);
      ++rays;
      if (!hit) continue;
      ++hits;
      sum += std::abs(ball(hit->position_m.cast<double>()));
    }
  EXPECT_GT(hits, rays * 98 / 100);
  EXPECT_LT(sum / hits, 1e-3);
}

TEST(Fusion, NoisyPicturesAverage) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(1.2, 45 * kDegree, -1.3);
  FusionStage stage(session_with(camera), {});
  double first = 0;
  std::shared_ptr<const DistanceField> field;
  for (unsigned i = 0; i < 16; ++i) {
    field = stage.fuse(frame_of(table, camera, T, i, {1, i + 1}), pose_at(T));
    if (i == 0) first = compare(*field, table, camera, T, 16).mean_m;
  }
  const Agreement last = compare(*field, table, camera, T, 16);
  EXPECT_LT(first, 2e-3);
  EXPECT_LT(last.mean_m, 0.45 * first);
  EXPECT_LT(last.normal_deg, 4);
  EXPECT_GT(last.hit_fraction, 0.995);
}

// No NaN between the two sides of a thin object, with noise and wrong poses.
TEST(Fusion, EveryDistanceIsFinite) {
  const capture::CameraModel camera = test::small_camera();
  const Shape plate = [](const Vector3d& p) {
    const Vector3d q = (p - Vector3d(0, 0, 0.2)).cwiseAbs() - Vector3d(0.25, 0.01, 0.2);
    return std::min(table(p), q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0));
  };
  FusionStage stage(session_with(camera), {});
  std::shared_ptr<const DistanceField> field;
  for (unsigned i = 0; i < 12; ++i) {
    const Isometry3d T = test::looking_at_tag(1.1, 60 * kDegree, (-90 + 75.0 * i) * kDegree);
    Isometry3d off = T;
    off.translation().y() += 0.012 * (i % 3 - 1.0);
    field = stage.fuse(frame_of(plate, camera, T, i, {1, i + 1}), pose_at(off));
  }
  for (const auto& [key, brick] : field->bricks) {
    for (std::size_t i = 0; i < brick->distance_m.size(); ++i) {
      ASSERT_TRUE(std::isfinite(brick->distance_m[i]) && std::isfinite(brick->weight[i]))
          << key[0] << ' ' << key[1] << ' ' << key[2] << ", voxel " << i;
    }
  }
}

TEST(Fusion, ARemovedObjectIsCarved) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionSettings settings;
  settings.weight_cap = 2;
  FusionStage stage(session_with(camera), settings);
  stage.fuse(frame_of(ball_on_table, camera, T), pose_at(T));
  std::shared_ptr<const DistanceField> field;
  for (unsigned i = 1; i < 30; ++i) field = stage.fuse(frame_of(table, camera, T, i, {0.01, i}), pose_at(T));
  EXPECT_LT(compare(*field, table, camera, T, 16).largest_m, 1e-3);
}

// In ten seconds the weights reach their cap; afterwards the newest frames must still count.
TEST(Fusion, AVisitorIsGoneWithinASecond) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  constexpr double kLegRadius = 0.08;
  const Vector3d leg(0.05, 0.15, 0);
  const Shape visited = [&](const Vector3d& p) { return std::min(table(p), (p - leg).head<2>().norm() - kLegRadius); };
  FusionStage stage(session_with(camera), {});
  unsigned i = 0;
  const auto fuse = [&](const capture::FrameSet& frame) { return stage.fuse(frame, pose_at(T)); };
  // A few images in turns: new noise for each frame would take minutes.
  std::vector<capture::FrameSet> with, without;
  for (unsigned k = 0; k < 4; ++k) {
    with.push_back(frame_of(visited, camera, T, k, {0.5, k + 1}));
    without.push_back(frame_of(table, camera, T, k, {0.5, k + 11}));
  }
  const auto left = [&](const DistanceField& field) {  // number of rays that still hit the leg
    int hits = 0;
    for (double z = 0.05; z < 0.3; z += 0.02)
      for (double y = -0.06; y <= 0.06; y += 0.02) {
        const Vector3d aim(leg.x(), leg.y() + y, z);
        const Vector3d direction = (aim - T.translation()).normalized();
        const auto hit = field.raycast(T.translation().cast<float>(), direction.cast<float>(), 0.05f, 3);
        hits += hit && hit->position_m.z() > 0.02f;
      }
    return hits;
  };
  std::shared_ptr<const DistanceField> field;
  for (; i < 10; ++i) field = fuse(without[i % 4]);
  for (; i < 15; ++i) field = fuse(with[i % 4]);
  EXPECT_GT(left(*field), 70) << "visible after five frames, of 91 rays";
  for (; i < 300; ++i) field = fuse(with[i % 4]);
  EXPECT_GT(left(*field), 70);
  for (unsigned k = 0; k < 30; ++k, ++i) field = fuse(without[i % 4]);
  EXPECT_EQ(left(*field), 0);
}

// The same by a camera that sees more bricks than it may update in a frame.
TEST(Fusion, AVisitorIsGoneThoughTheWorkOfAFrameIsBounded) {
  const capture::CameraModel camera = test::small_camera();
  const Vector3d leg(0.05, 0.15, 0);
  const Shape visited = [&](const Vector3d& p) { return std::min(table(p), (p - leg).head<2>().norm() - 0.08); };
  const FusionSettings settings;
  FusionLevel level(session_with(camera), settings, {{0, 5}, 5, 150, true, true});
  const auto solid = [&](const DistanceField& field) {  // voxels of the leg
    int voxels = 0;
    for (const auto& [key, brick] : field.bricks)
      for (int i = 0; i < kBrickVoxels; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (!(brick->weight[k] > 0 && brick->distance_m[k] < 0)) continue;
        const Vector3d p = settings.voxel_m * voxel_in(key, i).cast<double>();
        voxels += p.z() > 0.05 && (p - leg).head<2>().norm() < 0.12;
      }
    return voxels;
  };
  std::shared_ptr<const DistanceField> field;
  int known = 0;
  for (unsigned i = 0; i < 60; ++i) {
    const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3 + 0.01 * (i % 8));
    field = level.fuse(frame_of(i < 30 ? visited : Shape(table), camera, T, i, {0.5, i % 8 + 1}), pose_at(T), 0, {});
    if (i == 29) known = solid(*field);
  }
  EXPECT_GT(known, 1000);
  EXPECT_LT(solid(*field), known / 20);
}

// The same far away, where noise is as large as the truncation distance, and in front of a jump in depth.
TEST(Fusion, AFarVisitorInFrontOfAJumpIsGoneWithinASecond) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(3.4, 0, 0);
  const Shape step = [](const Vector3d& p) {
    return std::min(p.z(), std::max(p.x(), p.z() - 0.4));  // half of the floor is 0.4 m higher
  };
  const Shape visited = [&](const Vector3d& p) {
    return std::min(step(p), (p.cwiseAbs() - Vector3d(0.2, 0.2, 0.56)).maxCoeff());  // close to the background
  };
  FusionStage stage(session_with(camera), {});
  std::vector<capture::FrameSet> with, without;
  for (unsigned k = 0; k < 4; ++k) {
    with.push_back(frame_of(visited, camera, T, k, {0.3, k + 1}));
    without.push_back(frame_of(step, camera, T, k, {0.3, k + 11}));
  }
  std::shared_ptr<const DistanceField> field;
  const auto left = [&] {  // solid voxels of the visitor
    int solid = 0;
    for (const auto& [key, brick] : field->bricks)
      for (std::size_t i = 0; i < kBrickVoxels; ++i)
        solid += 8 * key[2] + static_cast<int>(i) / 64 > 60 && brick->weight[i] > 0 && brick->distance_m[i] < 0;
    return solid;
  };
  unsigned i = 0;
  for (; i < 10; ++i) field = stage.fuse(without[i % 4], pose_at(T));
  EXPECT_EQ(left(), 0);
  for (; i < 110; ++i) field = stage.fuse(with[i % 4], pose_at(T));
  EXPECT_GT(left(), 5000);
  for (unsigned k = 0; k < 30; ++k, ++i) field = stage.fuse(without[i % 4], pose_at(T));
  EXPECT_EQ(left(), 0);
}

// A camera position is published even if the frame has no measurement and no brick drifted.
TEST(Fusion, ViewpointsArePublishedThoughNothingDrifted) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 0, 0), T_away = test::looking_at_tag(1.5, 0, 0);
  const Shape nothing = [](const Vector3d&) { return 10.0; };
  FusionStage stage(session_with(camera), {});
  std::shared_ptr<const DistanceField> before, field;
  for (unsigned i = 0; i < 10; ++i) before = stage.fuse(frame_of(table, camera, T, i), pose_at(T));
  for (unsigned i = 10; i < 20; ++i) field = stage.fuse(frame_of(nothing, camera, T_away, i), pose_at(T_away));
  EXPECT_EQ(before->seen_from_m.size(), 1u);
  ASSERT_EQ(field->seen_from_m.size(), 2u);
  EXPECT_LT((field->seen_from_m[1] - T_away.translation().cast<float>()).norm(), 1e-3f);
  EXPECT_EQ(field->version, before->version + 1);
  for (const auto& [key, brick] : field->bricks) EXPECT_EQ(before->brick(key), brick.get());
}

// Only bricks that changed get a new pointer: relight uploads those.
TEST(Fusion, AnUpdateTouchesOnlyWhatChanged) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionStage stage(session_with(camera), {});
  std::shared_ptr<const DistanceField> before, field;
  for (unsigned i = 0; i < 50; ++i) before = stage.fuse(frame_of(table, camera, T, i, {0.01, i + 1}), pose_at(T));
  for (unsigned i = 50; i < 54; ++i)
    field = stage.fuse(frame_of(ball_on_table, camera, T, i, {0.01, i + 1}), pose_at(T));
  int near = 0, far = 0;
  for (const auto& [key, brick] : field->bricks) {
    if (before->brick(key) == brick.get()) continue;
    const Vector3d middle = 0.064 * (Vector3d(key[0], key[1], key[2]) + Vector3d::Constant(0.5));
    // Near the ball, or hidden by it.
    const Vector3d along = (middle - T.translation()).normalized(), to = kBall - T.translation();
    const bool is_near = (to - std::min(along.dot(to), to.norm()) * along).norm() < kBallRadius + 0.09;
    ++(is_near ? near : far);
  }
  EXPECT_GT(near, 10);
  EXPECT_LT(far, 3) << "of " << field->bricks.size();
}

// Bricks exist near surfaces only: with half the voxel there are four times as many.
TEST(Fusion, MemoryFollowsTheSurface) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  const capture::FrameSet frame = frame_of(ball_on_table, camera, T);
  const auto bricks = [&](double voxel_m) {
    FusionSettings settings;
    settings.voxel_m = voxel_m;
    FusionStage stage(session_with(camera), settings);
    return static_cast<double>(stage.fuse(frame, pose_at(T))->bricks.size());
  };
  const double growth = bricks(0.008) / bricks(0.016);
  EXPECT_GT(growth, 3);
  EXPECT_LT(growth, 5);
}

// A large room enters the image when the camera turns: it is fused in several frames, the nearest first.
TEST(Fusion, TheWorkOfAFrameIsBounded) {
  capture::CameraModel camera = test::small_camera();
  const Shape hall = [](const Vector3d& p) { return std::min({p.z() + 1, 2 - p.y(), 2 + p.x(), 2 - p.x()}); };
  const Isometry3d T = test::looking_at_tag(2.2, 70 * kDegree, -1.6);
  FusionStage stage(session_with(camera), {});
  const Isometry3d T_down = test::looking_at_tag(0.5, 5 * kDegree, -1.6);
  std::shared_ptr<const DistanceField> before =
                                           stage.fuse(frame_of(hall, camera, T_down, 0, {0.1, 1}), pose_at(T_down)),
                                       field;
  std::size_t first = 0;
  for (unsigned i = 1; i < 13; ++i) {
    field = stage.fuse(frame_of(hall, camera, T, i, {0.1, i + 1}), pose_at(T));
    std::size_t changed = 0;
    for (const auto& [key, brick] : field->bricks) changed += before->brick(key) != brick.get();
    // Every fourth publication contains what earlier frames changed a little.
    EXPECT_LE(changed, kUpdateSchedule.max_bricks * (i == 1 ? 1 : kPublication.interval_frames)) << i;
    if (i == 1) first = field->bricks.size();
    before = field;
  }
  EXPECT_GT(field->bricks.size(), 1.5 * static_cast<double>(first)) << "or the room is too small for this test";
  EXPECT_GT(compare(*field, hall, camera, T, 16).hit_fraction, 0.99);
}

// A day of walking in a hall of 12 m, in time-lapse: memory stays within its bound, and a place that was evicted is
// fused again when it is seen again.
TEST(Fusion, MemoryIsBoundedInAHall) {
  capture::CameraModel camera = test::small_camera();
  camera.width /= 2, camera.height /= 2;
  camera.fx = camera.fy /= 2;
  camera.cx = camera.width / 2.0, camera.cy = camera.height / 2.0;
  const Shape hall = [](const Vector3d& p) {
    const double pillar = (Vector3d(p.x() - 3 * std::round(p.x() / 3), p.y() - 3 * std::round(p.y() / 3), 0)).norm();
    return std::min({p.z(), 6 - std::abs(p.x()), 6 - std::abs(p.y()), pillar - 0.3});
  };
  FusionSettings settings;
  settings.max_memory_mb = 150;
  FusionStage stage(session_with(camera), settings);
  const auto pose_of = [](double turn) {
    Isometry3d T = test::looking_at_tag(1.5, 40 * kDegree, turn);
    T.pretranslate(Vector3d(4.5 * std::cos(turn), 4.5 * std::sin(turn), 0));
    return T;
  };
  constexpr unsigned kRound = 80;
  std::shared_ptr<const DistanceField> field;
  for (unsigned i = 0; i < 2 * kRound; ++i) {
    const Isometry3d T = pose_of(2 * M_PI * i / kRound);
    field = stage.fuse(frame_of(hall, camera, T, i), pose_at(T));
    const FusionStage::Memory memory = stage.memory();
    ASSERT_LE(memory.used_bytes, 1.02e6 * settings.max_memory_mb) << i;
    ASSERT_LE(memory.bricks, 1e6 * settings.max_memory_mb / sizeof(FieldBrick)) << i;
  }
  EXPECT_GT(stage.memory().evicted, stage.memory().bricks) << "or the hall is too small for this test";
  const Isometry3d T = pose_of(0.5);
  for (unsigned i = 0; i < 24; ++i) field = stage.fuse(frame_of(hall, camera, T, i, {0.1, i + 1}), pose_at(T));
  EXPECT_GT(compare(*field, hall, camera, T, 16).hit_fraction, 0.98) << "seen again";
}

TEST(Fusion, TheSameFramesGiveTheSameField) {
  const capture::CameraModel camera = test::small_camera();
  const auto run = [&] {
    FusionStage stage(session_with(camera), {});
    std::shared_ptr<const DistanceField> field;
    for (unsigned i = 0; i < 3; ++i) {
      const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3 + 0.1 * i);
      field = stage.fuse(frame_of(ball_on_table, camera, T, i, {1, i}), pose_at(T));
    }
    return field;
  };
  const auto a = run(), b = run();
  ASSERT_EQ(a->bricks.size(), b->bricks.size());
  auto other = b->bricks.begin();
  for (const auto& [key, brick] : a->bricks) {
    EXPECT_EQ(other->first, key) << "even in the order of bricks";
    EXPECT_EQ(other->second->distance_m, brick->distance_m);
    ASSERT_EQ(other->second->color != nullptr, brick->color != nullptr);
    if (brick->color) {
      EXPECT_EQ(other->second->color->weight, brick->color->weight);
    }
    ++other;
  }
}

TEST(Fusion, ColourBecomesRadiance) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 40 * kDegree, -1.3);
  const auto light = [](const Vector3d& p) { return 0.2 + 0.5 * p.x(); };
  FusionStage stage(session_with(camera), {});
  const auto field = stage.fuse(frame_of(table, camera, T, 0, {}, light), pose_at(T));
  for (float x = -0.2f; x <= 0.2f; x += 0.031f) {
    const auto radiance = field->radiance(Vector3f(x, 0.01f, 0));
    ASSERT_TRUE(radiance);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR((*radiance)[c] * (1 + c), light(Vector3d(x, 0, 0)), 3e-3);
  }
  EXPECT_FALSE(field->radiance(Vector3f(0, 0, 0.025f))) << "colour belongs to surfaces";

  // Clipped pixels do not count.
  FusionStage bright(session_with(camera), {});
  const auto clipped = bright.fuse(
      frame_of(table, camera, T, 0, {}, [](const Vector3d& p) { return p.x() > 0 ? 2.0 : 0.2; }), pose_at(T));
  EXPECT_FALSE(clipped->radiance(Vector3f(0.1f, 0, 0)));
  const Eigen::Vector3i voxel = (Vector3f(0.1f, 0, 0) / clipped->voxel_m).array().round().matrix().cast<int>();
  const FieldBrick* bound = clipped->brick(brick_of(voxel));
  ASSERT_TRUE(bound);
  EXPECT_GT(bound->radiance(static_cast<std::size_t>(index_in_brick(voxel))).minCoeff(), 0) << "a lower bound";
  ASSERT_TRUE(clipped->radiance(Vector3f(-0.1f, 0, 0)));
  EXPECT_TRUE(clipped->sample(Vector3f(0.1f, 0, 0)));
}

// Red clips in the frames with a light of 0.8, and green in those of 1.4.
TEST(Fusion, ChannelsThatDoNotClipAreKnown) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d T = test::looking_at_tag(0.85, 40 * kDegree, -1.3);
  FusionStage stage(session_with(camera), {});
  std::uint64_t index = 0;
  const auto after = [&](double light) {
    std::shared_ptr<const DistanceField> field;
    for (int i = 0; i < 10; ++i) {  // not every change is published at once, and equal frames are fused once
      const double now = i % 2 == 0 ? light : 1.02 * light;
      field = stage.fuse(frame_of(table, camera, T, index++, {}, [=](const Vector3d&) { return now; }), pose_at(T));
    }
    const Eigen::Vector3i voxel = (Vector3f(0.1f, 0, 0) / field->voxel_m).array().round().matrix().cast<int>();
    const FieldBrick* brick = field->brick(brick_of(voxel));
    const auto i = static_cast<std::size_t>(index_in_brick(voxel));
    return std::make_pair(brick->clipped_channels(i), brick->radiance(i));
  };
  EXPECT_EQ(after(1.4).first, 1 + 2);
  const auto [clipped, radiance] = after(0.8);
  EXPECT_EQ(clipped, 1);
  EXPECT_NEAR(radiance[0], 0.5f, 0.01f) << "a lower bound: exposure is 2";
  EXPECT_NEAR(radiance[2], 1.02f * 1.4f / 3, 0.01f) << "the most that was seen";
  EXPECT_EQ(after(1.4).first, 1) << "once known";
  EXPECT_EQ(after(0.3).first, 0);
}

TEST(Fusion, RadianceFollowsTheLight) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d pose = test::looking_at_tag(0.9, 0.8, -1.5);
  const auto radiance_after = [&](double light_change) {
    FusionStage stage(test::session_with(camera), FusionSettings{});
    const auto lit = [](double radiance) { return [radiance](const Vector3d&) { return radiance; }; };
    for (std::uint64_t i = 0; i < 40; ++i)
      stage.fuse(test::frame_of(test::table, camera, pose, i, {}, lit(0.4)), test::pose_at(pose));
    const auto field =
        stage.fuse(test::frame_of(test::table, camera, pose, 40, {}, lit(0.1)), test::pose_at(pose), light_change);
    return field->radiance(Vector3f(0.05f, 0.01f, 0))->x();
  };
  EXPECT_NEAR(radiance_after(0.75), 0.1, 0.005) << "in the same frame";
  EXPECT_GT(radiance_after(0), 0.35) << "no light changed: one of many observations";
  // A change of 1σ of an observation: both count alike.
  EXPECT_NEAR(radiance_after(kRadianceMemory.log_sigma), 0.25, 0.04);
}

// A lamp that is carried past a place changes its light by much more than that of the room.
TEST(Fusion, RadianceFollowsALampCarriedPast) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d pose = test::looking_at_tag(0.9, 0.8, -1.5);
  FusionStage stage(test::session_with(camera), FusionSettings{});
  const auto lit = [](double radiance) { return [radiance](const Vector3d&) { return radiance; }; };
  const Vector3f place(0.05f, 0.01f, 0);
  for (std::uint64_t i = 0; i < 40; ++i)
    stage.fuse(test::frame_of(test::table, camera, pose, i, {}, lit(0.1)), test::pose_at(pose));
  double radiance = 0.1;
  for (std::uint64_t i = 40; i < 48; ++i) {
    radiance *= 1.2;
    // To first order: surfaces that turn to the lamp get more.
    const auto ratio = [](const Vector3f&) { return Eigen::Array3f::Constant(1.13f).eval(); };
    const auto field =
        stage.fuse(test::frame_of(test::table, camera, pose, i, {}, lit(radiance)), test::pose_at(pose), 0.02, ratio);
    EXPECT_NEAR(field->radiance(place)->x(), radiance, 0.02 * radiance) << i;
  }
}

TEST(Fusion, ColoursOfACoveredLensAreNotFused) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d pose = test::looking_at_tag(0.9, 0.8, -1.5);
  FusionStage stage(test::session_with(camera), FusionSettings{});
  const auto lit = [](double radiance) { return [radiance](const Vector3d&) { return radiance; }; };
  stage.fuse(test::frame_of(test::table, camera, pose, 0, {}, lit(0.4)), test::pose_at(pose));
  capture::FrameSet covered = test::frame_of(test::table, camera, pose, 1, {}, lit(0.01));
  covered.color_shows_room = false;
  const auto field = stage.fuse(covered, test::pose_at(pose), 0.75);  // else a frame would be one of many
  EXPECT_NEAR(field->radiance(Vector3f(0.05f, 0.01f, 0))->x(), 0.4, 0.01);
}

// The first frame with light shows half of a brick.
TEST(Fusion, ColoursReturnAfterADarkRoom) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d pose = test::looking_at_tag(0.9, 0.8, -1.5);
  const Vector3f seen(0.01f, 0.01f, 0), hidden(0.05f, 0.01f, 0);
  const auto half_table = [](const Vector3d& p) { return std::max(test::table(p), p.x() - 0.03); };
  const auto lit = [](double radiance) { return [radiance](const Vector3d&) { return radiance; }; };
  const auto times = [](float ratio) {
    return [ratio](const Vector3f&) { return Eigen::Array3f::Constant(ratio).eval(); };
  };
  FusionStage stage(test::session_with(camera), FusionSettings{});
  stage.fuse(test::frame_of(test::table, camera, pose, 0, {}, lit(0.4)), test::pose_at(pose));
  capture::FrameSet dark = test::frame_of(test::table, camera, pose, 1, {}, lit(0));
  dark.color_shows_room = false;
  auto field = stage.fuse(dark, test::pose_at(pose), 0.98, times(0.02f));
  EXPECT_NEAR(field->radiance(seen)->x(), 0.008, 0.001);
  EXPECT_NEAR(field->radiance(hidden)->x(), 0.008, 0.001);
  field = stage.fuse(test::frame_of(half_table, camera, pose, 2, {}, lit(0.4)), test::pose_at(pose), 0.98, times(50));
  EXPECT_NEAR(field->radiance(seen)->x(), 0.4, 0.01);
  EXPECT_NEAR(field->radiance(hidden)->x(), 0.4, 0.01);
}

// The light doubles before the camera's exposure follows: the frame shows a lower bound of the table's radiance.
TEST(Fusion, ColoursThatClipFollowTheLight) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d pose = test::looking_at_tag(0.9, 0.8, -1.5);
  const auto lit = [](double radiance) { return [radiance](const Vector3d&) { return radiance; }; };
  FusionStage stage(test::session_with(camera), FusionSettings{});
  for (std::uint64_t i = 0; i < 5; ++i)
    stage.fuse(test::frame_of(test::table, camera, pose, i, {}, lit(0.4)), test::pose_at(pose));
  const auto doubled = [](const Vector3f&) { return Eigen::Array3f(2, 2, 2); };
  const auto field =
      stage.fuse(test::frame_of(test::table, camera, pose, 5, {}, lit(0.8)), test::pose_at(pose), 0.5, doubled);
  EXPECT_NEAR(field->radiance(Vector3f(0.01f, 0.01f, 0))->x(), 0.8, 0.01);
}

// A camera that looked at the table looks elsewhere, and half of the light goes out.
TEST(Fusion, UnseenRadianceFollowsTheLight) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d here = test::looking_at_tag(0.9, 0.8, -1.5);
  Isometry3d elsewhere = here;
  elsewhere.pretranslate(Vector3d(3, 0, 0));
  const auto lit = [](const Vector3d&) { return 0.4; };
  const Vector3f seen_before(0.05f, 0.01f, 0);
  const auto radiance_after = [&](double light_change, const auto& light_ratio) {
    FusionStage stage(test::session_with(camera), FusionSettings{});
    for (std::uint64_t i = 0; i < 5; ++i)
      stage.fuse(test::frame_of(test::table, camera, here, i, {}, lit), test::pose_at(here));
    const auto frame = test::frame_of(test::table, camera, elsewhere, 5, {}, lit);
    return stage.fuse(frame, test::pose_at(elsewhere), light_change, light_ratio)->radiance(seen_before)->x();
  };
  const auto halved = [](const Vector3f&) { return Eigen::Array3f(0.5f, 0.5f, 0.5f); };
  EXPECT_NEAR(radiance_after(0.5, halved), 0.2, 0.005);
  EXPECT_NEAR(radiance_after(0, halved), 0.4, 0.005) << "no light changed";
}

TEST(Fusion, RadianceFollowsTheLightWhileThePoseIsNotMeasured) {
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d here = test::looking_at_tag(0.9, 0.8, -1.5);
  FusionStage stage(test::session_with(camera), FusionSettings{});
  const auto frame = test::frame_of(test::table, camera, here, 0, {}, [](const Vector3d&) { return 0.4; });
  Pose pose = test::pose_at(here);
  const auto off = [](const Vector3f&) { return Eigen::Array3f::Zero().eval(); };
  EXPECT_FALSE(stage.fuse(frame, {.age_ns = 1}, 1, off)) << "nothing is known";
  stage.fuse(frame, pose);
  pose.age_ns = 1;
  const auto field = stage.fuse(frame, pose, 1, off);
  EXPECT_EQ(field->radiance({0.05f, 0.01f, 0})->x(), 0);
  EXPECT_EQ(stage.fuse(frame, pose), field) << "no light changed";
}

TEST(Fusion, ADistortedLens) {
  capture::CameraModel camera = test::small_camera();
  camera.distortion = {-0.2, 0.05, 0.001, -0.001, 0};
  const Isometry3d T = test::looking_at_tag(0.85, 50 * kDegree, -1.3);
  FusionStage stage(session_with(camera), {});
  const auto field = stage.fuse(frame_of(ball_on_table, camera, T), pose_at(T));
  const Agreement seen = compare(*field, ball_on_table, camera, T, 16);
  EXPECT_LT(seen.mean_m, 5e-4);
  EXPECT_GT(seen.hit_fraction, 0.98);
}

}  // namespace
}  // namespace lumigraft::reconstruct
