#pragma once
// How the cost of a frame grows with work: one kind of it at a time, all else as in the session.
#include <functional>
#include <string>
#include <vector>

#include "server/bench/bench_session.h"
#include "server/bench/results.h"

namespace lumigraft::server {

/// A frame to draw, with more or less of one kind of work than in the session.
struct WorkCase {
  std::string work;
  double amount = 0;
  bool base = false;  ///< as it is in the session
  capture::Session session;
  capture::FrameSet frame;
  reconstruct::Scene scene;
  relight::Exhibit exhibit;
  relight::Plan plan;
};

/// Pixels of the picture, triangles of the exhibit, voxels, lights, objects, bounces. `plan` is the base's.
std::vector<WorkCase> work_cases(const capture::Session& session, const BenchScene& scene,
                                 const relight::Exhibit& exhibit, const relight::Plan& plan);

/// Writes STEM.svg and STEM.png.
void draw_cost_work(const BenchResults& results, const std::filesystem::path& stem);

}  // namespace lumigraft::server
