#include "tests/bench/comparators/contenders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "relight/objects/placement.h"
#include "relight/quality.h"
#include "relight/tracing/build_trace_scene.h"
#include "server/bench/settings.h"
#include "server/pipeline/make_renderer.h"
#include "server/truth/reference_truth.h"
#include "tests/bench/comparators/composition.h"
#include "tests/bench/comparators/instant_radiosity.h"
#include "tests/bench/comparators/room_model.h"
#include "tests/bench/comparators/thesis_plan.h"
#include "tests/bench/comparators/vct_difference.h"

namespace lumigraft::comparators {
namespace {

constexpr server::OracleParts kTrue{true, true, true, true};
constexpr double kDegree = std::numbers::pi / 180;
constexpr float kLongestEdge_m = 0.02f;  // of the room's triangles, because albedo is per vertex
constexpr std::array<int, 2> kLightPaths{256, 1024};

double time_s(const Contest& contest) { return static_cast<double>(contest.scene.frame.time_ns) * 1e-9; }

relight::PosedCamera camera_of(const Contest& contest) {
  return {contest.input.session.color.model, contest.scene.scene.pose->T_tag_camera.cast<float>()};
}

std::shared_ptr<const relight::ReferenceScene> scene_with(const Contest& contest, const relight::Exhibit& exhibit) {
  auto scene = std::make_shared<relight::ReferenceScene>(*contest.room);
  scene->objects = relight::reference_objects_of(exhibit, time_s(contest));
  return scene;
}

capture::Image<std::uint8_t> shown(const Contest& contest, const capture::Image<float>& added,
                                   const capture::Image<float>& coverage) {
  return composed(contest.scene.camera, added, coverage, static_cast<float>(contest.input.session.color.exposure));
}

/// The box covered by dvct's outer volume.
Eigen::AlignedBox3f reach_of(const Contest& contest, const relight::Plan& plan) {
  std::vector<relight::PlacedBounds> bounds;
  for (const relight::ReferenceMesh& object : relight::reference_objects_of(contest.input.exhibit, time_s(contest))) {
    std::vector<Eigen::Vector3f> points_m;
    relight::PlacedBounds& placed = bounds.emplace_back();
    for (const Eigen::Vector3f& p : object.model->positions_m) {
      points_m.push_back(object.T_tag_model * p);
      placed.box.extend(points_m.back());
    }
    placed.sphere = relight::bounding_sphere(points_m);
  }
  const relight::shader::vec4 outer = relight::place_volumes(bounds, plan.volume, /*max_voxel_m=*/0).cascade[1];
  const Eigen::Vector3f low = outer.head<3>() - Eigen::Vector3f::Constant(0.5f * outer.w());
  return {low, low + Eigen::Vector3f::Constant(static_cast<float>(plan.volume) * outer.w())};
}

reconstruct::StageCost less(const reconstruct::StageCost& a, const reconstruct::StageCost& b) {
  return {a.wall_ms - b.wall_ms, a.cpu_ms - b.cpu_ms};
}

/// The camera picture plus the difference of two pictures.
Drawn with_difference(const Contest& contest, const std::shared_ptr<const relight::ReferenceScene>& scene,
                      const capture::Image<float>& with, const capture::Image<float>& without,
                      const reconstruct::StageCost& of_room) {
  const reconstruct::CostClock clock;
  const capture::Image<float> coverage = object_coverage(relight::TraceWorld(scene), camera_of(contest));
  const reconstruct::StageCost of_mask = clock.elapsed();
  return {shown(contest, difference(with, without, coverage), coverage), of_room, of_mask};
}

Contender by_plan(const Contest& contest, const std::string& method, const std::string& setting,
                  const relight::Plan& plan) {
  const std::shared_ptr<relight::Renderer> renderer =
      server::make_renderer(contest.input.session, plan, kTrue, contest.device);
  return {method, setting, plan, true, false, [&contest, plan, renderer](const relight::Exhibit& exhibit) {
            return Drawn{renderer->relight(contest.scene.frame, contest.scene.scene, exhibit, plan).srgb, {}, {}};
          }};
}

Contender ours(const Contest& contest, const std::string& method, const std::string& setting) {
  for (const server::BenchSetting& known : server::bench_settings(method))
    if (known.name == setting) return by_plan(contest, method, setting, known.plan);
  throw std::invalid_argument(method + " has no setting " + setting);
}

/// `volume`: 256³ voxels are slow on software devices.
Contender thesis(const Contest& contest, int volume) {
  relight::Plan plan = thesis_plan(4);
  plan.volume = volume;
  return by_plan(contest, "dvct-thesis", "thesis-" + std::to_string(volume) + "-1-bounce", plan);
}

Contender vct_difference(const Contest& contest, relight::Plan plan, const std::string& setting) {
  plan.method = "dvct";
  const auto room = room_model(relight::TraceWorld(contest.room), reach_of(contest, plan), kLongestEdge_m);
  const auto solutions = std::make_shared<VctDifference>(contest.device, contest.input.session, room);
  return {"vct-difference", setting, plan, true, true, [&contest, plan, solutions](const relight::Exhibit& exhibit) {
            const server::BenchScene& s = contest.scene;
            solutions->forget_without();
            const reconstruct::CostClock clock;
            const capture::Image<float> without = solutions->without(s.frame, s.scene, plan);
            const reconstruct::StageCost of_room = clock.elapsed();
            const capture::Image<float> with = solutions->with(s.frame, s.scene, exhibit, plan);
            return with_difference(contest, scene_with(contest, exhibit), with, without, of_room);
          }};
}

}  // namespace

Contest open_contest(const std::filesystem::path& session, const std::shared_ptr<relight::gpu::Device>& device) {
  Contest contest{device, server::open_bench_session(session, kTrue), {}, nullptr};
  contest.scene = server::learn_bench_scene(contest.input.session, kTrue, kTrue);
  contest.room = server::TrueRoom(contest.input.session).at(contest.scene.frame);
  return contest;
}

std::vector<Contender> cone_contenders(const Contest& contest) {
  return {ours(contest, "dvct", "half-64"),
          ours(contest, "dlpv", "half-64"),
          ours(contest, "rays", "half-20-rays"),
          thesis(contest, 64),
          thesis(contest, 128),
          vct_difference(contest, relight::Plan{}, "half-64")};
}

std::vector<Contender> ray_contenders(const Contest& contest, double budget_ms) {
  std::vector<Contender> contenders;
  for (const int paths : kLightPaths) {
    contenders.push_back({"instant-radiosity",
                          std::to_string(paths) + "-light-paths",
                          {},
                          false,
                          false,
                          [&contest, paths](const relight::Exhibit& exhibit) {
                            InstantRadiosityOptions options;
                            options.light_paths = paths;
                            const relight::ReferencePicture picture =
                                instant_radiosity(scene_with(contest, exhibit), camera_of(contest), options);
                            capture::Image<float> added = picture.change;
                            for (std::size_t i = 0; i < added.data.size(); ++i) added.data[i] += picture.object.data[i];
                            return Drawn{shown(contest, added, picture.coverage), {}, {}};
                          }});
  }
  // Both pictures use the same paths as long as no object is hit, so most noise cancels.
  const auto two_pictures = [&contest](const relight::Exhibit& exhibit, int samples) {
    const auto scene = scene_with(contest, exhibit);
    const relight::DeltaPathTracer tracer(scene);
    const relight::ReferenceSamples how{.per_pixel = samples};
    const capture::Image<float> with = tracer.radiance(camera_of(contest), how, true);
    const capture::Image<float> without = tracer.radiance(camera_of(contest), how, false);
    return with_difference(contest, scene, with, without, {});
  };
  const auto change = [&contest](const relight::Exhibit& exhibit, int samples) {
    const relight::DeltaPathTracer tracer(scene_with(contest, exhibit));
    relight::ReferencePicture picture = tracer.change(camera_of(contest), {.per_pixel = samples});
    for (std::size_t i = 0; i < picture.change.data.size(); ++i) picture.change.data[i] += picture.object.data[i];
    return Drawn{shown(contest, picture.change, picture.coverage), {}, {}};
  };
  const auto at_equal_time = [&](const char* method, auto draw) {
    const auto cost_ms = [&](int samples) {
      const reconstruct::CostClock clock;
      const Drawn drawn = draw(contest.input.exhibit, samples);
      return less(clock.elapsed(), drawn.not_counted).cpu_ms;
    };
    // The fixed cost is in both measurements.
    const double one_ms = cost_ms(1), each_ms = std::max((cost_ms(3) - one_ms) / 2, 0.1 * one_ms);
    const int samples = std::max(1 + static_cast<int>(std::lround((budget_ms - one_ms) / each_ms)), 1);
    relight::Plan plan;
    plan.samples = samples;
    contenders.push_back({method, "equal-time", plan, false, false,
                          [draw, samples](const relight::Exhibit& exhibit) { return draw(exhibit, samples); }});
  };
  at_equal_time("path-difference", two_pictures);
  at_equal_time("path-change", change);
  return contenders;
}

std::vector<server::BenchRow> measured(const Contest& contest, const std::vector<Contender>& contenders) {
  struct Costs {
    reconstruct::StageCost moving, moving_kept, still, still_kept;
  };
  std::vector<Costs> costs(contenders.size());
  std::vector<server::BenchRow> rows;
  const auto timed = [&](const Contender& contender, const relight::Exhibit& exhibit,
                         capture::Image<std::uint8_t>* picture) {
    const reconstruct::CostClock clock;
    Drawn drawn = contender.draw(exhibit);
    const reconstruct::StageCost all = less(clock.elapsed(), drawn.not_counted);
    if (picture) *picture = std::move(drawn.srgb);
    return std::pair(all, less(all, drawn.of_room));
  };
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Contender& contender = contenders[i];
    capture::Image<std::uint8_t> picture;
    std::tie(costs[i].still, costs[i].still_kept) = timed(contender, contest.input.exhibit, &picture);
    server::BenchRow& row = rows.emplace_back(server::BenchRow{
        contest.input.session.name, contender.method, contender.setting, name_of(kTrue), contender.plan, {}});
    row.run.measures = server::measure_picture(picture, contest.scene.camera, contest.scene.truth);
    if (contender.keeps)
      std::tie(costs[i].still, costs[i].still_kept) = timed(contender, contest.input.exhibit, nullptr);
  }
  const relight::Exhibit after = server::turned(contest.input.exhibit, kDegree);
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    std::tie(costs[i].moving, costs[i].moving_kept) = timed(contenders[i], after, nullptr);
  }
  std::vector<server::BenchRow> result;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].run.still.host = costs[i].still;
    rows[i].run.moving.host = costs[i].moving;
    result.push_back(rows[i]);
    if (!contenders[i].two_ways) continue;
    rows[i].setting += "-room-kept";
    rows[i].run.still.host = costs[i].still_kept;
    rows[i].run.moving.host = costs[i].moving_kept;
    result.push_back(rows[i]);
  }
  return result;
}

}  // namespace lumigraft::comparators
