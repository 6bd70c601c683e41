// Objects at other places and in other poses than in the view whose light they are drawn with.
#include "relight/views/reprojected_objects.h"

#include <cmath>

#include "relight/tracing/build_trace_scene.h"
#include "relight/views/view_lighting.h"
#include "tests/relight/closed_form/bending_bar.h"

namespace lumigraft::test {
namespace {

constexpr float kMark = 7;  ///< radiance that no surface has

/// The light of one view of a scene, and its objects at other times and places.
class Reprojection {
 public:
  explicit Reprojection(const ClosedScene& scene)
      : scene_(scene),
        session_(scene.session()),
        frame_(scene.frame()),
        rays_(session_.color.model),
        camera_(session_.color),
        lighting_(session_, {}, nullptr, relight::ViewLighting::Views::nearby) {
    const reconstruct::Scene room = scene.scene();
    frame_.depth = nullptr;  // else mattes hide what is behind the surface that it shows
    std::vector<relight::gpu::PassTime> passes;
    relight::PassClock clock(passes);
    camera_.take(frame_);
    lighting_.enter(std::make_shared<const relight::RayRoom>(room, std::vector<relight::KnownSurface>(), session_.tag));
    const relight::Exhibit exhibit = lighting_.prepare(scene.exhibit, nullptr);
    lighting_.follow(room, relight::reference_objects_of(exhibit, 0), rays_plan(2), clock);
    lighting_.find(frame_, camera_, scene.T_tag_camera().cast<float>(), rays_plan(2), false, clock);
    view = lighting_.found();
  }

  /// Objects as they are in the exhibit at that time; without depth.
  relight::ObjectLayer drawn(const relight::Exhibit& exhibit, double time_s = 0) {
    relight::MovedObjects::Trees trees;
    const relight::MovedObjects objects(view, relight::reference_objects_of(exhibit, time_s), trees);
    const relight::CameraRays eye{rays_, {session_.color.model, scene_.T_tag_camera().cast<float>()}};
    const relight::CurrentDepth none(rays_, nullptr, scene_.voxel_m);
    return relight::reprojected_objects(view, objects, view.room, eye, none);
  }
  void mark() {
    for (std::size_t i = 0; i < view.objects.radiance.data.size(); ++i)
      view.objects.radiance.data[i] = kMark * view.objects.coverage.data[i / 3];
  }
  /// As if the view had shown other objects.
  void forget_seen() {
    for (relight::ViewSurface& surface : view.object_surfaces) surface.known = false;
  }

  relight::ViewLight view;

 private:
  ClosedScene scene_;
  capture::Session session_;
  capture::FrameSet frame_;
  relight::PixelRays rays_;
  relight::CameraUpload camera_;
  relight::ViewLighting lighting_;
};

/// Of the covered pixels, the fraction whose radiance is marked.
double marked(const relight::ObjectLayer& layer) {
  int all = 0, some = 0;
  for (std::size_t i = 0; i < layer.coverage.data.size(); ++i) {
    if (layer.coverage.data[i] < 1) continue;
    ++all;
    some += std::abs(layer.radiance.data[3 * i] - kMark) < 0.01f ? 1 : 0;
  }
  return all > 50 ? static_cast<double>(some) / all : 0;
}

double sum_of(const std::vector<float>& values) {
  double sum = 0;
  for (const float value : values) sum += value;
  return sum;
}

TEST(ReprojectedObjects, PointsKeepTheirRadianceWhereverTheyAre) {
  ClosedScene scene = box_on_floor();
  Reprojection reprojection(scene);
  reprojection.mark();
  EXPECT_GT(marked(reprojection.drawn(scene.exhibit)), 0.97) << "pixels of an edge show two faces";
  scene.exhibit.objects.front().position_m += Eigen::Vector3d(0.12, 0.05, 0.03);
  EXPECT_GT(marked(reprojection.drawn(scene.exhibit)), 0.85) << "the camera sees a little more of one side";
  scene.exhibit.objects.front().rotation = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ());
  EXPECT_LT(marked(reprojection.drawn(scene.exhibit)), 0.6) << "the other sides are seen for the first time";
}

TEST(ReprojectedObjects, PointsOfAnObjectThatBendsToo) {
  const ClosedScene scene = bar_on_floor();
  Reprojection reprojection(scene);
  reprojection.mark();
  EXPECT_GT(marked(reprojection.drawn(scene.exhibit, 0.4)), 0.7) << "by 36 degrees";
}

// A board between lamp and box shades a part of it.
TEST(ReprojectedObjects, SurfaceThatTheViewDidNotShowHasTheLightAndTheShadowsOfLamps) {
  ClosedScene scene = box_on_floor();
  scene.sky = 0;
  scene.exhibit.objects.push_back(box_object({0.16f, -0.05f, 0.25f}, {0.22f, 0.2f, 0.45f}, 0.9f));
  scene.exhibit.objects.back().name = "board";
  Reprojection reprojection(scene);
  const relight::ObjectLayer seen = reprojection.drawn(scene.exhibit);
  reprojection.forget_seen();
  const relight::ObjectLayer unseen = reprojection.drawn(scene.exhibit);
  double difference = 0;
  for (std::size_t i = 0; i < seen.radiance.data.size(); ++i)
    difference += std::abs(seen.radiance.data[i] - unseen.radiance.data[i]);
  EXPECT_LT(difference / sum_of(seen.radiance.data), 0.1);
}

TEST(ReprojectedObjects, TheRoomHidesWhatIsBehindIt) {
  ClosedScene scene = box_on_floor();
  Reprojection reprojection(scene);
  scene.exhibit.objects.front().position_m.z() -= 0.1;  // half of the box is below the floor
  const double lowered = sum_of(reprojection.drawn(scene.exhibit).coverage.data);
  Reprojection other(scene);
  EXPECT_NEAR(lowered / sum_of(other.view.objects.coverage.data), 1, 0.05);
  // Also where the view did not look.
  for (relight::ViewSurface& surface : reprojection.view.room.surfaces) surface.known = false;
  EXPECT_NEAR(sum_of(reprojection.drawn(scene.exhibit).coverage.data) / lowered, 1, 0.01);
}

}  // namespace
}  // namespace lumigraft::test
