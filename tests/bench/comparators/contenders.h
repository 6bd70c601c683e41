#pragma once
// The methods compared on one session: lumigraft's settings and the reference methods.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "relight/gpu/device.h"
#include "relight/tracing/trace_scene.h"
#include "server/bench/bench_session.h"
#include "server/bench/results.h"
#include "server/pipeline/service_config.h"

namespace lumigraft::comparators {

struct Drawn {
  capture::Image<std::uint8_t> srgb;
  reconstruct::StageCost of_room;      ///< falls away where the room's own picture may be kept from frame to frame
  reconstruct::StageCost not_counted;  ///< of the mask of the objects, by rays: a rasteriser has it for next to nothing
};

struct Contender {
  std::string method, setting;
  relight::Plan plan;
  bool keeps = false;     ///< reuses results between frames: cheaper in static scenes
  bool two_ways = false;  ///< adds a second row, "...-room-kept", without `of_room`
  std::function<Drawn(const relight::Exhibit&)> draw;
};

/// A session with the true room of truth/.
struct Contest {
  std::shared_ptr<relight::gpu::Device> device;
  server::ServiceInput input;
  server::BenchScene scene;
  std::shared_ptr<const relight::ReferenceScene> room;
};
Contest open_contest(const std::filesystem::path& session, const std::shared_ptr<relight::gpu::Device>& device);

/// lumigraft's settings, the first dvct half-64; dvct with the thesis's settings; and the difference of two voxel cone
/// tracing solutions with the plan of the first.
std::vector<Contender> cone_contenders(const Contest& contest);
/// Differential instant radiosity; and path tracing with as many samples as fit into `budget_ms` of CPU time, as the
/// difference of two pictures and as delta path tracing.
std::vector<Contender> ray_contenders(const Contest& contest, double budget_ms);

/// Renders each once for its error, then a frame of each with every object rotated by 1° for its cost.
std::vector<server::BenchRow> measured(const Contest& contest, const std::vector<Contender>& contenders);

}  // namespace lumigraft::comparators
