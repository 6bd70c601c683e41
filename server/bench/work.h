#pragma once
// How the cost of a frame grows with work: one kind of it at a time, all else as in the session.
#include <functional>
#include <string>
#include <vector>

#include "server/bench/results.h"
#include "server/bench/bench_session.h"

namespace lumigraft {

/// A frame to draw, with more or less of one kind of work than in the session.
struct WorkCase {
  std::string work;
  double amount = 0;
  bool base = false;  ///< as it is in the session
  Session session;
  FrameSet frame;
  Scene scene;
  Exhibit exhibit;
  Plan plan;
};

/// Pixels of the picture, triangles of the exhibit, voxels, lights, objects, bounces. `plan` is the base's.
std::vector<WorkCase> work_cases(const Session& session, const BenchScene& scene, const Exhibit& exhibit,
                                 const Plan& plan);

/// Writes STEM.svg and STEM.png.
void draw_cost_work(const BenchResults& results, const std::filesystem::path& stem);

}  // namespace lumigraft
