// What live pictures of rays lose by not waiting for their light: late_light SESSION [TRACE_SCALE [TURN_DEG]]
//
// Plays a session with truth twice, the first time to learn the room. Then light is found for every frame, and each
// picture is drawn with the light of 0, 1, 2, ... frames before. Prints by age: the mean error of the pictures against
// the truth, how far they are from those with their own light, and the processor's time to find light and to draw. With
// TURN_DEG the objects turn by so much per frame: without truth, as that has them at rest.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "capture/source.h"
#include "reconstruct/scene_builder.h"
#include "reconstruct/stage_cost.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/views/light_reprojection.h"
#include "relight/views/view_drawer.h"
#include "relight/views/view_lighting.h"
#include "server/bench/bench_session.h"
#include "server/bench/setting_run.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

using Picture = capture::Image<std::uint8_t>;

constexpr int kMaxAge = 8;  // frames

double rms_codes(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2);
  return std::sqrt(sum / static_cast<double>(a.data.size()));
}

struct Sums {
  double relight_error = 0, object_error = 0, rms_codes = 0, cpu_ms = 0;
  int scored = 0, drawn = 0;
};

class LateLight {
 public:
  LateLight(const capture::Session& session, const relight::Plan& plan)
      : session_(session),
        plan_(plan),
        known_(relight::known_surfaces(session.real_surfaces)),
        lighting_(session, known_, nullptr, relight::ViewLighting::Views::nearby),
        drawer_(session),
        rays_(session.color.model) {}

  void frame(const capture::FrameSet& frame, const reconstruct::Scene& scene, const relight::Exhibit& exhibit,
             const TruePictures* truth) {
    const double time_s = 1e-9 * static_cast<double>(frame.time_ns);
    std::vector<relight::gpu::PassTime> passes;
    relight::PassClock clock(passes);
    if (!lighting_.room() || !lighting_.room()->has_surfaces_of(scene))
      lighting_.enter(std::make_shared<const relight::RayRoom>(scene, known_, session_.tag));
    if (lighting_.room()->illumination() != scene.illumination)
      lighting_.enter(std::make_shared<const relight::RayRoom>(*lighting_.room(), scene.illumination));
    const relight::Exhibit ready = lighting_.prepare(exhibit, nullptr);
    const std::vector<relight::ReferenceMesh> objects = relight::reference_objects_of(ready, time_s);
    drawer_.take(frame, scene.pose, false, clock);
    const Eigen::Isometry3f T = scene.pose->T_tag_camera.cast<float>();
    const reconstruct::CostClock finding;
    lighting_.follow(scene, objects, plan_, clock);
    lighting_.find(frame, drawer_.camera(), T, plan_, false, clock);
    lights_.push_front(lighting_.found());
    found_cpu_ms_ += finding.elapsed().cpu_ms;
    ++found_;
    if (lights_.size() > kMaxAge + 1) lights_.pop_back();

    const relight::CameraRays eye{rays_, {session_.color.model, T}};
    const relight::CurrentDepth depth(rays_, relight::depth_of(frame, session_.color.model),
                                      lighting_.room()->voxel_m(), session_.depth_noise());
    Picture own;
    for (std::size_t age = 0; age < lights_.size(); ++age) {
      const reconstruct::CostClock drawing;
      const relight::MovedObjects moved(lights_[age], objects, trees_);
      const relight::ViewLight& light =
          age == 0 ? lights_[0] : reprojection_.reproject(lights_[age], moved, eye, depth, drawer_.camera(), clock);
      drawer_.draw(light, true, eye, depth, {}, clock);
      Picture picture = *drawer_.camera().coded();
      drawer_.compose(light, frame, true, &picture, clock);
      if (age == 0) own = picture;
      Sums& sum = sums_[age];
      sum.cpu_ms += drawing.elapsed().cpu_ms;
      sum.rms_codes += rms_codes(picture, own);
      ++sum.drawn;
      if (!truth) continue;
      const Measures measures = measure_picture(picture, *drawer_.camera().coded(), *truth);
      sum.relight_error += measures.relight_error;
      sum.object_error += measures.object_error;
      ++sum.scored;
    }
  }

  void print() const {
    std::printf("light: %.1f CPU ms a frame\nage, frames; relight_error; object_error; rms to age 0, codes; CPU ms\n",
                found_cpu_ms_ / found_);
    for (std::size_t age = 0; age < sums_.size(); ++age) {
      const Sums& s = sums_[age];
      if (s.drawn == 0) continue;
      std::printf("%zu; ", age);
      if (s.scored > 0)
        std::printf("%.3f; %.3f; ", s.relight_error / s.scored, s.object_error / s.scored);
      else
        std::printf("-; -; ");
      std::printf("%.2f; %.1f\n", s.rms_codes / s.drawn, s.cpu_ms / s.drawn);
    }
  }

 private:
  capture::Session session_;
  relight::Plan plan_;
  std::vector<relight::KnownSurface> known_;
  relight::ViewLighting lighting_;
  relight::ViewDrawer drawer_;
  relight::PixelRays rays_;
  relight::LightReprojection reprojection_;
  relight::MovedObjects::Trees trees_;
  std::deque<relight::ViewLight> lights_;  ///< the newest first
  std::array<Sums, kMaxAge + 1> sums_;
  double found_cpu_ms_ = 0;
  int found_ = 0;
};

void run(const std::filesystem::path& folder, int trace_scale, double turn_deg) {
  const ServiceInput input = open_bench_session(folder, {});
  const capture::Session& session = input.session;
  relight::Plan plan;
  plan.method = "rays";
  plan.trace_scale = trace_scale;
  plan.rays = trace_scale == 16 ? 8 : 20;
  LateLight bench(session, plan);
  reconstruct::SceneBuilder builder(session, {}, std::make_unique<reconstruct::FramePace>());
  for (int round = 0, frames = 0; round < 2; ++round) {
    const auto reader = capture::open_paired_frames(session);
    builder.restart_tracking();
    while (const auto frame = reader->next(std::chrono::seconds(1))) {
      const reconstruct::BuildResult built = builder.build(*frame);
      ++frames;
      if (round == 0 || !built.scene.pose || !built.scene.field || !built.scene.illumination) continue;
      const std::filesystem::path truth = truth_folder(folder, frame->index);
      std::optional<TruePictures> pictures;
      if (turn_deg == 0 && exists(truth / "augmented.exr"))
        pictures = read_true_pictures(truth, session.color.exposure);
      bench.frame(built.frame, built.scene, turned(input.exhibit, frames * turn_deg * std::numbers::pi / 180),
                  pictures ? &*pictures : nullptr);
    }
  }
  bench.print();
}

}  // namespace
}  // namespace lumigraft::server

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "late_light SESSION [TRACE_SCALE [TURN_DEG]]\n"), 2;
  lumigraft::server::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 16, argc > 3 ? std::atof(argv[3]) : 0);
}
