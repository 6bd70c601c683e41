#include "tests/bench/fusion_time/walk.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <random>
#include <vector>

#include "reconstruct/fusion/fusion.h"
#include "tests/bench/fusion_time/resident_memory.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::test {
namespace {

constexpr double kFar_m = 14;  // of the depth camera: the whole hall

/// The tag is in the middle of the floor.
double hall_with_columns(const Eigen::Vector3d& p) {
  double d = std::min({p.z(), 5 - p.z(), 6 - std::abs(p.x()), 4 - std::abs(p.y())});
  for (const double x : {-3.0, 3.0})
    for (const double y : {-1.5, 1.5}) d = std::min(d, std::hypot(p.x() - x, p.y() - y) - 0.3);
  return d;
}

/// A walker at 1 m/s who turns at the walls and columns, and looks about.
class Walker {
 public:
  Eigen::Isometry3d next() {
    std::normal_distribution<double> gauss;
    turn_rad_ += 0.4 * gauss(random_);
    Eigen::Vector3d ahead = place_m_ + Eigen::Vector3d(std::cos(turn_rad_), std::sin(turn_rad_), 0);
    while (hall_with_columns(ahead) < 0.6) {
      turn_rad_ += 0.7;
      ahead = place_m_ + Eigen::Vector3d(std::cos(turn_rad_), std::sin(turn_rad_), 0);
    }
    place_m_ = ahead;
    const double look_rad = turn_rad_ + 0.8 * gauss(random_), down_rad = 0.3 + 0.2 * gauss(random_);
    const Eigen::Vector3d z(std::cos(down_rad) * std::cos(look_rad), std::cos(down_rad) * std::sin(look_rad),
                            -std::sin(down_rad));
    const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
    T_tag_camera.linear() << x, z.cross(x), z;
    T_tag_camera.translation() = place_m_;
    return T_tag_camera;
  }

 private:
  std::mt19937 random_{7};
  double turn_rad_ = 0;
  Eigen::Vector3d place_m_{0, 0, 1.6};
};

}  // namespace

void measure_walk(int frames) {
  const capture::CameraModel camera = coarse_camera();
  capture::Session session;
  session.color.model = camera;
  const reconstruct::FusionSettings settings;
  reconstruct::FusionStage stage(session, settings);
  Walker walker;
  std::shared_ptr<const reconstruct::DistanceField> read;  // as a renderer does
  const double before_mb = resident_mb();
  std::printf("budget %.0f MB\n", settings.max_memory_mb);
  std::vector<double> ms;
  for (int i = 0; i < frames; ++i) {
    const Eigen::Isometry3d T_tag_camera = walker.next();
    const capture::FrameSet frame = frame_of(hall_with_columns, camera, T_tag_camera, static_cast<std::uint64_t>(i),
                                             {1, static_cast<unsigned>(i) + 1}, nullptr, kFar_m);
    const std::clock_t start = std::clock();
    read = stage.fuse(frame, pose_at(T_tag_camera));
    ms.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    if ((i + 1) % std::max(frames / 8, 1) != 0) continue;
    const auto memory = stage.memory();
    std::nth_element(ms.begin(), ms.begin() + static_cast<std::ptrdiff_t>(ms.size() / 2), ms.end());
    std::printf("%6d frames: RSS + %.0f MB, bricks %.0f MB, %zu evicted so far, median %.1f CPU ms\n", i + 1,
                resident_mb() - before_mb, 1e-6 * static_cast<double>(memory.used_bytes), memory.evicted,
                ms[ms.size() / 2]);
    std::fflush(stdout);
    ms.clear();
  }
}

}  // namespace lumigraft::test
