#pragma once
// A session with truth, and the scene reconstructed from its first frames.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "reconstruct/scene_builder.h"
#include "server/bench/measures.h"
#include "server/pipeline/service_config.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

/// Number of frames to process: enough for the room to be reconstructed.
constexpr int kBenchFrames = 24;

/// Reads a session and checks that truth/ has what the bench and the oracle need. Throws InputError.
ServiceInput open_bench_session(const std::filesystem::path& folder, const OracleParts& oracle);

struct BenchScene {
  capture::FrameSet frame;   ///< the last one that has the required truth
  reconstruct::Scene scene;  ///< as estimated at that frame
  capture::Image<std::uint8_t> camera;
  TruePictures truth;
  std::map<std::string, reconstruct::StageCost> stages;  ///< median over the frames, of those on which a stage ran
  std::vector<std::string> warnings;
};

/// Processes the first frames; the last frame whose truth has all parts of `needed`, a superset of `oracle`, is the one
/// to score. Throws InputError where there is no such frame.
BenchScene learn_bench_scene(const capture::Session& session, const OracleParts& oracle, const OracleParts& needed);

}  // namespace lumigraft::server
