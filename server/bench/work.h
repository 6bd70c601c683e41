#pragma once
// Cost of a frame against the amount of work: one kind varies, all else as in the session.
#include <string>
#include <vector>

#include "server/bench/bench_session.h"
#include "server/bench/results.h"

namespace lumigraft::server {

/// A frame to render, with more or less of one kind of work than in the session.
struct WorkCase {
  std::string work;
  double amount = 0;
  bool base = false;  ///< the session's own amount
  capture::Session session;
  capture::FrameSet frame;
  reconstruct::Scene scene;
  relight::Exhibit exhibit;
  relight::Plan plan;
};

/// Varies pixels, triangles, voxels, lights, objects, bounces. `plan` is that of the base case.
std::vector<WorkCase> work_cases(const capture::Session& session, const BenchScene& scene,
                                 const relight::Exhibit& exhibit, const relight::Plan& plan);

/// Writes STEM.svg and STEM.png.
void draw_cost_work(const BenchResults& results, const std::filesystem::path& stem);

}  // namespace lumigraft::server
