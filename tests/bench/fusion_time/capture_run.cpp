#include "tests/bench/fusion_time/capture_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

#include "reconstruct/fusion/fusion.h"
#include "reconstruct/pose/depth_points.h"
#include "tests/bench/fusion_time/resident_memory.h"
#include "tests/reconstruct/seven_scenes.h"

namespace lumigraft::test {
namespace {

/// The values need not be sorted. 0 if there are none.
double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Distances in mm of depth points from a field's surface.
struct SurfaceError {
  std::vector<double> off_mm;
  std::size_t points = 0;  ///< also those in unknown space

  void add(const reconstruct::DepthGrid& grid, const reconstruct::DistanceField& field,
           const Eigen::Isometry3f& T_tag_camera, float far_m) {
    for (const auto& point : grid.points) {
      if (!(point.position.z() > 0) || point.position.z() > far_m) continue;
      ++points;
      const auto sample = field.sample(T_tag_camera * point.position);
      if (sample) off_mm.push_back(1e3 * static_cast<double>(std::abs(sample->distance_m)));
    }
  }
  void print(const char* name) const {
    std::printf("  %-34s median %.2f mm, 95 %% %.1f mm, known %.1f %%\n", name, quantile(off_mm, 0.5),
                quantile(off_mm, 0.95), 100.0 * static_cast<double>(off_mm.size()) / static_cast<double>(points));
  }
};

}  // namespace

void measure_capture(const std::filesystem::path& folder) {
  constexpr unsigned kEvaluated = 5;  // every fifth frame
  constexpr float kNear_m = 2;
  const reconstruct::FusionSettings settings;
  const auto far_m = static_cast<float>(settings.far_m);
  const capture::CameraModel camera = seven_scenes_camera();
  capture::Session session;
  session.color.model = camera;
  reconstruct::FusionStage stage(session, settings);
  const reconstruct::DepthSampler sampler(camera);
  std::vector<double> ms;
  SurfaceError next, next_near, last;
  std::vector<std::pair<reconstruct::DepthGrid, Eigen::Isometry3f>> evaluated;
  std::shared_ptr<const reconstruct::DistanceField> field;
  std::optional<Eigen::Isometry3d> T_world_tag;
  const double before_mb = resident_mb();
  unsigned last_number = 0;
  for (unsigned number = 0; number < last_number + 100; ++number) {
    const auto read = seven_scenes_frame(folder, number);
    if (!read) continue;
    last_number = number;
    if (!T_world_tag) T_world_tag = read->T_world_camera;
    reconstruct::Pose pose;
    pose.T_tag_camera = pose.T_tag_camera_raw = T_world_tag->inverse() * read->T_world_camera;
    if (number % kEvaluated == 0) {
      const Eigen::Isometry3f T_tag_camera = pose.T_tag_camera.cast<float>();
      const auto& [grid, at] = evaluated.emplace_back(sampler.sample(read->frame.depth->depth_m), T_tag_camera);
      if (field) next.add(grid, *field, at, far_m);
      if (field) next_near.add(grid, *field, at, kNear_m);
    }
    const std::clock_t start = std::clock();
    field = stage.fuse(read->frame, pose);
    ms.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  if (!field) {
    std::printf("%s: no frame\n", folder.c_str());
    return;
  }
  for (const auto& [grid, T_tag_camera] : evaluated) last.add(grid, *field, T_tag_camera, far_m);
  std::printf("%s, %zu frames, CPU ms: median %.1f, 95 %% %.1f, max %.1f; %zu bricks published, RSS + %.0f MB\n",
              folder.c_str(), ms.size(), quantile(ms, 0.5), quantile(ms, 0.95), quantile(ms, 1), field->bricks.size(),
              resident_mb() - before_mb);
  next.print("the next frame's points");
  next_near.print("the same within 2 m");
  last.print("all points, final field");
}

}  // namespace lumigraft::test
