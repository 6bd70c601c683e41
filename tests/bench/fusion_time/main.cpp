// CPU time of fusing 640 x 480 depth frames with sensor noise at 8 mm voxels, of a table-top in the corner of a 2 m
// room that lies entirely in the field. Median over the frames of each film, of the minimum of five runs per frame.
//
//   build/release/fusion_time
//
// With a folder of a real capture (tests/reconstruct/seven_scenes.h): time, surface and memory of fusing its frames.
//
//   build/release/fusion_time redkitchen/data
//
// Memory while a camera walks about in a large hall, a frame a second; a day has 36000 of ten hours:
//
//   build/release/fusion_time walk 36000
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "tests/bench/fusion_time/capture_run.h"
#include "tests/bench/fusion_time/walk.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::test {
namespace {

/// Signed distance of the cube from -1 to 1 m; the camera sees a table with a ball, and two walls.
double corner_of_room(const Eigen::Vector3d& p) { return std::min({ball_on_table(p), 1 - p.x(), 1 - p.y()}); }

/// A hall of 12 x 8 x 5 m; the camera, over its middle, sees it in part up to 8 m.
double hall(const Eigen::Vector3d& p) { return std::min({p.z(), 5 - p.z(), 6 - std::abs(p.x()), 4 - std::abs(p.y())}); }

struct Film {
  const char* name;
  double way_m, turn_rad;  ///< per frame
  Shape shape = corner_of_room;
  double tilt_rad = 55 * kDegree, far_m = 6;  ///< of the camera's axis from the vertical; range of the depth camera
};

void measure(const Film& film) {
  capture::CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525;
  camera.cx = 319.5;
  camera.cy = 239.5;
  constexpr int kPictures = 32, kWarmUp = 8, kRuns = 5;
  const auto pose_of = [&](int i) {
    const double azimuth = -2.4 + film.turn_rad * i;
    return looking_at_tag(1.3 + film.way_m * i, film.tilt_rad, azimuth, {0.1, 0.1, 0});
  };
  std::vector<capture::FrameSet> frames;
  for (unsigned i = 0; i < kPictures; ++i)
    frames.push_back(frame_of(film.shape, camera, pose_of(static_cast<int>(i)), i, {1, i + 1}, nullptr, film.far_m));
  std::vector<double> ms(kPictures, 1e9);
  std::size_t bricks = 0;
  for (int run = 0; run < kRuns; ++run) {
    reconstruct::FusionStage stage(session_with(camera), {});
    for (int i = 0; i < kPictures; ++i) {
      const std::clock_t start = std::clock();
      const auto field = stage.fuse(frames[static_cast<std::size_t>(i)], pose_at(pose_of(i)));
      double& min_ms = ms[static_cast<std::size_t>(i)];
      min_ms = std::min(min_ms, 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
      bricks = field->bricks.size();
    }
  }
  const double first = ms.front(), second = ms[1];
  std::sort(ms.begin() + kWarmUp, ms.end());
  std::printf("%-28s %6zu bricks, CPU ms: first picture %5.1f, second %5.1f, later median %5.1f, max %5.1f\n",
              film.name, bricks, first, second, ms[(kWarmUp + kPictures) / 2], ms.back());
}

}  // namespace
}  // namespace lumigraft::test

int main(int count, char** arguments) {
  using lumigraft::test::measure;
  if (count == 3 && std::string(arguments[1]) == "walk") {
    lumigraft::test::measure_walk(std::atoi(arguments[2]));
    return 0;
  }
  if (count > 1) {
    lumigraft::test::measure_capture(arguments[1]);
    return 0;
  }
  measure({"camera at rest", 0, 0});
  measure({"hand-held, 5 mm a picture", 0.003, 0.004});
  measure({"walking, 30 mm a picture", 0.01, 0.025});
  measure({"the same, hall of 12 m", 0.01, 0.025, lumigraft::test::hall, 80 * lumigraft::test::kDegree, 14});
  measure({"the same, depth up to 5 m", 0.01, 0.025, lumigraft::test::hall, 80 * lumigraft::test::kDegree, 5});
}
